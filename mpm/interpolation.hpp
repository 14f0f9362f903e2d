// Between points and their nodes: what nodes hold, what points give to them and collect of them. The sums over nodes are
// those of interpolation_plane.hpp and interpolation_space.hpp.
#pragma once

#include <array>

#include "mpm/shape.hpp"
#include "mpm/tensor.hpp"

namespace grainpair {

/// Motion and change are momentum [kg m/s] and force [N] on their way to the grid, velocity and its increment [m/s] on their
/// way back.
template <int Dim, class Real>
struct NodeOf;
template <class Real>
struct NodeOf<2, Real> {
  VectorOf<2, Real> motion, change;
  Real mass;  // [kg]
};
template <class Real>
struct NodeOf<3, Real> {
  VectorOf<3, Real> motion;
  Real mass;
  VectorOf<3, Real> change;
  Real idle;  // fills up the second four
};

/// One cache line.
template <int Dim>
struct alignas(64) Node : NodeOf<Dim, double> {};

/// Several points' momenta and forces, and how both change along each axis.
template <int Dim>
struct Given {
  using Vec = VectorOf<Dim, Wide>;
  using Mat = std::array<Vec, Dim>;
  Wide mass;
  Vec momentum, force;
  Mat momentum_slope, force_slope;

  explicit Given(const Wide& m) : mass(m), force(Vec::Zero()) {
    momentum_slope.fill(Vec::Zero());
    force_slope.fill(Vec::Zero());
  }
};

/// What comes back: velocity and its increment, the slope of the velocity along each axis, and the first moments of both.
template <int Dim>
struct Collected {
  using Vec = VectorOf<Dim, Wide>;
  using Mat = std::array<Vec, Dim>;
  Vec v, dv;
  Mat slope, moment, moment_increment;
};

/// Weights of several points along each axis, and the first of the nodes that share each.
template <int Dim, int Support>
struct Neighbours {
  std::array<Weights<Wide, Support>, Dim> n;
  std::array<Node<Dim>*, Wide::size()> first;
  std::array<int, Dim> stride;
};

}  // namespace grainpair
