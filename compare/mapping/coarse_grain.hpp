// Coarse graining: from a cloud to fields on a sample grid, one kernel and one width for grains and
// material points.
//
// Every field is a sum over points or contacts of a property times a weight. The weight of point p
// in grid cell k is
//   phi_kp = phi(r_k - r_p) / (h^D sum_l phi(r_l - r_p)),    l over the unbounded lattice of cell
//   centres,
// and that of a contact is the exact line integral psi of phi along its branch, normalised alike.
// So a cell sum times the cell volume is the sum over the cloud to round-off, whatever the grid's
// spacing (mass, momentum, f (x) b). What the kernel puts behind a wall is folded back by
// reflection, which keeps a uniform packing uniform up to the wall and loses nothing; across a
// periodic face it wraps around. A point that no cell centre is within reach of goes whole into its
// own cell.
//
// Directions that are not mapped are averaged over their depth: D = 2 maps x and y and averages
// over the thickness, D = 1 maps y. Compression positive. Formulas: Goldhirsch, Granular Matter
// 12:239 (2010); wall terms: Weinhart et al., Granular Matter 14:289 (2012).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "compare/mapping/cloud.hpp"
#include "compare/mapping/kernel.hpp"

namespace grainpair {

/// What happens to the part of a kernel that passes an end of the grid.
enum class Edge { open, mirror, periodic };

template <int D>
struct SampleGrid {
  using Point = Eigen::Matrix<double, D, 1>;

  Point lower, spacing;      // [m]
  std::array<int, D> cells;  // per axis
  std::array<Edge, D> low_edge, high_edge;
  double depth = 1.0;  // extent of what is averaged over [m^(3-D)]

  /// The spatial direction that grid axis `a` maps: y; x, y; x, y, z.
  static constexpr int direction(int a) { return D == 1 ? 1 : a; }
  static Point project(const Vec3& r) {
    Point q;
    for (int a = 0; a < D; ++a) q[a] = r[direction(a)];
    return q;
  }
  double centre(int a, int k) const { return lower[a] + (k + 0.5) * spacing[a]; }
  double cell_volume() const { return spacing.prod() * depth; }  // [m3]
  std::size_t size() const {
    std::size_t n = 1;
    for (const int k : cells) n *= static_cast<std::size_t>(k);
    return n;
  }
};

/// A field on the grid: `components` numbers per cell, the last grid axis slowest (z, y, x as an
/// array in C order).
struct Field {
  std::string name, unit, doc;
  int components;  // 1, 3, or 9 (row by row)
  std::vector<double> values;
};

struct Fields {
  std::vector<Field> list;
  const Field& operator[](const std::string& name) const;  // throws std::out_of_range
};

struct Grain {
  double diameter;  // d [m], for the inertial number
  double density;   // rho_s [kg/m3]
};

/// All fields the cloud has data for. Undefined values (the velocity of an empty cell) are NaN.
template <int D>
Fields coarse_grain(const Cloud& cloud, const SampleGrid<D>& grid, const Kernel<D>& kernel,
                    const Grain& grain);
template <>
Fields coarse_grain(const Cloud&, const SampleGrid<1>&, const Kernel<1>&, const Grain&);
template <>
Fields coarse_grain(const Cloud&, const SampleGrid<2>&, const Kernel<2>&, const Grain&);
template <>
Fields coarse_grain(const Cloud&, const SampleGrid<3>&, const Kernel<3>&, const Grain&);

}  // namespace grainpair
