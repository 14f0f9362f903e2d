// The background grid: nodal mass, momentum and force. Knows its spacing, nothing about materials.
#pragma once

#include <array>
#include <vector>

#include "mpm/shape.hpp"

namespace grainpair {

/// Four doubles that move as one: a compiler vector, because expression templates cost more to compile here than they
/// save to write.
using Lanes [[gnu::vector_size(32)]] = double;

/// One cache line. Between particles_to_grid and accelerate: mass and momentum, force. After it: mass and
/// velocity, velocity increment. Lane 0 is the mass, so that one vector operation moves mass and momentum.
struct alignas(64) Node {
  Lanes motion;  // {m, m v} [kg, kg m/s], then {m, v} [kg, m/s]
  Lanes change;  // {unused, f} [N], then {unused, v_new - v_old} [m/s]
};

template <int Dim, class Shape>
struct Grid {
  using Axis = typename Shape::Axis;
  std::array<Axis, Dim> axes;
  std::vector<Node> nodes;  // last axis fastest
  std::array<int, Dim> stride;

  Grid(const std::array<int, Dim>& cells, double h, double point_size)
      : axes(make_axes(cells, h, point_size, std::make_index_sequence<Dim>{})) {
    int count = 1;
    for (int d = Dim - 1; d >= 0; --d) {
      stride[d] = count;
      count *= axes[d].nodes;
    }
    nodes.resize(static_cast<std::size_t>(count), Node{});
  }

 private:
  template <std::size_t... D>
  static std::array<Axis, Dim> make_axes(const std::array<int, Dim>& cells, double h, double size,
                                         std::index_sequence<D...>) {
    return {Axis(cells[D], h, size)...};
  }
};

}  // namespace grainpair
