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
// over the thickness, D = 1 maps one axis, y where nothing else is asked for. About an axis D = 2
// maps radius and height and averages over the angle (rings.hpp); vectors and tensors have the
// components r, y, angle. Compression positive.
// Formulas: Goldhirsch, Granular Matter 12:239 (2010); wall terms: Weinhart et al., Granular Matter
// 14:289 (2012).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "compare/mapping/cloud.hpp"
#include "compare/mapping/kernel.hpp"

namespace grainpair {

/// What happens to the part of a kernel that passes an end of the grid.
enum class Edge { open, mirror, periodic, axis };

template <int D>
struct SampleGrid {
  using Point = Eigen::Matrix<double, D, 1>;

  Point lower, spacing;      // [m]
  std::array<int, D> cells;  // per axis
  std::array<Edge, D> low_edge, high_edge;
  double depth = 1.0;  // extent of what is averaged over [m^(3-D)]
  int along = 1;       // the direction that a grid of one axis maps
  // Where the first axis is a radius (rings.hpp): the angle of the sector that cells are rings of
  // [rad], and the kernel's width [m]. Zero in a plane.
  double angle = 0.0, width = 0.0;

  /// The part whose fields are asked for: `part.count` layers of cells along one axis, all of the
  /// grid where that is zero. Whatever the parts, a point's weights are those in the whole grid.
  struct Part {
    int axis = 0, first = 0, count = 0;
  } part;

  /// The spatial direction that grid axis `a` maps: one of them; x, y; x, y, z.
  int direction(int a) const { return D == 1 ? along : a; }
  Point project(const Vec3& r) const {
    Point q;
    for (int a = 0; a < D; ++a) q[a] = r[direction(a)];
    return q;
  }
  double centre(int a, int k) const { return lower[a] + (k + 0.5) * spacing[a]; }
  bool of_rings() const { return angle > 0.0; }
  /// Of the cells that are the k-th along the first axis [m3].
  double cell_volume(int k = 0) const {
    return spacing.prod() * (of_rings() ? angle * centre(0, k) : depth);
  }

  /// Of the rings that cell k of the part belongs to [m].
  double radius(std::size_t k) const {
    return centre(0, first(0) + static_cast<int>(k % static_cast<std::size_t>(count(0))));
  }

  bool whole() const { return part.count == 0; }
  int first(int a) const { return whole() || a != part.axis ? 0 : part.first; }
  /// Cells of the part along `a`, and of all of it.
  int count(int a) const {
    return whole() || a != part.axis ? cells[static_cast<std::size_t>(a)] : part.count;
  }
  std::size_t size() const {
    std::size_t n = 1;
    for (int a = 0; a < D; ++a) n *= static_cast<std::size_t>(count(a));
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
  void drop(const std::vector<std::string>& names);
};

struct Grain {
  double diameter;  // d [m], for the inertial number; of several sizes, sum d^4 / sum d^3
  double density;   // rho_s [kg/m3]
};

/// |v_i - V(r_i)|^2 of every point, V smoothed at the point itself and the point's own share in it
/// corrected for [m2/s2]; NaN for a point on its own.
template <int D>
std::vector<double> fluctuations(const Cloud& cloud, const SampleGrid<D>& grid,
                                 const Kernel<D>& kernel);

/// All fields the cloud has data for, in the part of the grid. Undefined values (the velocity of an
/// empty cell) are NaN. `fluctuation`: of `fluctuations`.
template <int D>
Fields coarse_grain(const Cloud& cloud, const SampleGrid<D>& grid, const Kernel<D>& kernel,
                    const Grain& grain, const std::vector<double>& fluctuation);

template <int D>
Fields coarse_grain(const Cloud& cloud, const SampleGrid<D>& grid, const Kernel<D>& kernel,
                    const Grain& grain) {
  return coarse_grain(cloud, grid, kernel, grain, fluctuations(cloud, grid, kernel));
}

#define GRAINPAIR_MAPPING(D)                                                              \
  template <>                                                                             \
  std::vector<double> fluctuations(const Cloud&, const SampleGrid<D>&, const Kernel<D>&); \
  template <>                                                                             \
  Fields coarse_grain(const Cloud&, const SampleGrid<D>&, const Kernel<D>&, const Grain&, \
                      const std::vector<double>&);
GRAINPAIR_MAPPING(1)
GRAINPAIR_MAPPING(2)
GRAINPAIR_MAPPING(3)
#undef GRAINPAIR_MAPPING

}  // namespace grainpair
