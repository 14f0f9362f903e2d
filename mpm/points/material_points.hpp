// What happens to points between two visits to the grid: their strain, what the law makes of it,
// the accounts, the new place. It depends on the kinematics and on the law, not on the grid's
// functions; BodyOf<Law> (body.hpp) runs through it, block by block, with the law in its middle.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "mpm/grid/cell_means.hpp"
#include "mpm/points/active_box.hpp"
#include "mpm/points/kinematics.hpp"
#include "mpm/points/material.hpp"
#include "mpm/points/numerics.hpp"
#include "mpm/points/point_sums.hpp"
#include "mpm/points/points.hpp"

namespace grainpair {

/// What the law is to see of a step, and what it is not.
struct Strained {
  DeformationOf<Wide> step;
  Wide detached;  // 1 where the point has come to fill its cell, else 0
};

/// What points of a cell share in a step: what they have given of their rates, and what they give
/// of their pressures.
struct CellsOfStep {
  const GivenCells& rates;  // volumetric rates and void ratios [1/s], [-]
  GivingCells& pressures;   // of sigma [Pa]
};

template <int Dim>
class MaterialPoints {
 public:
  static constexpr int dim = Dim;
  template <class Real>
  using VecOf = VectorOf<dim, Real>;
  template <class Real>
  using MatOf = MatrixOf<dim, Real>;
  using Vec = VecOf<double>;
  using Where = std::conditional_t<dim == 2, InPlane, InSpace>;

  Points<dim> points;
  // what the grid gave
  ExchangedArrays<MatOf> velocity_gradient;  // [1/s]
  ExchangedArrays<VecOf> grid_velocity;      // at the points, which move with it [m/s]
  std::vector<double> hoop;                  // v_r/r, where the run is axisymmetric [1/s]
  std::vector<double> volumetric_rate;       // where it counts, compression positive [1/s]
  // what points of a cell share
  ActiveBox<dim> box;
  std::vector<double> pressure;              // of sigma alone [Pa]
  std::vector<double> collisional_pressure;  // the part of it that collisions make, if any do [Pa]

  /// `single`: what comes from the grid comes in single precision. Where the run is axisymmetric x
  /// is the radius, and the hoop strain rate v_r/r has a stress that pulls on the radial momentum.
  MaterialPoints(const Numerics& numerics, Points<dim> of, double point_size, double density,
                 const Vec& weight, bool single, bool axisymmetric)
      : points(std::move(of)),
        velocity_gradient(points.size(), single),
        grid_velocity(points.size(), single),
        hoop(axisymmetric ? points.size() : 0),
        volumetric_rate(points.size()),
        pressure(points.size()),
        numerics_(numerics),
        axisymmetric_(axisymmetric),
        specific_volume_(1.0 / density),
        gravity_(weight) {
    for (const double e : points.void_ratio) loosest_mixed_ = std::max(loosest_mixed_, 2.0 * e);
    const double room = std::pow(std::max(1.0, 2.0 * point_size / numerics.h), dim);
    double cell_volume = 0.0;  // of plane strain and 3-D, over the thickness simulated [m3]
    for (std::size_t p = 0; p < points.size(); ++p)
      cell_volume = std::max(cell_volume, volume(p) * std::pow(numerics.h / point_size, dim));
    most_solid_ = room * density *
                  (axisymmetric ? 2.0 * std::numbers::pi * numerics.h * numerics.h : cell_volume);
  }

  /// point[i] <- point[order[i]], of what lasts from step to step, in tasks; once they are done,
  /// what does not needs its room (`resize_of_step`).
  void reorder(const Order& order, Tasks& tasks) {
    points.reorder(order, tasks);
    for (auto* field : {&pressure, &collisional_pressure})
      if (!field->empty()) tasks.push_back([field, &order] { reorder_field(*field, order); });
  }

  /// What the grid gives anew in every step.
  void resize_of_step() {
    velocity_gradient.resize(points.size()), grid_velocity.resize(points.size());
    volumetric_rate.resize(points.size());
    if (axisymmetric_) hoop.resize(points.size());
  }

  void archive(Archive& to) {
    points.archive(to);
    to.list("pressure", pressure), to.list("collisional_pressure", collisional_pressure);
    to.structure<int>("box_begin", box.begin), to.structure<int>("box_end", box.end);
    resize_of_step();
  }

  /// With points elsewhere on what is the largest of all: largest(own).
  template <class F>
  void agree(F&& largest) {
    loosest_mixed_ = largest(loosest_mixed_), most_solid_ = largest(most_solid_);
  }

  bool axisymmetric() const { return axisymmetric_; }

