#pragma once

#include <Eigen/LU>

#include "mpm/grid/interpolation.hpp"
#include "mpm/transfer/flip.hpp"

namespace grainpair {

/// FLIP for the velocity and for its gradient: a point adds the grid's increments to both, and
/// relaxes each to the grid's over a physical time of its own.
///
/// DEVIATION: [Fei2021] takes the gradient from the grid afresh in every step, as APIC does.
/// Neighbouring points then lose in every step what their gradients differ by, however short the
/// step: in the column of [Ceccato2019], with the solid-fluid law on 5 mm cells, that was most of
/// the energy that transfers lost.
struct AffineFlip : Flip {
  static constexpr Affine affine = Affine::gradient;

  /// C_new = (C + dC)(I + dt L)^-1, C first relaxed to the grid's grad v. The inverse carries the
  /// gradient along with the motion, from places before the step to places after it: a rigid
  /// rotation keeps its C exactly, and what is stretched loses slope. L is the grid's grad v
  /// without volumetric contraction: that would let a stress-free point gain energy without bound,
  /// because on a grid its inertia m D_p does not shrink with its volume. What is taken off each
  /// axis is half the trace, so that a plane keeps its area; in three dimensions, too, where a slab
  /// between rollers must answer as the slice it stands for.
  template <class Mat>
  static Mat gradient(const Mat& own, const Mat& increment, const Mat& grid_gradient, double filter,
                      double dt) {
    using Real = typename Mat::Scalar;
    const Real way = constant<Real>(filter), step = constant<Real>(dt);
    const Mat flip = own + increment, relaxed = flip + way * (grid_gradient - flip);
    const Real contraction = smaller(Real(grid_gradient.trace()), Real(0)) / 2;
    return relaxed *
           (Real(1 - step * contraction) * Mat::Identity() + step * grid_gradient).inverse();
  }

  /// The same of several points, with the gradients of the nodes' velocity and of its increment
  /// from their first moments: grad v = D^-1 sum_i w_ip v_i (X_i - x_p)^T.
  template <int Dim, class Real, class Axes>
  static MatrixOf<Dim, Real> carried(MatrixOf<Dim, Real> own, const Collected<Dim, Real>& nodes,
                                     const Axes& n, double filter, double dt) {
    Eigen::Matrix<Real, Dim, Dim> C, increment, grid_gradient;
    for (int d = 0; d < Dim; ++d) {
      const Real inverse = n[d].inverse_inertia;
      for (int i = 0; i < Dim; ++i) {
        C(i, d) = own[d][i];
        increment(i, d) = inverse * nodes.moment_increment[d][i];
        grid_gradient(i, d) = inverse * nodes.moment[d][i];
      }
    }
    C = gradient(C, increment, grid_gradient, filter, dt);
    for (int d = 0; d < Dim; ++d)
      for (int i = 0; i < Dim; ++i) own[d][i] = C(i, d);
    return own;
  }
};

}  // namespace grainpair
