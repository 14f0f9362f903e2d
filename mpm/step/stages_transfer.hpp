// Between points and grid: the way there, the balance of momentum on the nodes, and the way back.
#pragma once

#include <ctime>

#include "mpm/grid/interpolation_plane.hpp"
#include "mpm/grid/interpolation_space.hpp"
#include "mpm/step/solver.hpp"

namespace grainpair {

/// Adds the processor time from here to the end of its scope to a sum, if there is one.
class Timed {
 public:
  explicit Timed(double* sum) : sum_(sum), start_(sum ? now() : 0.0) {}
  Timed(const Timed&) = delete;
  ~Timed() {
    if (sum_) *sum_ += now() - start_;
  }

 private:
  static double now() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }
  double* sum_;
  double start_;
};

/// Nodes without momentum, cells without sums.
template <int D, class S, class E>
auto Solver<D, S, E>::clear_grid() -> ClearedGrid {
  const Timed timed(times_ ? &times_->to_grid : nullptr);
  const auto& box = material_.box;
  const auto slices = static_cast<std::size_t>(box.end[0] - box.begin[0]);
  for_each_slice([&](int i) {
    const auto slice = static_cast<std::size_t>(i - box.begin[0]);
    spent_rates_.clear_slice(slice, slices);
    spent_pressures_.clear_slice(slice, slices);
    clear_nodes(i);
  });
  return {{GivingCells(std::move(spent_rates_)), GivingCells(std::move(spent_pressures_))}};
}

/// The same in the middle of a step; cells have been given nothing yet.
template <int D, class S, class E>
auto Solver<D, S, E>::clear_grid(MovingGrid old) -> ClearedGrid {
  for_each_slice([&](int i) { clear_nodes(i); });
  return {std::move(old.cells)};
}

template <int D, class S, class E>
void Solver<D, S, E>::clear_nodes(int slice) {
  for_each_node_of_slice(slice, [](Node<dim>& node, const auto&) {
    node.motion.setZero();
    node.change.setZero();
    node.mass = 0.0;
  });
}

/// Mass, momentum and internal force of the points to the nodes:
///   m_i = sum_p w_ip m_p,  (m v)_i = sum_p w_ip m_p (v_p + C_p (X_i - x_p)),
///   f_i = sum_p V_p sigma_p grad w_ip
/// where C_p is the point's own gradient or B_p D_p^-1, D_p = sum_i w_ip (X_i - x_p)(X_i - x_p)^T,
/// diagonal for tensor-product functions. (Compression is positive, hence the sign of f.)
template <int D, class S, class E>
auto Solver<D, S, E>::scatter(ClearedGrid grid, Forces forces) -> LoadedGrid {
  const Timed timed(times_ ? &times_->to_grid : nullptr);
  for_each_strip([&](std::size_t s) { scatter_strip(strips_[s], forces); });
  return {std::move(grid.cells)};
}

template <int D, class S, class E>
[[gnu::flatten]] void Solver<D, S, E>::scatter_strip(const Strip& strip, Forces forces) {
  const Affine affine = affine_of(setup_.numerics.transfer);
  for_each_blocks<E>(strip.begin, strip.end, [&](const Blocks<E>& blocks) {
    std::array<GivenOf<Wide>, halves> given;
#pragma GCC unroll 2
    for (std::size_t h = 0; h < given.size(); ++h) {
      const Block& block = blocks[h];
      auto& [mass, momentum, force, momentum_slope, force_slope] = given[h];
      mass = block.load(points_.mass);
      momentum = mass * points_.v.load(block);
      force = VecOf<Wide>::Zero();
      momentum_slope.fill(VecOf<Wide>::Zero()), force_slope.fill(VecOf<Wide>::Zero());
      if (forces == Forces::with) {
        const auto stress = material_.volume(block) * material_.felt_stress(block, pressures_);
        for (int d = 0; d < dim; ++d)
          for (int i = 0; i < dim; ++i) force_slope[d][i] = component(stress, i, d);
        if (dim == 2 && setup_.axisymmetric) force[0] = stress[2] / points_.x.load(block)[0];
      }
    }
    const auto at = neighbours(blocks);
    auto all = merge<GivenOf, E>(given);
    if (affine != Affine::none) {
      const MatOf<E> carried = points_.affine.template load_blocks<E>(blocks);
      for (int d = 0; d < dim; ++d)
        all.momentum_slope[d] =
            (affine == Affine::moment ? at.n[d].inverse_inertia * all.mass : all.mass) * carried[d];
    }
    give(all, at);
  });
}