  /// A step of dt begins, of which points take their strain and, if `moves`, their way.
  void begin(double dt, bool moves) {
    dt_ = dt, moves_ = moves;
    mixing_rate_ = relaxed(dt, numerics_.void_ratio_relaxation) / dt;
  }

  /// Of points and their voids [m3/kg].
  Wide specific_volume(const Block& block) const {
    return (1.0 + block.load(points.void_ratio)) * specific_volume_;
  }
  Wide volume(const Block& block) const { return block.load(points.mass) * specific_volume(block); }
  double volume(std::size_t p) const {
    return points.mass[p] * (1.0 + points.void_ratio[p]) * specific_volume_;
  }

  /// Their volumetric rate and void ratio to their cells.
  void give_rate(const Block& block, const Wide& divergence, GivingCells& rates) {
    if (!numerics_.averaging) block.store(-divergence, volumetric_rate);
    if (!numerics_.averages_rates()) return;
    const Wide v = volume(block), e = block.load(points.void_ratio);
    const Wide mixed = select(e < loosest_mixed_, block.load(points.mass), Wide(0.0));
    rates.give(cell(block), {v, -(v * divergence), mixed, mixed * e});
  }

  /// What the law is to see of the step, and the void ratios it leads to. Points of a cell share
  /// its rate of volume change, and their void ratios relax to its mean, mass-weighted, so that the
  /// volume of the cell stays; the law sees the strain. Without this they would keep for ever what
  /// their void ratios differ by; on a critical-state locus 1e-5 of it is 1 kPa, and one point in
  /// four carries the load of all. Points more than twice as loose as any was at the start are not
  /// in contact with the others and do not mix. A point that has come to fill its cell is detached:
  /// it has nothing left to push against. The law sees the part of its strain that led there, and
  /// from then on none, and its stress stays its own; what that stress did to the grid beyond is
  /// booked as the detachment's.
  template <bool Axisymmetric>
  Strained strain(const Block& block, const GivenCells& rates, PointSums& sums) {
    Strained out;
    auto& step = out.step;
    const Wide e = block.load(points.void_ratio);
    Wide rate = 0.0;
    if (!numerics_.averaging) rate = block.load(volumetric_rate);
    if (numerics_.averages_rates()) {
      const auto sum = rates.take(cell(block));
      if (numerics_.averaging) rate = sum.value / sum.weight;
      // mixing_rate (e - mean e)/(1 + e)
      step.mixing = select(
          e < loosest_mixed_,
          mixing_rate_ * (e * sum.other_weight - sum.other_value) / (sum.other_weight * (1.0 + e)),
          Wide(0.0));
    }
    const auto gradient = velocity_gradient.load(block);
    Wide around = 0.0;
    if constexpr (Axisymmetric) around = block.load(hoop);
    const auto L = [&](int i, int j) {  // dv_i/dx_j
      if (Axisymmetric && i == 2 && j == 2) return around;
      return i < dim && j < dim ? gradient[static_cast<std::size_t>(j)][i] : Wide(0.0);
    };
    constexpr double r = 1.0 / std::numbers::sqrt2;
    step.D = {-L(0, 0),
              -L(1, 1),
              -L(2, 2),  // compression positive
              -r * (L(0, 1) + L(1, 0)),
              -r * (L(1, 2) + L(2, 1)),
              -r * (L(2, 0) + L(0, 2))};
    if (numerics_.volume_relaxation > 0.0) step.mixing += give_way(block, step.D, e);
    rate += step.mixing;
    step.D = plus_isotropic(step.D, (rate - trace(step.D)) * (1.0 / 3));
    step.spin << 0.5 * (L(2, 1) - L(1, 2)), 0.5 * (L(0, 2) - L(2, 0)), 0.5 * (L(1, 0) - L(0, 1));
    step.dt = dt_;
    // 1 + e_new = det(I + dt L) (1 + e)
    const Wide J = stretched_volume<Where>(dt_ * step.D, dt_ * step.spin);
    step.void_ratio_old = e;
    step.void_ratio = (1.0 + e) * J - 1.0;
    out.detached = 0.0;
    detach_full(block, J, out, sums);
    if (!all(step.void_ratio > 0.0))
      for (std::size_t lane = 0; lane < Wide::size(); ++lane)
        if (!(step.void_ratio[lane] > 0.0 || points.filler(block(lane))))
          sums.inverted = static_cast<std::ptrdiff_t>(block(lane));
    block.store(step.void_ratio, points.void_ratio);
    block.store(
        block.load(points.deviatoric_strain) + dt_ * std::sqrt(2.0 / 3.0) * deviator(step.D).norm(),
        points.deviatoric_strain);
    return out;
  }

