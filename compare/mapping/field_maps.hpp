// Fields made of stencils, whatever the dimension of the grid.
#pragma once

#include <limits>
#include <vector>

#include "compare/mapping/coarse_grain.hpp"
#include "compare/mapping/stencil.hpp"

namespace grainpair {

using RowMat3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// The fields under construction; `data(name)` stays valid while more are added.
class Builder {
 public:
  explicit Builder(std::size_t cells) : cells_(cells) { fields_.list.reserve(64); }

  /// A field of the catalogue (field_maps.cpp), zero so far.
  double* add(const std::string& name);
  template <class PerCell>
  void for_cells(PerCell per_cell) const {
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t k = 0; k < cells_; ++k) per_cell(k);
  }
  Fields take() { return std::move(fields_); }

 private:
  std::size_t cells_;
  Fields fields_;
};

inline void put(double* field, std::size_t k, const Vec3& a) {
  Eigen::Map<Vec3>(field + 3 * k) = a;
}
inline void put(double* field, std::size_t k, const Mat3& a) {
  Eigen::Map<RowMat3>(field + 9 * k) = a;
}
inline Mat3 tensor(const double* field, std::size_t k) {
  return Eigen::Map<const RowMat3>(field + 9 * k);
}

/// What follows from the fields of mass, motion and stress.
class DerivedMaps {
 public:
  DerivedMaps(const Grain& grain, std::size_t cells) : grain_(grain), out_(cells) {}

 protected:
  static constexpr double nan = std::numeric_limits<double>::quiet_NaN();

  void map_derived();

  Grain grain_;
  Builder out_;
  double *density_ = nullptr, *gradient_ = nullptr, *kinetic_ = nullptr, *stress_ = nullptr;
  bool add_kinetic_ = false;
};

class FieldMaps : protected DerivedMaps {
 public:
  FieldMaps(const Cloud& cloud, const Grain& grain, std::size_t cells)
      : DerivedMaps(grain, cells), cloud_(cloud) {}

 protected:
  void map_two_step(const Stencils& points, const std::vector<double>& fluctuation);
  void map_state(const Stencils& points);

  const Cloud& cloud_;
};

/// What depends on the kernel: weights of the points, and sums over contacts, in a part of a grid.
struct KernelSums {
  Stencils points;
  std::vector<Eigen::Matrix<double, 19, 1>> along;  // branches: f (x) b, n (x) n, 1
  std::vector<Eigen::Vector4d> at;                  // contact points: force of walls, power
};

template <int D>
KernelSums kernel_sums(const Cloud& cloud, const SampleGrid<D>& grid, const Kernel<D>& kernel);

}  // namespace grainpair
