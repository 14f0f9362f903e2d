#include "mpm/step/watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "cases/failure.hpp"

namespace grainpair {
namespace {

constexpr double growth = 0.5;  // of the energy held at release: an instability soon gets there
constexpr double drift = 0.05;  // of the same
// Of the same: what warns of drift is not reached if this shortens the step; within the claimed
// limit columns make 1e-4 of it at most, and 6e-3 at twice the limit.
constexpr double halving = 0.02;
constexpr int most_halvings = 3;     // what an eighth of the step does not cure is not the step's
constexpr double most_speed = 3.0;   // sqrt(2 g H): nine times the energy a fall can give a point
constexpr double most_noise = 0.02;  // of the kinetic energy, while there is some
constexpr double most_roughness = 0.5;   // rms deviation over that of the cells' means
constexpr double most_crowding = 0.1;    // of the volume: as much of a layer's height
constexpr double most_loss = 1.0 / 3.0;  // of the energy released
constexpr double most_tension = 0.01;    // of rho_s g H
constexpr double most_end = 1e-3;        // of the mass: no run-out is told by so little
constexpr double early = 1.0;            // sqrt(H/g): later, the flow is thinner than its cells

struct CellSums {
  double mass = 0.0, volume = 0.0, pressure = 0.0;
  Vec3 velocity = Vec3::Zero(), place = Vec3::Zero();
  std::vector<std::uint32_t> members;
};
using Cells = std::unordered_map<long, CellSums>;  // cells of a row follow each other
constexpr long row = 65536;

/// Motion and pressures within the cells, summed over them [J], [kg Pa2].
struct WithinCells {
  double residual = 0.0, moving = 0.0, deviation = 0.0, means = 0.0;
};

/// Over all points [J], [kg]. Of a cell that two ranks share, each looks at its own points.
struct SumsOfPoints {
  double kinetic = 0.0, mass = 0.0, at_end = 0.0;
  WithinCells within;
  double claimed = 0.0, crowded = 0.0;  // volume, and what of it has no room [m3]