/// What gate and walls make of a nodal velocity.
template <int D, class S, class E>
[[gnu::noinline]] auto Solver<D, S, E>::constrained_here(Vec v, const std::array<int, dim>& node,
                                                         double time) const -> Vec {
  if (setup_.gate.present && v[0] > 0.0 &&
      setup_.gate.closes(grid_.axes[0].node_position[static_cast<std::size_t>(node[0])],
                         grid_.axes[1].node_position[static_cast<std::size_t>(node[1])], time))
    v[0] = 0.0;
  for (int d = dim - 1; d >= 0; --d) {
    if (node[d] > 0 && node[d] < grid_.axes[d].nodes - 1) continue;
    if (node[d] == 0) v = setup_.walls[d][0].apply(v, d, 1.0);
    if (node[d] == grid_.axes[d].nodes - 1) v = setup_.walls[d][1].apply(v, d, -1.0);
  }
  return v;
}

/// v_new = v + dt (f/m + g), then the walls. Work of each force is taken with the mean of old and
/// final velocity, so that it equals the change of nodal kinetic energy exactly. The walls act
/// twice: first on what the points' momenta ask for, which the walls had refused already at the end
/// of the last step: what that costs is the transfer's doing, not theirs. Fixed walls and rollers
/// then do no work, and the wall's account holds friction alone.
template <int D, class S, class E>
[[gnu::flatten]] auto Solver<D, S, E>::accelerate(LoadedGrid grid, double dt) -> MovingGrid {
  work_.assign(static_cast<std::size_t>(material_.box.end[0]), {});
  for_each_slice([&](int i) {
    Work sum;
    for_each_node_of_slice(i, [&](Node<dim>& node, const auto& index) {
      const double m = node.mass;
      if (m <= 0.0) {
        node.motion.setZero();
        node.change.setZero();
        hand_out(node);
        return;
      }
      const double inverse = 1.0 / m;
      const Vec mapped = inverse * node.motion;
      const Vec old = constrained(mapped, index, time_);
      const Vec free = old + dt * (inverse * node.change + setup_.gravity);
      const Vec v = constrained(free, index, time_ + dt);
      const Vec momentum = (0.5 * m) * (old + v);
      sum.gain += momentum.dot(v - old);
      sum.wall += momentum.dot(free - v);
      node.motion = v;
      node.change = v - mapped;
      hand_out(node);
    });
    work_[static_cast<std::size_t>(i)] = sum;
  });
  for (const Work& c : work_) {
    ledger_.transfer += c.gain;  // the points book the other halves of both mappings
    ledger_.wall += c.wall;
    ledger_.time_integration -=
        c.gain + c.wall;  // work of force and gravity, until law and potential energy book theirs
  }
  return {std::move(grid.cells)};
}

/// Momenta to velocities, without forces: for gradients taken from the points' own momenta.
template <int D, class S, class E>
auto Solver<D, S, E>::constrain(LoadedGrid grid) -> MovingGrid {
  for_each_node([&](Node<dim>& node, const auto& index) {
    if (node.mass > 0.0) node.motion = constrained(Vec(node.motion / node.mass), index, time_);
    hand_out(node);
  });
  return {std::move(grid.cells)};
}

template <int D, class S, class E>
void Solver<D, S, E>::sharpen_velocity(MovingGrid& /*grid*/) {
  Xpic::sharpen<Vec>(*this, setup_.numerics.xpic_order,
                     [&](const Vec& v, const auto& index) { return constrained(v, index, time_); });
}

/// From the nodes to the points: new velocity, affine part and displacement, or grad v, or both in
/// one pass over the nodes.
template <int D, class S, class E>
void Solver<D, S, E>::sweep_nodes(GivingCells& rates, Gathered what, double dt) {
  const Timed timed(times_ ? &times_->to_points : nullptr);
  const Filter filter{relaxed(dt, setup_.numerics.relaxation_time),
                      relaxed(dt, setup_.numerics.gradient_relaxation_time)};
  const bool carries = affine_of(setup_.numerics.transfer) != Affine::none;
  sums_.assign(strips_.size(), {});
  for_each_strip([&](std::size_t s) {
    sums_[s] = carries ? gather_strip<true>(strips_[s], rates, what, filter, dt)
                       : gather_strip<false>(strips_[s], rates, what, filter, dt);
  });
  if (what == Gathered::gradient) return;
  double before = 0.0, after = 0.0;
  max_speed_ = 0.0;
  for (const Sums& s : sums_) {
    before += s.kinetic_before, after += s.kinetic_after;
    max_speed_ = std::max(max_speed_, s.speed);
  }
  ledger_.transfer += before - after;
  ledger_.kinetic = after;
  drift_ += max_speed_ * dt;
}

