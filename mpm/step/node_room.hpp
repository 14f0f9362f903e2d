// What room nodes have: that of their functions.
#pragma once

#include <algorithm>
#include <numbers>
#include <vector>

#include "mpm/step/transfer_kernel.hpp"

namespace grainpair {

/// What a node has of an axis: the integral of its function, [m], along a radius that of 2 pi r
/// times it, [m2]; and how many cells share it.
struct NodeRoom {
  double length = 0.0;
  int cells = 0;
};

/// Of every node along an axis. Gauss's two points integrate cubics, and in a quarter of a cell all
/// functions are smooth.
template <int Dim>
std::vector<NodeRoom> rooms_along(int axis, bool ring, const TransferKernel<Dim>& kernel,
                                  const Grid<Dim>& grid) {
  const GridAxis& along = grid.axes[static_cast<std::size_t>(axis)];
  const auto stride = static_cast<std::size_t>(grid.stride[static_cast<std::size_t>(axis)]);
  std::vector<NodeRoom> out(static_cast<std::size_t>(along.nodes));
  Eigen::Matrix<double, Dim, 1> x;
  for (std::size_t d = 0; d < Dim; ++d) x[d] = 0.5 * grid.axes[d].cells * grid.axes[d].h;
  const auto for_each_near = [&](double place, auto&& f) {
    x[axis] = place;
    NodeWeights<Dim> near;
    kernel.weigh(x, grid, near);
    for (std::size_t i = 0; i < static_cast<std::size_t>(near.count); ++i)
      f(near.node[i] / stride % out.size(), near.w[i]);
  };
  const double part = along.h / 4.0, aside = 0.5 / std::numbers::sqrt3;
  for (int cell = 0; cell < along.cells; ++cell) {
    std::vector<std::size_t> near;
    for_each_near((cell + 0.5) * along.h, [&](std::size_t i, double) { near.push_back(i); });
    std::ranges::sort(near);
    near.erase(std::ranges::unique(near).begin(), near.end());
    for (const std::size_t i : near) ++out[i].cells;
    for (int quarter = 4 * cell; quarter < 4 * (cell + 1); ++quarter)
      for (const double gauss : {0.5 - aside, 0.5 + aside}) {
        const double place = (quarter + gauss) * part;
        const double weight = 0.5 * part * (ring ? 2.0 * std::numbers::pi * place : 1.0);
        for_each_near(place, [&](std::size_t i, double w) { out[i].length += weight * w; });
      }
  }
  return out;
}

}  // namespace grainpair