  /// Rate at which a point gives up the volume that it has no room for, compression positive [1/s]:
  ///   d crowding = -crowding d gamma/volume_relaxation,  gamma: shear strain.
  /// What it has given up it does not give up again before volumes are counted anew.
  Wide give_way(const Block& block, const WideTensor& D, const Wide& e) {
    const Wide has = block.load(points.crowding);
    const Wide strain =
        dt_ * std::numbers::sqrt2 / numerics_.volume_relaxation * deviator(D).norm();
    const Wide gives = select(e < loosest_mixed_, has * strain / (1.0 + strain), Wide(0.0));
    block.store(has - gives, points.crowding);
    return gives / dt_;
  }

  /// A point that has come to fill its cell sees no neighbours to keep det F from growing, and its
  /// volume multiplies whatever stress it is left with; yet it cannot stand for more than the cell
  /// it lies in. Points so few that they fill their cells from the start are still in contact until
  /// they have grown to twice their size. J: of the step, as if it were not detached.
  void detach_full(const Block& block, const Wide& J, Strained& strained, PointSums& sums) const {
    auto& step = strained.step;
    const Wide mass = block.load(points.mass);
    const auto fills = (1.0 + step.void_ratio) * mass >= most_solid(block);
    if (!any(fills)) return;
    const auto log = [](const Wide& a) {
      return each_lane([](double b) { return std::log(b); }, a);
    };
    const Wide e = step.void_ratio_old, loosest = most_solid(block) / mass - 1.0;
    const Wide room = log((1.0 + loosest) / (1.0 + e));
    const Wide share = select(fills, select(room > 0.0, room / log(J), Wide(0.0)), Wide(1.0));
    sums.detached += reduce(dt_ * (1.0 - share) * (mass * (1.0 + e) * specific_volume_) *
                            points.sigma.load(block).dot(step.D));
    step.void_ratio = select(fills, loosest, step.void_ratio);
    step.D = share * step.D, step.mixing = share * step.mixing;
    strained.detached = select(fills, Wide(1.0), Wide(0.0));
  }

  /// What the law made of it, to the points and to the sums. What a law without fluctuations leaves
  /// at zero is not touched.
  template <Accounts accounts>
  void book(const Block& block, const Wide& mixing, const Wide& detached, const Outcome& law,
            GivingCells& pressures, PointSums& sums) {
    WideTensor sigma = law.sigma;
    Wide collisional = law.collisional_pressure;
    if (const auto alone = detached > 0.0; any(alone))
      sigma = select(alone, WideTensor::Zero(), sigma),
      collisional = select(alone, Wide(0.0), collisional);
    points.sigma.store(sigma, block, Where::tensor);
    block.store(block.load(points.plastic) + law.energies.plastic, points.plastic);
    const Wide m = block.load(points.mass), inverse_density = specific_volume(block),
               v = m * inverse_density;
    const Wide p = trace(sigma) * (1.0 / 3.0);
    const bool mixes = numerics_.changes_volumes();
    Wide contact = block.load(pressure) + p;  // twice the mean pressure that worked on the mixing
    if constexpr (accounts.fluctuates) {
      contact -= block.load(collisional_pressure) + collisional;
      block.store(collisional, collisional_pressure);
    }
    if (mixes) sums.mixing += (0.5 * dt_) * (v * (contact * mixing));
    if (mixes) block.store(p, pressure);
    sums.energies.stored += m * law.energies.stored;
    sums.energies.plastic += m * law.energies.plastic;
    if constexpr (accounts.fluctuates) {
      block.store(law.granular_temperature, points.granular_temperature);
      block.store(law.energies.fluctuation, points.fluctuation);
      block.store(block.load(points.regime_4) + law.energies.regime_4, points.regime_4);
      sums.energies.fluctuation += m * law.energies.fluctuation;
      sums.energies.regime_4 += m * law.energies.regime_4;
    }
    if constexpr (accounts.contacts) {
      block.store(block.load(points.contact) + law.energies.contact, points.contact);
      sums.energies.contact += m * law.energies.contact;
    }
    limit_step<accounts.fluctuates>(block, inverse_density, law.stability, sums.fastest);
    if (moves_) move(block, sums);
    if (numerics_.averages_pressures()) pressures.give(cell(block), {v, v * p});
  }

