// The background grid: its axes and its nodes. Knows its spacing, nothing about materials.
#pragma once

#include <array>
#include <vector>

#include "mpm/grid/interpolation.hpp"

namespace grainpair {

template <int Dim>
struct Grid {
  std::array<GridAxis, Dim> axes;
  std::vector<Node<Dim>> nodes;  // last axis fastest
  std::array<int, Dim> stride;

  explicit Grid(const std::array<GridAxis, Dim>& along) : axes(along) {
    int count = 1;
    for (int d = Dim - 1; d >= 0; --d) {
      stride[d] = count;
      count *= axes[d].nodes;
    }
    nodes.resize(static_cast<std::size_t>(count));
  }
};

}  // namespace grainpair
