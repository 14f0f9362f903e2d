// The two sweeps between points and nodes, strip by strip, for one dimension, set of shape
// functions and precision. Each kind is compiled in a unit of its own (transfer_kernel.cpp.in); the
// solver knows this interface alone.
#pragma once

#include <memory>
#include <vector>

#include "mpm/grid/cell_means.hpp"
#include "mpm/grid/grid.hpp"
#include "mpm/points/material_points.hpp"

namespace grainpair {

enum class Forces { without, with };
enum class Gathered { velocity, gradient, both };

/// Fraction of the way to the grid's velocity, and to its gradient, that a point goes in one step.
struct Filter {
  double velocity, gradient;
  double most_own_speed;  // [m/s]
};

/// Sums of a strip that gathers velocities [J], [m/s].
struct GatherSums {
  double kinetic_before = 0.0, kinetic_after = 0.0, speed = 0.0;
};

/// The nodes that share one point.
template <int Dim>
struct NodeWeights {
  static constexpr int most = Dim == 2 ? 16 : 64;
  int count = 0;
  std::array<std::size_t, most> node;                     // number
  std::array<double, most> w;                             // [-]
  std::array<Eigen::Matrix<double, Dim, 1>, most> slope;  // [1/m]
};

/// What a kernel sweeps over.
template <int Dim>
struct Exchange {
  MaterialPoints<Dim> material;
  Grid<Dim> grid;
  /// Of the nodes, where points take them in single precision [m/s].
  Window<FloatNode<Dim>> velocities;
  TransferScheme transfer;
};

template <int Dim>
class TransferKernel {
 public:
  int support = 0;      // nodes that share a point, along an axis
  int reach = 0;        // nodes that share any point of a cell, along an axis
  bool single = false;  // whether points and nodes exchange numbers in single precision
  bool functions_of_whole_points = false;  // as gimp's; else of the places of points

  virtual ~TransferKernel() = default;
  virtual std::array<GridAxis, Dim> axes() const = 0;
  /// Mass, momentum and force of the points of a strip to the nodes; `pressures` of their cells.
  virtual void scatter(const Strip& strip, Forces forces, const GivenCells& pressures,
                       Exchange<Dim>& on) const = 0;
  /// Velocity and affine part of the points, or their velocity gradient, or both, from the nodes.
  virtual GatherSums gather(const Strip& strip, GivingCells& rates, Gathered what,
                            const Filter& filter, double dt, Exchange<Dim>& on) const = 0;
  /// The weights of the point at x, for what is rare.
  virtual void weigh(const Eigen::Matrix<double, Dim, 1>& x, const Grid<Dim>& grid,
                     NodeWeights<Dim>& out) const = 0;
};

/// `point_size` of undeformed points [m].
template <int Dim, class Shape, class Exchanged>
std::unique_ptr<TransferKernel<Dim>> make_transfer_kernel(const std::array<int, Dim>& cells,
                                                          double h, double point_size);

}  // namespace grainpair

#include "mpm/kernels.hpp"  // made by the build: every combination as extern template
