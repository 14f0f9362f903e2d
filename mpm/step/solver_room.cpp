// The room that points share, and how far they claim more.
#include <algorithm>
#include <numbers>

#include "mpm/step/solver.hpp"

namespace grainpair {

template <int D>
double Solver<D>::depth(double x) const {
  return setup_.axisymmetric ? 2.0 * std::numbers::pi * x : setup_.thickness;
}

/// That is put right at a time; a front that strikes the ground has more for a moment.
constexpr double most_crowding = 0.25;

/// How far points claim more volume than there is room for, or less. Few points sample a flow
/// coarsely: one that brings them closer than it tells them goes unseen, gravity does work by it,
/// and a layer sheared for long sinks into itself. Volume and room are counted by node,
///   crowding_p = sum_i w_ip (sum_q <w_i>_q V_q / room_i - 1),  room_i = integral of w_i,
/// where all cells that share the node hold points; elsewhere, room may lie beside a free surface.
/// <w>_q: mean over the size a point began with, by Gauss's two points an axis, so that a lattice
/// is counted exactly beside walls, too, where functions are others.
template <int D>
void Solver<D>::find_crowding() {
  const double aside =
      kernel_->functions_of_whole_points ? 0.0 : 0.5 / std::numbers::sqrt3 * setup_.point_size;
  const unsigned parts = aside > 0.0 ? 1u << dim : 1u;
  const auto for_each_part = [&](std::size_t p, auto&& f) {  // f(node, volume that it counts)
    const Vec x = points_.x[p];
    for (unsigned corner = 0; corner < parts; ++corner) {
      Vec at = x;
      for (int d = 0; d < dim; ++d)
        at[d] += (corner >> d & 1u ? 1.0 : -1.0) *
                 std::min({aside, x[d], material_.box.length[d] - x[d]});
      const double part = (setup_.axisymmetric ? at[0] / x[0] : 1.0) / parts;
      for_each_weight_at(
          at, [&](Node<dim>& node, double w) { f(node, w * part * material_.volume(p)); });
    }
  };
  const ActiveBox<dim> grid = whole_grid();
  const auto middle_of = [&](std::size_t cell) {
    Vec middle;
    for (std::size_t d = dim; d-- > 0; cell /= static_cast<std::size_t>(setup_.cells[d]))
      middle[d] = grid_.axes[d].h *
                  (static_cast<double>(cell % static_cast<std::size_t>(setup_.cells[d])) + 0.5);
    return middle;
  };
  for_each_node([](Node<dim>& node, const auto&) { node.change.setZero(); });
  for_each_strip([&](std::size_t s) {
    std::vector<std::size_t> cells;
    for_each_point_of(strips_[s], [&](std::size_t p) {
      for_each_part(p, [](Node<dim>& node, double volume) { node.change[0] += volume; });
      cells.push_back(static_cast<std::size_t>(grid.cell(points_.x[p])));
    });
    std::ranges::sort(cells);
    cells.erase(std::ranges::unique(cells).begin(), cells.end());
    for (const std::size_t cell : cells)
      for_each_weight_at(middle_of(cell), [](Node<dim>& node, double) { node.change[1] += 1.0; });
  });
  fold(Folded::changes);
  for_each_node([&](Node<dim>& node, const std::array<int, dim>& index) {
    double room = setup_.thickness, cells = 1.0;
    for (std::size_t d = 0; d < dim; ++d) {
      const NodeRoom& along = rooms_[d][static_cast<std::size_t>(index[d])];
      room *= along.length, cells *= along.cells;
    }
    const double crowding = std::clamp(node.change[0] / room - 1.0, -most_crowding, most_crowding);
    node.change[0] = room > 0.0 && node.change[1] == cells ? crowding : 0.0;
  });
  for_each_place([&](std::size_t p) {  // fillers, too: they stay what they repeat
    double sum = 0.0;
    for_each_weight(p, [&](const Node<dim>& node, double w) { sum += w * node.change[0]; });
    points_.crowding[p] = sum;
  });
}

template class Solver<2>;
template class Solver<3>;

}  // namespace grainpair
