// What the tests of the mapping share: grids, clouds of known content, sums over a grid.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "compare/mapping/coarse_grain.hpp"

namespace grainpair {

inline constexpr double d = 0.002;  // grain diameter [m]
inline constexpr double w = 0.75 * d;
inline constexpr Grain grain{d, 2500.0};
inline const char* const kernels[] = {"gauss", "lucy", "heaviside", "linear"};

template <int D>
SampleGrid<D> box(const Vec3& lower, const Vec3& upper, double h, Edge edge, double depth = 1.0) {
  SampleGrid<D> g;
  for (int a = 0; a < D; ++a) {
    const int i = g.direction(a);
    g.cells[a] = std::max(1, static_cast<int>(std::lround((upper[i] - lower[i]) / h)));
    g.lower[a] = lower[i], g.spacing[a] = (upper[i] - lower[i]) / g.cells[a];
    g.low_edge[a] = g.high_edge[a] = edge;
  }
  g.depth = depth;
  return g;
}

template <int D>
Fields map(const Cloud& cloud, const SampleGrid<D>& grid, const std::string& kernel = "gauss",
           double width = w) {
  return coarse_grain<D>(cloud, grid, make_kernel<D>(kernel, width), grain);
}

template <int D>
double integral(const SampleGrid<D>& grid, const Field& field, int component = 0) {
  double sum = 0.0;
  for (std::size_t k = 0; k < grid.size(); ++k)
    sum += field.values[k * static_cast<std::size_t>(field.components) +
                        static_cast<std::size_t>(component)];
  return sum * grid.cell_volume();
}

/// Uniform random points in a box with random velocities about `mean` of variance T per component.
inline Cloud gas(std::size_t n, const Vec3& lower, const Vec3& upper, double T, const Vec3& mean,
                 unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal(0.0, std::sqrt(T));
  Cloud c;
  for (std::size_t p = 0; p < n; ++p) {
    c.x.push_back(
        lower +
        Vec3(uniform(random), uniform(random), uniform(random)).cwiseProduct(upper - lower));
    c.v.push_back(mean + Vec3(normal(random), normal(random), normal(random)));
    c.mass.push_back(1e-5);
    c.solid_volume.push_back(4e-9);
  }
  return c;
}

/// Mean over the cells whose centres keep `margin` from the edges of the grid in every axis.
template <int D>
double interior_mean(const SampleGrid<D>& grid, const Field& field, double margin) {
  double sum = 0.0, n = 0.0;
  for (std::size_t k = 0; k < grid.size(); ++k) {
    bool inside = true;
    std::size_t rest = k;
    for (int a = 0; a < D; ++a) {
      const double x = (static_cast<double>(rest % static_cast<std::size_t>(grid.cells[a])) + 0.5) *
                       grid.spacing[a];
      rest /= static_cast<std::size_t>(grid.cells[a]);
      inside = inside && x > margin && x < grid.cells[a] * grid.spacing[a] - margin;
    }
    if (inside) sum += field.values[k], n += 1.0;
  }
  return sum / n;
}

// Sums over at most 1e5 terms of one sign: n eps in the worst case, far less in practice.
inline constexpr double round_off = 1e-12;

}  // namespace grainpair
