// What a run may not do, watched while it goes on. A trouble no result survives ends the run with a
// line that names it; one that only spoils the result is kept as a warning. Thresholds are shares
// of what the scene itself offers: the energy held at the release, the speed of free fall from the
// column's height, the pressure that is there.
#pragma once

#include <cmath>
#include <string>
#include <unordered_map>
#include <vector>

#include "cases/failure.hpp"
#include "mpm/step/solver.hpp"

namespace grainpair {

class Watch {
 public:
  /// `height` [m] and `gravity` [m/s2] of the column; `cell` [m]: points of one cell are compared
  /// with one another.
  Watch(const Simulation& simulation, double height, double gravity, double cell)
      : held_(simulation.ledger().held()),
        fall_(std::sqrt(2.0 * gravity * height)),
        tau_(std::sqrt(height / gravity)),
        pressure_(simulation.solid_density() * gravity * height),
        cell_(cell) {}

  /// After every step. Throws SolverError: not finite, energy growth.
  void step(const Simulation& simulation, long steps) {
    const EnergyLedger& now = simulation.ledger();
    if (!std::isfinite(now.total()))
      throw SolverError(Failure::not_finite, "{}", not_finite(simulation, steps));
    // an account that falls below zero has made energy out of nothing
    created_ =
        std::max(created_, std::max(0.0, -now.transfer) + std::max(0.0, -now.time_integration) +
                               std::max(0.0, -now.mixing) + std::max(0.0, -now.conduction));
    if (created_ > growth * held_)
      throw SolverError(
          Failure::energy_growth,
          "step {}: energy grew to {:.2g} J more than was held at release, {:.0f} % of it, at t = "
          "{:.4g} s lower mpm.time_step_fraction",
          steps, created_, 100.0 * created_ / held_, simulation.time());
  }

  /// At every row of the energy history. Throws SolverError for a point no fall could have made so
  /// fast; gathers warnings.
  void points(const Simulation& simulation) {
    simulation.visit_points([&](const auto& points) { inspect(simulation, points); });
  }

  /// What spoils the result without ending it, one line each that starts with the warning's name;
  /// the end of the run is the time to ask.
  std::vector<std::string> warnings(const EnergyLedger& begin, const EnergyLedger& end) const {
    std::vector<std::string> out;
    const auto say = [&]<class... Args>(Warning warning, fmt::format_string<Args...> text,
                                        Args&&... args) {
      out.push_back(
          fmt::format("{}: {}", name(warning), fmt::format(text, std::forward<Args>(args)...)));
    };
    const double released = begin.potential - end.potential;
    if (created_ > drift * held_)
      say(Warning::drift,
          "the numerics made {:.0f} % of the energy held at release out of nothing (lower "
          "mpm.time_step_fraction)",
          100.0 * created_ / held_);
    if (noise_ > most_noise)
      say(Warning::noise,
          "up to {:.0f} % of the kinetic energy is in motion of points that their cell cannot see "
          "(lower mpm.relaxation_time)",
          100.0 * noise_);
    if (rough_looks_ > 0 && roughness_ / rough_looks_ > most_roughness)
      say(Warning::locking,
          "the pressure of points differs within their cells by {:.1f} times its mean, early in "
          "the run (use mpm.volumetric_averaging)",
          roughness_ / rough_looks_);
    if (released > 0.0 && end.transfer > most_loss * released)
      say(Warning::loss,
          "the transfer between points and grid took {:.0f} % of the energy released "
          "(use affine_flip, or finer cells)",
          100.0 * end.transfer / released);
    if (tension_ > most_tension)
      say(Warning::tension,
          "a point pulls with {:.2g} of the column's pressure, beyond the apex of any cone",
          tension_);
    return out;
  }

 private:
  static constexpr double growth =
      0.5;  // of the energy held at release: an instability gets there in some steps
  static constexpr double drift = 0.05;  // of the same
  static constexpr double most_speed =
      3.0;  // sqrt(2 g H): nine times the energy a fall can give a point
  static constexpr double most_noise = 0.02;  // of the kinetic energy, while there is some
  static constexpr double most_roughness =
      0.5;  // root mean square deviation over that of the cells' means
  static constexpr double most_loss = 1.0 / 3.0;  // of the energy released
  static constexpr double most_tension = 0.01;    // of rho_s g H
  static constexpr double early = 1.0;  // sqrt(H/g): later, the flow is thinner than its cells

