// The background grid: its axes and its nodes. Knows its spacing, nothing about materials.
#pragma once

#include <array>
#include <vector>

#include "mpm/grid/interpolation.hpp"

namespace grainpair {

template <int Dim, class Shape>
struct Grid {
  using Axis = typename Shape::Axis;
  std::array<Axis, Dim> axes;
  std::vector<Node<Dim>> nodes;  // last axis fastest
  std::array<int, Dim> stride;

  Grid(const std::array<int, Dim>& cells, double h, double point_size)
      : axes(make_axes(cells, h, point_size, std::make_index_sequence<Dim>{})) {
    int count = 1;
    for (int d = Dim - 1; d >= 0; --d) {
      stride[d] = count;
      count *= axes[d].nodes;
    }
    nodes.resize(static_cast<std::size_t>(count));
  }

 private:
  template <std::size_t... D>
  static std::array<Axis, Dim> make_axes(const std::array<int, Dim>& cells, double h, double size,
                                         std::index_sequence<D...>) {
    return {Axis(cells[D], h, size)...};
  }
};

}  // namespace grainpair
