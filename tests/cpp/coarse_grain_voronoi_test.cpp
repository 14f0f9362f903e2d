// The mapped void ratio against an independent method: radical Voronoi cells (voro++), V_p over
// cell volume.
#include <gtest/gtest.h>

#include <random>
#include <voro++/voro++.hh>

#include "compare/mapping/coarse_grain.hpp"

namespace grainpair {
namespace {

constexpr double d = 0.002;  // largest diameter [m]

/// Jittered face-centred lattice of spheres of 0.8 d to d, thinned at random: dense, disordered, of
/// varying void ratio, filling side x side x depth, periodic in x, y and z for the tessellation.
struct Packing {
  Cloud cloud;
  std::vector<double> radius;
  double side, depth;
};
Packing packing() {
  Packing out;
  const double a = 1.5 * d;  // cube of the lattice
  const int n = 20, layers = 6;
  out.side = n * a, out.depth = layers * a;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> jitter(-0.06 * d, 0.06 * d), size(0.4 * d, 0.5 * d),
      uniform;
  const Vec3 basis[] = {{0, 0, 0}, {0.5, 0.5, 0}, {0.5, 0, 0.5}, {0, 0.5, 0.5}};
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < layers; ++k)
        for (const Vec3& b : basis) {
          if (uniform(random) < 0.08) continue;
          const Vec3 r = a * (Vec3(i, j, k) + b + Vec3::Constant(0.25)) +
                         Vec3(jitter(random), jitter(random), jitter(random));
          const double radius = size(random),
                       volume = 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3);
          out.cloud.x.push_back(r), out.cloud.v.push_back(Vec3::Zero());
          out.cloud.mass.push_back(2500.0 * volume), out.cloud.solid_volume.push_back(volume);
          out.radius.push_back(radius);
        }
  return out;
}

std::vector<double> voronoi_volumes(const Packing& p) {
  voro::container_poly box(0.0, p.side, 0.0, p.side, 0.0, p.depth, 12, 12, 4, true, true, true, 8);
  for (std::size_t i = 0; i < p.cloud.size(); ++i)
    box.put(static_cast<int>(i), p.cloud.x[i].x(), p.cloud.x[i].y(), p.cloud.x[i].z(), p.radius[i]);
  std::vector<double> volume(p.cloud.size(), 0.0);
  voro::c_loop_all loop(box);
  voro::voronoicell cell;
  if (loop.start()) do
      if (box.compute_cell(cell, loop))
        volume[static_cast<std::size_t>(loop.pid())] = cell.volume();
    while (loop.inc());
  return volume;
}

TEST(CoarseGrain, VoidRatioAgreesWithRadicalVoronoi) {
  const Packing p = packing();
  const auto cells = voronoi_volumes(p);

  SampleGrid<2> grid;
  grid.cells = {30, 30};
  grid.lower = {0.0, 0.0};
  grid.spacing = {p.side / 30, p.side / 30};
  grid.low_edge = grid.high_edge = {Edge::periodic, Edge::periodic};
  grid.depth = p.depth;
  const auto kernel = make_kernel<2>("gauss", 0.75 * d);
  const Fields mapped = coarse_grain<2>(p.cloud, grid, kernel, {d, 2500.0});

  // The Voronoi cells, averaged with the same kernel: void ratio = sum (V_cell - V_p) phi / sum V_p
  // phi. Mapping the cell volumes as if they were solid gives the numerator's first term.
  Cloud of_cells = p.cloud;
  of_cells.solid_volume = cells;
  const Fields tessellated = coarse_grain<2>(of_cells, grid, kernel, {d, 2500.0});

  double e_mapped = 0.0, e_voronoi = 0.0;
  for (std::size_t k = 0; k < grid.size(); ++k) {
    const double solid = mapped["solid_fraction"].values[k],
                 cell = tessellated["solid_fraction"].values[k];
    e_mapped += mapped["void_ratio"].values[k], e_voronoi += cell / solid - 1.0;
  }
  EXPECT_NEAR(e_mapped / e_voronoi, 1.0, 0.01);

  // And in a box of the interior, where neither method knows of the other's smoothing: 10 x 10 grid
  // cells.
  double solid = 0.0, own = 0.0, taken = 0.0;
  const double lower = 10 * grid.spacing[0], upper = 20 * grid.spacing[0];
  for (std::size_t i = 0; i < p.cloud.size(); ++i) {
    const Vec3& r = p.cloud.x[i];
    if (r.x() >= lower && r.x() < upper && r.y() >= lower && r.y() < upper)
      own += p.cloud.solid_volume[i], taken += cells[i];
  }
  for (std::size_t j = 10; j < 20; ++j)
    for (std::size_t i = 10; i < 20; ++i)
      solid += mapped["solid_fraction"].values[30 * j + i] / 100.0;
  EXPECT_NEAR(((1.0 - solid) / solid) / (taken / own - 1.0), 1.0, 0.01);
}

}  // namespace
}  // namespace grainpair