  struct CellSums {
    double mass = 0.0, pressure = 0.0;
    Vec3 velocity = Vec3::Zero(), place = Vec3::Zero();
    std::vector<std::uint32_t> members;
  };

  template <class P>
  void inspect(const Simulation& simulation, const P& points) {
    constexpr int dim = P::dimension;
    std::unordered_map<long, CellSums> cells;
    double kinetic = 0.0;
    for (std::size_t p = 0; p < points.size(); ++p) {
      const Vec3 x = simulation.position(p), v = simulation.velocity(p);
      if (v.norm() > most_speed * fall_)
        throw SolverError(
            Failure::ejected,
            "point {}: too fast at ({:.4g}, {:.4g}, {:.4g}) m, t = {:.4g} s ({:.3g} m/s, {:.1f} "
            "times the fall from the column's height) lower mpm.time_step_fraction, or use "
            "smoother mpm.shape: nodes with next to no mass throw points",
            points.id[p], x[0], x[1], x[2], simulation.time(), v.norm(), v.norm() / fall_);
      const double m = points.mass[p], pressure = points.sigma[p].template head<3>().sum() / 3.0;
      tension_ = std::max(tension_, -pressure / pressure_);
      kinetic += 0.5 * m * v.squaredNorm();
      long key = 0;
      for (int d = 0; d < dim; ++d) key = key * 65536 + static_cast<long>(x[d] / cell_);
      CellSums& cell = cells[key];
      cell.mass += m, cell.pressure += m * (pressure + simulation.pressure_correction(p));
      cell.velocity += m * v, cell.place += m * x;
      cell.members.push_back(static_cast<std::uint32_t>(p));
    }
    peak_ = std::max(peak_, kinetic);
    double residual = 0.0, moving = 0.0, deviation = 0.0, means = 0.0;
    for (auto& [key, cell] : cells) {
      const Vec3 place = cell.place / cell.mass, mean = cell.velocity / cell.mass;
      const double pressure = cell.pressure / cell.mass;
      // least squares v = mean + A (x - place): what is left is motion the cell cannot see
      Mat3 inertia = 1e-12 * cell.mass * cell_ * cell_ * Mat3::Identity(), moment = Mat3::Zero();
      for (const auto p : cell.members) {
        const Vec3 r = simulation.position(p) - place, v = simulation.velocity(p) - mean;
        inertia += points.mass[p] * r * r.transpose();
        moment += points.mass[p] * v * r.transpose();
        const double own =
            points.sigma[p].template head<3>().sum() / 3.0 + simulation.pressure_correction(p);
        deviation += points.mass[p] * (own - pressure) * (own - pressure);
      }
      means += cell.mass * pressure * pressure;
      if (cell.members.size() <= dim + 1) continue;  // the fit leaves nothing
      const Mat3 slope = moment * inertia.inverse();
      for (const auto p : cell.members) {
        const Vec3 v = simulation.velocity(p);
        const Vec3 left = v - mean - slope * (simulation.position(p) - place);
        residual += 0.5 * points.mass[p] * left.squaredNorm();
        moving += 0.5 * points.mass[p] * v.squaredNorm();
      }
    }
    if (kinetic > 0.1 * peak_ && moving > 0.1 * kinetic)
      noise_ = std::max(noise_, residual / moving);
    if (simulation.time() < early * tau_ && means > 0.0)
      roughness_ += std::sqrt(deviation / means), ++rough_looks_;
  }

  static std::string not_finite(const Simulation& simulation, long steps) {
    std::string what = "an energy";
    simulation.visit_points([&](const auto& points) {
      for (std::size_t p = 0; p < points.size(); ++p) {
        const char* field = !std::isfinite(points.granular_temperature[p]) ? "granular temperature"
                            : !std::isfinite(points.sigma[p].sum())        ? "stress"
                            : !std::isfinite(points.v[p].sum())            ? "velocity"
                                                                           : nullptr;
        if (field) {
          what = fmt::format("the {} of point {} (void ratio {:.4g})", field, points.id[p],
                             points.void_ratio[p]);
          return;
        }
      }
    });
    return fmt::format("step {}: {} is not finite at t = {:.4g} s lower mpm.time_step_fraction",
                       steps, what, simulation.time());
  }

  double held_, fall_, tau_, pressure_, cell_;
  double created_ = 0.0, peak_ = 0.0;
  double noise_ = 0.0, roughness_ = 0.0, tension_ = 0.0;
  long rough_looks_ = 0;
};

}  // namespace grainpair
