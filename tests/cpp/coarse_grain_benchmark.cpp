// Cost of mapping one frame: coarse_grain_benchmark. A block of grains ten diameters deep, three
// contacts per grain, onto a grid of 1 mm (d/2) with the Gaussian of w = 0.75 d, on one thread.
// `pairs/s` counts weights: grain-cell, branch-cell and contact point-cell; `contacts/s` counts
// contacts.
#include <benchmark/benchmark.h>
#include <omp.h>

#include <random>

#include "compare/mapping/coarse_grain.hpp"
#include "compare/mapping/items.hpp"

namespace grainpair {
namespace {

constexpr double d = 0.002, depth = 10 * d;

Cloud block(std::size_t grains, double side) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  Cloud c;
  for (std::size_t p = 0; p < grains; ++p) {
    c.x.push_back({side * uniform(random), side * uniform(random), depth * uniform(random)});
    c.v.push_back({normal(random), normal(random), normal(random)});
    c.spin.push_back({normal(random), normal(random), normal(random)});
    c.mass.push_back(1e-5), c.solid_volume.push_back(4e-9), c.inertia.push_back(4e-12),
        c.contact_number.push_back(6.0);
    for (int i = 0; i < 3; ++i) {
      const Vec3 n = Vec3(normal(random), normal(random), normal(random)).normalized();
      c.contacts.push_back({c.x[p], d * n, c.x[p] - 0.5 * d * n, 0.1 * n, 1e-3, false});
    }
  }
  c.has_contacts = c.has_dissipation = true;
  return c;
}

void map_frame(benchmark::State& state) {
  const auto grains = static_cast<std::size_t>(state.range(0));
  const double side = std::sqrt(static_cast<double>(grains) * d * d * d / (1.05 * depth));
  const Cloud cloud = block(grains, side);
  SampleGrid<2> grid;
  grid.spacing = {0.001, 0.001}, grid.lower = {0.0, 0.0}, grid.depth = depth;
  grid.cells = {static_cast<int>(side / 0.001) + 6, static_cast<int>(side / 0.001) + 6};
  grid.low_edge = {Edge::mirror, Edge::mirror}, grid.high_edge = {Edge::open, Edge::open};
  const Gauss<2> gauss(0.75 * d);
  const Kernel<2> kernel = gauss;
  omp_set_num_threads(1);
  for (auto _ : state) benchmark::DoNotOptimize(coarse_grain<2>(cloud, grid, kernel, {d, 2500.0}));

  const auto of_grains =
      make_stencils(grid, grains,
                    place_points(grid, gauss, [&](std::size_t p) { return cloud.x[p]; }))
          .pairs();
  const auto of_branches = make_stencils(grid, cloud.contacts.size(),
                                         place_branches(grid, gauss, std::span(cloud.contacts)))
                               .pairs();
  const auto of_points =
      make_stencils(
          grid, cloud.contacts.size(),
          place_points(grid, gauss, [&](std::size_t i) { return cloud.contacts[i].point; }))
          .pairs();
  const auto pairs = of_grains + of_branches + of_points;
  const auto rate = [&](std::size_t n) {
    return benchmark::Counter(static_cast<double>(n),
                              benchmark::Counter::kIsIterationInvariantRate);
  };
  state.counters["pairs/s"] = rate(pairs);
  state.counters["contacts/s"] = rate(cloud.contacts.size());
  state.counters["grains/s"] = rate(grains);
  state.SetComplexityN(state.range(0));
}
BENCHMARK(map_frame)
    ->Arg(7000)
    ->Arg(14000)
    ->Arg(28000)
    ->Arg(56000)
    ->Unit(benchmark::kMillisecond)
    ->Complexity();

}  // namespace
}  // namespace grainpair

BENCHMARK_MAIN();
