// What every law needs of a step's kinematics: the strain increment and the rotation of a material
// tensor.
#pragma once

#include <cmath>

#include "mpm/points/material.hpp"

namespace grainpair {

/// ln((1+e_old)/(1+e)) = -ln(J_new/J_old): volumetric Hencky strain of the step, compression
/// positive [-].
template <class Real>
Real volumetric_strain(const Real& e_old, const Real& e) {
  const Real x = (e_old - e) / (2.0 + e_old + e);  // the logarithm is 2 atanh x
  const Real x2 = x * x;
  // series to x^9; the first term left out is below 2/11 x^10 = 2e-16 of the result
  const Real series =
      2.0 * x * (1.0 + x2 * (1.0 / 3 + x2 * (1.0 / 5 + x2 * (1.0 / 7 + x2 * (1.0 / 9)))));
  const auto large = x2 > 1e-3;
  if (!any(large)) return series;
  const auto logarithm = [](double ratio) { return std::log(ratio); };
  return select(large, each_lane(logarithm, (1.0 + e_old) / (1.0 + e)), series);
}

/// The step's strain: dev(D) dt, with the volume of det F.
template <class Real>
Tensor<Real> strain_increment(const DeformationOf<Real>& step) {
  const Tensor<Real> strain = step.dt * step.D;
  return plus_isotropic(
      strain,
      (volumetric_strain(step.void_ratio_old, step.void_ratio) - trace(strain)) * (1.0 / 3));
}

/// R a R^T, where R is the rotation by the angle |spin| dt about spin (Hughes-Winget).
template <class Real>
Tensor<Real> corotated(const std::type_identity_t<Tensor<Real>>& a,
                       const Eigen::Matrix<Real, 3, 1>& spin, const Real& dt) {
  const Eigen::Matrix<Real, 3, 1> angle = dt * spin;
  // about z, as in every plane motion: the series of sine and cosine are good to round-off at 0.1
  // rad
  const auto simple = angle[0] == 0.0 && angle[1] == 0.0 && abs(angle[2]) <= 0.1;
  const Real x = angle[2] * angle[2];
  const Real s =
      angle[2] * (1.0 + x * (-1.0 / 6 + x * (1.0 / 120 + x * (-1.0 / 5040 + x * (1.0 / 362880)))));
  const Real c = 1.0 + x * (-1.0 / 2 + x * (1.0 / 24 + x * (-1.0 / 720 + x * (1.0 / 40320))));
  const Real c2 = c * c - s * s, s2 = 2.0 * c * s;
  constexpr double root = std::numbers::sqrt2;
  const Real mean = 0.5 * (a[0] + a[1]), difference = 0.5 * (a[0] - a[1]);
  const Real d = difference * c2 - a[3] * (s2 * (1.0 / root));
  const Tensor<Real> about_z{
      mean + d,           mean - d, a[2], difference * (root * s2) + a[3] * c2, c * a[4] + s * a[5],
      c * a[5] - s * a[4]};
  if (all(simple)) return about_z;

  // R = I + 2/(1+h.h) ([h]x + [h]x [h]x), exactly orthogonal, with h = tan(angle/2) along the axis;
  // the series for the tangent is good to 1e-13 at 0.1 rad per step.
  const Eigen::Matrix<Real, 3, 1> half = 0.5 * angle;
  const Real t = half.squaredNorm();
  const Real tangent = 1.0 + t * (1.0 / 3 + t * (2.0 / 15 + t * (17.0 / 315 + t * (62.0 / 2835))));
  const Eigen::Matrix<Real, 3, 1> h = tangent * half;
  const Real r = 1.0 / (1.0 + h.squaredNorm());
  Eigen::Matrix<Real, 3, 3> cross;
  cross << Real(0.0), -h[2], h[1], h[2], Real(0.0), -h[0], -h[1], h[0], Real(0.0);
  const Eigen::Matrix<Real, 3, 3> rotation =
      Eigen::Matrix<Real, 3, 3>::Identity() + (2.0 * r) * (cross + cross * cross);
  return select(simple, about_z, rotated(a, rotation));
}

/// Work dissipated by a plastic strain increment, from the work of the stress before on it and that
/// of the stress after: the trapezoidal rule, or the end alone where the stress before opposed the
/// flow (the direction turned within the step).
template <class Real>
Real plastic_work(const Real& before, const Real& after) {
  return select(before > 0.0, 0.5 * (before + after), after);
}

/// Work of a step that ends without stress: the trapezoidal rule, but it gives back no more than
/// was stored.
template <class T, class Real = typename T::Scalar>
Real releasing_work(const T& before, const T& strain, const Real& stored) {
  return larger(0.5 * before.dot(strain), -stored);
}

}  // namespace grainpair
