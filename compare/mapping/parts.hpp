// A grid in parts, so that a large one needs no more memory than a small one: the table of weights
// and the fields of a part at a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "compare/mapping/coarse_grain.hpp"

namespace grainpair {

constexpr double room = 6e8;         // bytes that weights and fields of a part may take
constexpr double bytes_weight = 40;  // while the table is sorted
constexpr double bytes_cell = 1400;  // 70 numbers of the fields, four shares of 23 sums of contacts

constexpr std::size_t large = 100000;  // points whose order decides how fast they are mapped

/// Brings a large cloud into the order of tiles of the grid's cells, which keeps neighbours
/// together in memory. A small one keeps its order, and with it the last digit of its sums.
template <int D>
void sort_by_cell(Cloud& c, const SampleGrid<D>& grid) {
  if (c.size() < large) return;
  constexpr std::uint64_t side = 8, tile_cells = D == 1   ? side
                                                 : D == 2 ? side * side
                                                          : side * side * side;
  const auto sorted = [&](std::size_t n, auto position) {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order(n);
    for (std::size_t p = 0; p < n; ++p) {
      const auto r = grid.project(position(p));
      std::uint64_t tile = 0, cell = 0;
      for (int a = D - 1; a >= 0; --a) {
        const auto cells = static_cast<std::uint64_t>(grid.cells[static_cast<std::size_t>(a)]);
        const double place = std::floor((r[a] - grid.lower[a]) / grid.spacing[a]);
        const auto k =
            static_cast<std::uint64_t>(std::clamp(place, 0.0, static_cast<double>(cells) - 1.0));
        tile = tile * (cells / side + 1) + k / side, cell = cell * side + k % side;
      }
      order[p] = {tile * tile_cells + cell, static_cast<std::uint32_t>(p)};
    }
    std::sort(order.begin(), order.end());
    return order;
  };
  const auto points = sorted(c.size(), [&](std::size_t p) { return c.x[p]; });
  const auto contacts =
      sorted(c.contacts.size(), [&](std::size_t i) { return c.contacts[i].start; });
  const auto bring = [](auto& values, const auto& order) {
    if (values.empty()) return;
    std::remove_reference_t<decltype(values)> out;
    out.reserve(values.size());
    for (const auto& [key, p] : order) out.push_back(values[p]);
    values = std::move(out);
  };
  bring(c.x, points), bring(c.v, points), bring(c.mass, points), bring(c.solid_volume, points);
  bring(c.spin, points), bring(c.inertia, points), bring(c.contact_number, points);
  bring(c.void_ratio, points), bring(c.granular_temperature, points), bring(c.stress, points);
  bring(c.volume, points);
  bring(c.contacts, contacts);
}

/// Layers of equal thickness along the longest axis; one part where all fits. Decided by the cloud
/// and the grid alone, not by the number of threads.
template <int D>
std::vector<SampleGrid<D>> parts(const SampleGrid<D>& grid, const Cloud& cloud, double cutoff) {
  double cells = 1.0, pairs = D == 1 ? 1.0 : D == 2 ? std::numbers::pi / 4 : std::numbers::pi / 6;
  int axis = 0;
  for (int a = 0; a < D; ++a) {
    const auto i = static_cast<std::size_t>(a);
    cells *= grid.cells[i];
    pairs *= std::max(1.0, 2.0 * cutoff / grid.spacing[a]);
    if (grid.cells[i] > grid.cells[static_cast<std::size_t>(axis)]) axis = a;
  }
  const int layers = grid.cells[static_cast<std::size_t>(axis)];
  std::vector<double> cost(static_cast<std::size_t>(layers), cells / layers * bytes_cell);
  for (const auto& x : cloud.x) {
    const double k = std::floor((grid.project(x)[axis] - grid.lower[axis]) / grid.spacing[axis]);
    cost[static_cast<std::size_t>(std::clamp(k, 0.0, layers - 1.0))] += pairs * bytes_weight;
  }
  const auto most = [&](int thickness) {
    double worst = 0.0;
    for (int k = 0; k < layers; k += thickness) {
      double sum = 0.0;
      for (int l = k; l < std::min(layers, k + thickness); ++l)
        sum += cost[static_cast<std::size_t>(l)];
      worst = std::max(worst, sum);
    }
    return worst;
  };
  if (most(layers) <= room) return {grid};
  int thickness = layers;
  while (thickness > 1 && most(thickness) > room) thickness = thickness * 3 / 4;
  std::vector<SampleGrid<D>> out;
  for (int k = 0; k < layers; k += thickness) {
    out.push_back(grid);
    out.back().part = {axis, k, std::min(thickness, layers - k)};
  }
  return out;
}

}  // namespace grainpair