template <int D, class S, class E>
auto Solver<D, S, E>::gathered(MovingGrid grid, Gathered what, double dt) -> StrainedPoints {
  sweep_nodes(grid.cells.rates, what, dt);
  if (setup_.numerics.averaging == VolumetricAveraging::nodal)
    average_over_nodes(material_.volumetric_rate);
  return {GivenCells(std::move(grid.cells.rates)), std::move(grid.cells.pressures)};
}

template <int D, class S, class E>
void Solver<D, S, E>::take_velocity(const Block& block, const VecOf<Wide>& of_grid,
                                    const VecOf<Wide>& increment, double filter, WideSums& sums) {
  const auto old = points_.v.load(block);
  const VecOf<Wide> v = transferred(setup_.numerics.transfer, old, of_grid, increment, filter);
  points_.v.store(v, block);
  const Wide half_mass = 0.5 * block.load(points_.mass);
  sums.kinetic_before += half_mass * old.squaredNorm();
  sums.kinetic_after += half_mass * v.squaredNorm();
  for (int d = 0; d < dim; ++d) sums.speed = larger(sums.speed, abs(of_grid[d]));
}

/// What the scheme carries of the motion around a point.
template <int D, class S, class E>
void Solver<D, S, E>::take_affine(const Blocks<E>& blocks, const Neighbours<dim, S::support, E>& at,
                                  const CollectedOf<E>& nodes, double filter, double dt) {
  with_transfer(setup_.numerics.transfer, [&](auto scheme) {
    using Scheme = decltype(scheme);
    if constexpr (Scheme::affine != Affine::none) {
      const MatOf<E> own = points_.affine.template load_blocks<E>(blocks);
      points_.affine.template store_blocks<E>(Scheme::carried(own, nodes, at.n, filter, dt),
                                              blocks);
    }
  });
}

template <int D, class S, class E>
void Solver<D, S, E>::take_gradient(const Block& block, const VecOf<Wide>& of_grid,
                                    const MatOf<Wide>& gradient, GivingCells& rates) {
  Wide divergence = 0.0;
  for (int d = 0; d < dim; ++d) divergence += gradient[d][d];
  if (dim == 2 && setup_.axisymmetric) {
    const Wide hoop = of_grid[0] / points_.x.load(block)[0];
    block.store(hoop, material_.hoop);
    divergence += hoop;
  }
  material_.give_rate(block, divergence, rates);
}

template <int D, class S, class E>
template <bool Carries>
[[gnu::flatten]] auto Solver<D, S, E>::gather_strip(const Strip& strip, GivingCells& rates,
                                                    Gathered what, const Filter& filter, double dt)
    -> Sums {
  WideSums sums;
  for_each_blocks<E>(strip.begin, strip.end, [&](const Blocks<E>& blocks) {
    const auto at = neighbours(blocks);
    const CollectedOf<E> all = collected<Carries>(at);
    const auto v = split<VecOf, E>(all.v);
    if (what != Gathered::gradient) {
      const auto dv = split<VecOf, E>(all.dv);
#pragma GCC unroll 2
      for (std::size_t h = 0; h < halves; ++h)
        take_velocity(blocks[h], v[h], dv[h], filter.velocity, sums);
      if constexpr (Carries) take_affine(blocks, at, all, filter.gradient, dt);
      material_.grid_velocity.template store_blocks<E>(all.v, blocks);
    }
    if (what != Gathered::velocity) {
      const auto gradient = split<MatOf, E>(all.slope);
      material_.velocity_gradient.template store_blocks<E>(all.slope, blocks);
#pragma GCC unroll 2
      for (std::size_t h = 0; h < halves; ++h) take_gradient(blocks[h], v[h], gradient[h], rates);
    }
  });
  return {.kinetic_before = reduce(sums.kinetic_before),
          .kinetic_after = reduce(sums.kinetic_after),
          .speed = hmax(sums.speed)};
}

}  // namespace grainpair
