// Points that go to their law by way of a batch: strained, updated together, booked.
#pragma once

#include <algorithm>

#include "mpm/points/body.hpp"

namespace grainpair {

constexpr std::size_t window = 64;  // points of a batch: few enough for the cache

/// `Zeros`: what the law leaves at zero, of energies and of stability; `update(first, batch)`.
template <class Zeros, Accounts accounts, bool Axisymmetric, int Dim>
void advance_by_batch(MaterialPoints<Dim>& points, const CellsOfStep& cells, const Strip& strip,
                      PointSums& sums, const auto& update) {
  using Where = typename MaterialPoints<Dim>::Where;
  thread_local Batch batch(window, false);
  thread_local std::vector<double> mixing(window), detached(window);
  batch.in_plane = Dim == 2;
  for (std::size_t first = strip.begin; first < strip.end; first += window) {
    const std::size_t end = std::min(first + window, strip.end);
    batch.size = end - first;
    for_each_block(first, end, [&](const Block& block) {
      const Strained strained = points.template strain<Axisymmetric>(block, cells.rates, sums);
      const Block row = block.from(first);
      batch.steps.store(strained.step, row, Where::step);
      row.store(strained.step.mixing, mixing), row.store(strained.detached, detached);
    });
    std::copy_n(&points.points.regime[first], batch.size, batch.regime.begin());
    update(first, batch);
    std::copy_n(batch.regime.begin(), batch.size, &points.points.regime[first]);
    for_each_block(first, end, [&](const Block& block) {
      const Block row = block.from(first);
      points.template book<accounts>(
          block, row.load(mixing), row.load(detached),
          {batch.sigma.load(row, Where::tensor), batch.energies.load(row, Zeros::energies),
           batch.stability.load(row, Zeros::stability), row.load(batch.granular_temperature),
           row.load(batch.collisional_pressure)},
          cells.pressures, sums);
    });
  }
}

}  // namespace grainpair