  SumsOfPoints& operator+=(const SumsOfPoints& more) {
    kinetic += more.kinetic, mass += more.mass, at_end += more.at_end;
    within.residual += more.within.residual, within.moving += more.within.moving;
    within.deviation += more.within.deviation, within.means += more.within.means;
    claimed += more.claimed, crowded += more.crowded;
    return *this;
  }
};

template <class P>
double own_pressure(const P& points, std::size_t p) {
  return points.sigma[p].template head<3>().sum() / 3.0;
}

template <class P>
Cells cells_of(const Simulation& simulation, const P& points, double size) {
  Cells cells;
  for (const std::size_t p : points.occupied()) {
    const Vec3 x = simulation.position(p);
    const double m = points.mass[p];
    long key = 0;
    for (int d = 0; d < P::dimension; ++d) key = key * row + static_cast<long>(x[d] / size);
    CellSums& cell = cells[key];
    cell.mass += m;
    cell.volume += m * (1.0 + points.void_ratio[p]) / simulation.solid_density();
    cell.pressure += m * (own_pressure(points, p) + simulation.pressure_correction(p));
    cell.velocity += m * simulation.velocity(p), cell.place += m * x;
    cell.members.push_back(static_cast<std::uint32_t>(p));
  }
  return cells;
}

/// What a cell's points do that an affine motion of the cell does not tell.
template <class P>
void look_into(const Simulation& simulation, const P& points, const CellSums& cell, double size,
               WithinCells& sums) {
  const Vec3 place = cell.place / cell.mass, mean = cell.velocity / cell.mass;
  const double pressure = cell.pressure / cell.mass;
  // least squares v = mean + A (x - place): what is left is motion the cell cannot see
  Mat3 inertia = 1e-12 * cell.mass * size * size * Mat3::Identity(), moment = Mat3::Zero();
  for (const auto p : cell.members) {
    const Vec3 r = simulation.position(p) - place, v = simulation.velocity(p) - mean;
    inertia += points.mass[p] * r * r.transpose();
    moment += points.mass[p] * v * r.transpose();
    const double own = own_pressure(points, p) + simulation.pressure_correction(p);
    sums.deviation += points.mass[p] * (own - pressure) * (own - pressure);
  }
  sums.means += cell.mass * pressure * pressure;
  if (cell.members.size() <= P::dimension + 1) return;  // the fit leaves nothing
  const Mat3 slope = moment * inertia.inverse();
  for (const auto p : cell.members) {
    const Vec3 v = simulation.velocity(p);
    const Vec3 left = v - mean - slope * (simulation.position(p) - place);
    sums.residual += 0.5 * points.mass[p] * left.squaredNorm();
    sums.moving += 0.5 * points.mass[p] * v.squaredNorm();
  }
}

/// From a cell to those around it, and to itself.
template <int Dim>
std::vector<long> steps_around() {
  std::vector<long> out{0};
  long along = 1;
  for (int d = 0; d < Dim; ++d, along *= row)
    for (std::size_t i = 0, count = out.size(); i < count; ++i)
      out.push_back(out[i] - along), out.push_back(out[i] + along);
  return out;
}

std::string what_is_not_finite(const Simulation& simulation) {
  std::string what = "an energy";
  simulation.visit_points([&](const auto& points) {
    for (const std::size_t p : points.occupied()) {
      const char* field = !std::isfinite(points.granular_temperature[p]) ? "granular temperature"
                          : !std::isfinite(points.sigma[p].sum())        ? "stress"
                          : !std::isfinite(points.v[p].sum())            ? "velocity"
                                                                         : nullptr;
      if (!field) continue;
      what = fmt::format("the {} of point {} (void ratio {:.4g})", field, points.id[p],
                         points.void_ratio[p]);
      return;
    }
  });
  return what;
}

}  // namespace

Watch::Watch(const Simulation& simulation, const Column& column, double cell)
    : held_(simulation.ledger().held()),
      slope_(simulation.ledger().slope),
      fall_(std::sqrt(2.0 * column.gravity * column.height)),
      tau_(std::sqrt(column.height / column.gravity)),
      pressure_(simulation.solid_density() * column.gravity * column.height),
      cell_(cell),
      last_cell_(column.floor_length - cell),
      estimated_(!simulation.tells_energies()) {
  simulation.visit_points([&](const auto& points) {
    for (const std::size_t p : points.occupied()) mass_ += points.mass[p];
  });
  simulation.ranks().sum(std::span(&mass_, 1));
}

void Watch::step(const Simulation& simulation, long steps) {
  const EnergyLedger& now = simulation.ledger();
  if (!std::isfinite(now.total()))
    throw SolverError(Failure::not_finite,
                      "step {}: {} is not finite at t = {:.4g} s lower mpm.time_step_fraction",
                      steps, what_is_not_finite(simulation), simulation.time());
  // an account that falls below zero has made energy out of nothing
  created_ =
      std::max(created_, std::max(0.0, -now.transfer) + std::max(0.0, -now.time_integration) +
                             std::max(0.0, -now.mixing) + std::max(0.0, -now.conduction));
  const double held = offered(now);
  if (halvings_ < most_halvings && -now.time_integration > (halvings_ + 1) * halving * held &&
      ++halvings_ == 1)
    first_halved_ = simulation.time();
  if (created_ > growth * held)
    throw SolverError(
        Failure::energy_growth,
        "step {}: energy grew to {:.2g} J more than was held at release, {:.0f} % of it, at t = "
        "{:.4g} s lower mpm.time_step_fraction",
        steps, created_, 100.0 * created_ / held, simulation.time());
}

void Watch::points(const Simulation& simulation) {
  const double driven = std::max(0.0, slope_ - simulation.ledger().slope);  // [J]
  const double fall = driven > 0.0 ? std::sqrt(fall_ * fall_ + 2.0 * driven / mass_) : fall_;
  const Ranks& ranks = simulation.ranks();
  SumsOfPoints sums;
  std::optional<SolverError> failed;
  simulation.visit_points([&](const auto& points) {
    for (const std::size_t p : points.occupied()) {
      const Vec3 x = simulation.position(p), v = simulation.velocity(p);
      if (v.norm() > most_speed * fall && !failed)
        failed = SolverError(
            Failure::ejected,
            "point {}: too fast at ({:.4g}, {:.4g}, {:.4g}) m, t = {:.4g} s ({:.3g} m/s, {:.1f} "
            "times the fall from the column's height) lower mpm.time_step_fraction, or use "
            "smoother mpm.shape: nodes with next to no mass throw points",
            points.id[p], x[0], x[1], x[2], simulation.time(), v.norm(), v.norm() / fall);
      const double held = own_pressure(points, p) - simulation.collisional_pressure(p);
      tension_ = std::max(tension_, -held / pressure_);
      sums.kinetic += 0.5 * points.mass[p] * v.squaredNorm();
      sums.mass += points.mass[p], sums.at_end += x[0] > last_cell_ ? points.mass[p] : 0.0;
    }
    ranks.refuse(failed);
    const Cells cells = cells_of(simulation, points, cell_);
    constexpr int dim = std::decay_t<decltype(points)>::dimension;
    constexpr long widest = dim == 2 ? row : row * row;  // from one x to the next
    const std::vector<long> around = steps_around<dim>();
    for (const auto& [key, cell] : cells) {
      look_into(simulation, points, cell, cell_, sums.within);
      sums.claimed += cell.volume;
      const bool inner =
          std::ranges::all_of(around, [&, at = key](long to) { return cells.contains(at + to); });
      if (!inner) continue;  // what room it has nobody knows
      const double x = cell_ * (static_cast<double>(key / widest) + 0.5);
      sums.crowded += cell.volume - std::pow(cell_, dim) * simulation.depth(x);
    }
  });
  ranks.sum(std::span(&sums, 1));
  tension_ = ranks.largest(tension_);
  const WithinCells& within = sums.within;
  at_end_ = std::max(at_end_, sums.at_end / sums.mass);
  crowding_ = std::max(crowding_, sums.crowded / sums.claimed);
  peak_ = std::max(peak_, sums.kinetic);
  if (sums.kinetic > 0.1 * peak_ && within.moving > 0.1 * sums.kinetic)
    noise_ = std::max(noise_, within.residual / within.moving);
  if (simulation.time() < early * tau_ && within.means > 0.0)
    roughness_ += std::sqrt(within.deviation / within.means), ++rough_looks_;
}

void Watch::archive(Archive& to) {
  to.number("watch/created", created_), to.number("watch/peak", peak_),
      to.number("watch/noise", noise_);
  to.number("watch/roughness", roughness_), to.number("watch/rough_looks", rough_looks_);
  to.number("watch/crowding", crowding_);
  to.number("watch/tension", tension_), to.number("watch/at_end", at_end_);
  to.number("watch/halvings", halvings_), to.number("watch/first_halved", first_halved_);
}

std::vector<std::string> Watch::warnings(const EnergyLedger& begin, const EnergyLedger& end) const {
  std::vector<std::string> out;
  const auto say = [&]<class... Args>(Warning warning, fmt::format_string<Args...> text,
                                      Args&&... args) {
    out.push_back(
        fmt::format("{}: {}", name(warning), fmt::format(text, std::forward<Args>(args)...)));
  };
  const double released = begin.potential - end.potential + (begin.slope - end.slope);
  const double held = offered(end);
  if (created_ > drift * held)
    say(Warning::drift,
        "the numerics made {:.0f} % of the energy held at release out of nothing (lower "
        "mpm.time_step_fraction)",
        100.0 * created_ / held);
  if (halvings_ > 0)
    say(Warning::halved,
        "steps were too long and were cut to 1/{} of the limit allowed, from t = {:.4g} s on "
        "(lower mpm.time_step_fraction, and nothing is cut)",
        1 << halvings_, first_halved_);
  if (noise_ > most_noise)
    say(Warning::noise,
        "up to {:.0f} % of the kinetic energy is in motion of points that their cell cannot see "
        "(lower mpm.velocity_relaxation)",
        100.0 * noise_);
  if (rough_looks_ > 0 && roughness_ / rough_looks_ > most_roughness)
    say(Warning::locking,
        "the pressure of points differs within their cells by {:.1f} times its mean, early in "
        "the run (set mpm.volumetric_averaging to cell)",
        roughness_ / rough_looks_);
  if (crowding_ > most_crowding)
    say(Warning::crowding,
        "for {:.0f} % of the volume that points claim there is no room (set mpm.volume_relaxation "
        "to 1)",
        100.0 * crowding_);
  if (released > 0.0 && end.transfer > most_loss * released)
    say(Warning::loss,
        "the transfer between points and grid took {:.0f} % of the energy released "
        "(use affine_flip, or finer cells)",
        100.0 * end.transfer / released);
  if (tension_ > most_tension)
    say(Warning::tension,
        "a point pulls with {:.2g} of the column's pressure, beyond the apex of any cone",
        tension_);
  if (estimated_)
    say(Warning::estimated,
        "the law's library tells no energies: elastic energy is that of the stress under its "
        "moduli of unloading, and the rest of the stress's work counts as plastic (SSE and SPD of "
        "a UMAT, stored and dissipated of a block)");
  if (at_end_ > most_end)
    say(Warning::end,
        "{:.2g} % of the mass came to the last cell of the floor, which ends in a wall (lengthen "
        "geometry.floor_length)",
        100.0 * at_end_);
  return out;
}

}  // namespace grainpair