  /// To their new places; a point that would leave the grid is named.
  void move(const Block& block, PointSums& sums) {
    const auto x = points.x.load(block) + Wide(dt_) * grid_velocity.load(block);
    points.x.store(x, block);
    Wide height = 0.0;
    for (int d = 0; d < dim; ++d) height -= gravity_[d] * x[d];
    sums.potential += block.load(points.mass) * height;
    const auto inside = box.holds(x);
    if (!all(inside))
      for (std::size_t lane = 0; lane < Wide::size(); ++lane)
        if (!inside[lane]) sums.escaped = static_cast<std::ptrdiff_t>(block(lane));
    store_whole(select(inside, box.cell(x), Wide(0.0)), block, cells_);
  }
  /// Number of the cell of the box that each lies in: sought where points move, and when they or
  /// the box have been changed (`find_cells`).
  Index<Wide> cell(const Block& block) const {
    Index<Wide> out;
    std::copy_n(&cells_[block.first], out.size(), out.begin());
    return out;
  }
  Index<Wide> cell(const Scattered& at) const {
    Index<Wide> out;
    for (std::size_t lane = 0; lane < out.size(); ++lane) out[lane] = cells_[at(lane)];
    return out;
  }
  void find_cells() {
    cells_.resize(points.size());
    for_each_block(0, points.size(), [&](const Block& block) {
      store_whole(box.cell(points.x.load(block)), block, cells_);
    });
  }

  /// Their pressure to their cells.
  void give_pressure(const Block& block, GivingCells& pressures) const {
    if (!numerics_.averages_pressures()) return;
    const Wide v = volume(block);
    pressures.give(cell(block), {v, v * block.load(pressure)});
  }

  /// What the internal force takes: the stress with the pressure through the same average as the
  /// volumetric rate, so that the work of the two is the same, sum V p avg(tr D) = sum V avg(p) tr
  /// D [Pa].
  WideTensor felt_stress(const Block& block, const GivenCells& pressures) const {
    const WideTensor sigma = points.sigma.load(block, Where::tensor);
    return plus_isotropic(sigma, pressure_correction(block, trace(sigma) * (1.0 / 3.0), pressures));
  }
  /// What averaging adds to a point's own pressure [Pa].
  template <class B>
  Wide pressure_correction(const B& block, const Wide& own, const GivenCells& pressures) const {
    if (!numerics_.averages_pressures()) return 0.0;
    const auto sum = pressures.take(cell(block));
    return sum.value / sum.weight - own;
  }

  /// Largest stable step of a Kelvin-Voigt point on the grid [Belytschko2014, Eq. 6.2.19 with
  /// damping]:
  ///   dt = 2/omega (sqrt(1 + xi^2) - xi),  omega = 2 c sqrt(dim)/h,  xi = nu omega/(2 c^2),  nu =
  ///   viscosity/density
  /// (A point alone is stiffer than the bulk: c^2 sum_k dw_k^2/w_k summed over the axes, of
  /// quadratic B-splines up to 6 dim c^2/h^2; its limit is sqrt(2/3) of this one.)
  template <bool Viscous>
  void limit_step(const Block& block, const Wide& inverse_density, const StabilityOf<Wide>& of,
                  Fastest& fastest) const {
    const double k = largest_wave_number_;
    const Wide c2 = of.modulus * inverse_density,
               damping = Viscous ? 0.5 * k * (of.viscosity * inverse_density) : Wide(0.0);
    // 2/omega (sqrt(1 + xi^2) - xi) = 2/(k (sqrt(c^2 + d^2) + d)) with d = nu k/2, without dividing
    // by c; and without the root k (sqrt(c^2 + d^2) + d) > rate where c^2 + 2 d rate/k > (rate/k)^2
    const double most = fastest.rate * inverse_wave_number_;
    if (!any(c2 + (2.0 * most) * damping > most * most)) return;
    const Wide rate = k * (sqrt(c2 + damping * damping) + damping);
    for (std::size_t lane = 0; lane < Wide::size(); ++lane)
      if (rate[lane] > fastest.rate && !points.filler(block(lane))) {
        const std::size_t p = block(lane);
        fastest = {rate[lane],
                   damping[lane] * damping[lane] > c2[lane] ? Limit::viscous
                   : points.regime[p] == 3                  ? Limit::critical_state
                                                            : Limit::elastic,
                   points.id[p]};
      }
  }

 private:
  /// Mass times specific volume, relative to the solid's, at which a point fills its cell [kg].
  Wide most_solid(const Block& block) const {
    if (axisymmetric_) return most_solid_ * points.x.load(block)[0];
    return most_solid_;
  }

  Numerics numerics_;
  bool axisymmetric_;
  double specific_volume_;               // of solid [m3/kg]
  Vec gravity_;                          // [m/s2]
  double loosest_mixed_ = 0.0;           // void ratio [-]
  double most_solid_ = 0.0;              // [kg], axisymmetric [kg/m]
  double dt_ = 0.0, mixing_rate_ = 0.0;  // [s], [1/s]
  double largest_wave_number_ =
      2.0 * std::sqrt(static_cast<double>(dim)) / numerics_.h;  // times 2/2 [1/m]
  double inverse_wave_number_ = 1.0 / largest_wave_number_;     // [m]
  bool moves_ = true;
  std::vector<std::int32_t> cells_;
};

}  // namespace grainpair
