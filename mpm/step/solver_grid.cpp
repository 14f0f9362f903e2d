// Between points and grid: the way there, the balance of momentum on the nodes, and the way back.
#include <cstring>
#include <span>

#include "mpm/step/solver.hpp"
#include "mpm/step/timed.hpp"
#include "mpm/transfer/transfer.hpp"

namespace grainpair {

/// Nodes without momentum, cells without sums.
template <int D>
auto Solver<D>::clear_grid() -> ClearedGrid {
  const Timed timed(times_ ? &times_->to_grid : nullptr);
  const auto& box = material_.box;
  for_each_slice([&](int i) {
    const std::size_t first = static_cast<std::size_t>(i - box.begin[0]) * box.cells_from(1);
    const auto rows = static_cast<std::size_t>(tops_[static_cast<std::size_t>(i)] - box.begin[1]);
    // of a slice that neighbours are handed, all
    const std::size_t count = ranks().many() ? box.cells_from(1) : rows * box.cells_from(2);
    spent_rates_.clear(first, count);
    spent_pressures_.clear(first, count);
    clear_nodes(i);
  });
  return {{GivingCells(std::move(spent_rates_)), GivingCells(std::move(spent_pressures_))}};
}

/// The same in the middle of a step; cells have been given nothing yet.
template <int D>
auto Solver<D>::clear_grid(MovingGrid old) -> ClearedGrid {
  for_each_slice([&](int i) { clear_nodes(i); });
  return {std::move(old.cells)};
}

template <int D>
void Solver<D>::clear_nodes(int slice) {
  for_each_row_of_slice(slice, [](std::span<Node<dim>> row, const auto&) {
    std::memset(static_cast<void*>(row.data()), 0, row.size_bytes());
  });
}

template <int D>
auto Solver<D>::scatter(ClearedGrid grid, Forces forces) -> LoadedGrid {
  const Timed timed(times_ ? &times_->to_grid : nullptr);
  for_each_strip(
      [&](std::size_t s) { kernel_->scatter(strips_[s], forces, pressures_, exchange_); });
  fold(Folded::both);
  return {std::move(grid.cells)};
}

/// What gate and walls make of a nodal velocity.
template <int D>
auto Solver<D>::constrained(Vec v, const std::array<int, dim>& node, double time) const -> Vec {
  const auto along = [&](int d) {
    return grid_.axes[static_cast<std::size_t>(d)].node_position[static_cast<std::size_t>(node[d])];
  };
  if (setup_.gate.present && v[0] > 0.0 && setup_.gate.closes(along(0), along(1), time)) v[0] = 0.0;
  if (setup_.shelf.holds(along(0), along(1))) v = setup_.shelf.wall.apply(v, 1, 1.0);
  for (int d = dim - 1; d >= 0; --d) {
    if (node[d] > 0 && node[d] < grid_.axes[d].nodes - 1) continue;
    if (node[d] == 0) v = setup_.walls[d][0].apply(v, d, 1.0);
    if (node[d] == grid_.axes[d].nodes - 1) v = setup_.walls[d][1].apply(v, d, -1.0);
  }
  return v;
}

/// Of `count` nodes along the last axis those that gate and walls do not reach: where they begin,
/// and end.
template <int D>
auto Solver<D>::unbound(const std::array<int, dim>& first, std::size_t count) const
    -> std::pair<std::size_t, std::size_t> {
  bool free = !setup_.gate.present && !setup_.shelf.present;
  for (int d = 0; d < dim - 1; ++d)
    free = free && first[d] > 0 && first[d] < grid_.axes[d].nodes - 1;
  if (!free) return {count, count};
  const int along = first[dim - 1], end = grid_.axes[dim - 1].nodes - 1;
  const auto within = [&](int k) {
    return static_cast<std::size_t>(std::clamp(k - along, 0, static_cast<int>(count)));
  };
  return {within(1), within(end)};
}

/// v_new = v + dt (f/m + g), then the walls. Work of each force is taken with the mean of old and
/// final velocity, so that it equals the change of nodal kinetic energy exactly. The walls act
/// twice: first on what the points' momenta ask for, which the walls had refused already at the end
/// of the last step: what that costs is the transfer's doing, not theirs. Fixed walls and rollers
/// then do no work, and the wall's account holds friction alone.
template <int D>
GRAINPAIR_FLATTEN auto Solver<D>::accelerate(LoadedGrid grid, double dt) -> MovingGrid {
  work_.assign(static_cast<std::size_t>(material_.box.end[0]), {});
  for_each_slice([&](int i) {
    Work sum;
    const auto push = [&](Node<dim>& node, const auto& constrain) {
      if (node.mass <= 0.0) return hand_out(node, Vec::Zero(), Vec::Zero());
      const double inverse = 1.0 / node.mass;
      const Vec mapped = inverse * node.motion;
      const Vec old = constrain(mapped, time_);
      const Vec free = old + dt * (inverse * node.change + setup_.gravity);
      const Vec v = constrain(free, time_ + dt);
      const Vec momentum = (0.5 * node.mass) * (old + v);
      sum.gain += momentum.dot(v - old);
      sum.wall += momentum.dot(free - v);
      hand_out(node, v, v - mapped);
    };
    for_each_row_of_slice(i, [&](std::span<Node<dim>> row, std::array<int, dim> first) {
      const auto bound = [&](std::size_t k) {
        auto index = first;
        index[dim - 1] += static_cast<int>(k);
        push(row[k], [&](const Vec& v, double time) { return constrained(v, index, time); });
      };
      const auto [begin, end] = unbound(first, row.size());
      for (std::size_t k = 0; k < begin; ++k) bound(k);
      for (std::size_t k = begin; k < end; ++k)
        push(row[k], [](const Vec& v, double) { return v; });
      for (std::size_t k = end; k < row.size(); ++k) bound(k);
    });
    work_[static_cast<std::size_t>(i)] = sum;
  });
  for (const Work& c : counted(work_)) {
    ledger_.transfer += c.gain;  // the points book the other halves of both mappings
    ledger_.wall += c.wall;
    ledger_.time_integration -=
        c.gain + c.wall;  // work of force and gravity, until law and potential energy book theirs
  }
  return {std::move(grid.cells)};
}

/// Momenta to velocities, without forces: for gradients taken from the points' own momenta.
template <int D>
auto Solver<D>::constrain(LoadedGrid grid) -> MovingGrid {
  for_each_node([&](Node<dim>& node, const auto& index) {
    const Vec v = node.mass > 0.0 ? constrained(Vec(node.motion / node.mass), index, time_)
                                  : Vec(node.motion);
    hand_out(node, v, Vec(node.change));
  });
  return {std::move(grid.cells)};
}

template <int D>
void Solver<D>::sharpen_velocity(MovingGrid& /*grid*/) {
  Xpic::sharpen<Vec>(*this, setup_.numerics.xpic_order,
                     [&](const Vec& v, const auto& index) { return constrained(v, index, time_); });
}

/// From the nodes to the points: new velocity, affine part and displacement, or grad v, or both in
/// one pass over the nodes.
template <int D>
void Solver<D>::sweep_nodes(GivingCells& rates, Gathered what, double dt) {
  const Timed timed(times_ ? &times_->to_points : nullptr);
  const Filter filter{relaxed(dt, setup_.numerics.velocity_relaxation),
                      relaxed(dt, setup_.numerics.gradient_relaxation),
                      setup_.numerics.most_own_speed};
  sums_.assign(strips_.size(), {});
  for_each_strip([&](std::size_t s) {
    sums_[s] = kernel_->gather(strips_[s], rates, what, filter, dt, exchange_);
  });
  if (what == Gathered::gradient) return;
  double before = 0.0, after = 0.0;
  max_speed_ = 0.0;
  for (const GatherSums& s : sums_) {
    before += s.kinetic_before, after += s.kinetic_after;
    max_speed_ = std::max(max_speed_, s.speed);
  }
  ledger_.transfer += before - after;
  ledger_.kinetic = after;
  drift_ += max_speed_ * dt;
}

template <int D>
auto Solver<D>::gathered(MovingGrid grid, Gathered what, double dt) -> StrainedPoints {
  sweep_nodes(grid.cells.rates, what, dt);
  fold(grid.cells.rates);
  return {GivenCells(std::move(grid.cells.rates)), std::move(grid.cells.pressures)};
}

template class Solver<2>;
template class Solver<3>;

}  // namespace grainpair
