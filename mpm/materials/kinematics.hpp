// What every law needs of a step's kinematics: the strain increment and the rotation of a material
// tensor.
#pragma once

#include <algorithm>
#include <cmath>

#include "mpm/material.hpp"

namespace grainpair {

/// ln((1+e_old)/(1+e)) = -ln(J_new/J_old): volumetric Hencky strain of the step, compression
/// positive [-].
inline double volumetric_strain(double e_old, double e) {
  const double x = (e_old - e) / (2.0 + e_old + e);  // the logarithm is 2 atanh x
  const double x2 = x * x;
  if (x2 > 1e-3) return std::log((1.0 + e_old) / (1.0 + e));
  // series to x^9; the first term left out is below 2/11 x^10 = 2e-16 of the result
  return 2.0 * x * (1.0 + x2 * (1.0 / 3 + x2 * (1.0 / 5 + x2 * (1.0 / 7 + x2 / 9))));
}

/// The step's strain: dev(D) dt, with the volume of det F.
inline SymTensor strain_increment(const Deformation& step) {
  SymTensor strain = step.dt * step.D;
  const double correction =
      (volumetric_strain(step.void_ratio_old, step.void_ratio) - trace(strain)) / 3.0;
  strain += (correction)*identity();
  return strain;
}

/// R a R^T, where R is the rotation by the angle |spin| dt about spin (Hughes-Winget; R exactly
/// orthogonal).
inline SymTensor corotated(const SymTensor& a, const Vec3& spin, double dt) {
  // R = I + 2/(1+h.h) ([h]x + [h]x [h]x) with h = tan(angle/2) along the axis; the series for the
  // tangent is good to 1e-13 at 0.1 rad per step.
  const Vec3 half = 0.5 * dt * spin;
  const double t = half.squaredNorm();
  const double tangent = 1.0 + t * (1.0 / 3 + t * (2.0 / 15 + t * (17.0 / 315 + t * 62.0 / 2835)));
  if (half[0] == 0.0 && half[1] == 0.0) {  // plane motion
    const double h = half[2] * tangent, r = 1.0 / (1.0 + h * h);
    const double c = (1.0 - h * h) * r, s = 2.0 * h * r, c2 = c * c - s * s, s2 = 2.0 * c * s;
    constexpr double root = std::numbers::sqrt2;
    const double mean = 0.5 * (a[0] + a[1]), difference = 0.5 * (a[0] - a[1]), shear = a[3] / root;
    const double d = difference * c2 - shear * s2;
    return SymTensor{mean + d,
                     mean - d,
                     a[2],
                     root * (difference * s2 + shear * c2),
                     c * a[4] + s * a[5],
                     c * a[5] - s * a[4]};
  }
  const Vec3 h = tangent * half;
  Mat3 cross;
  cross << 0, -h[2], h[1], h[2], 0, -h[0], -h[1], h[0], 0;
  const Mat3 rotation = Mat3::Identity() + 2.0 / (1.0 + h.squaredNorm()) * (cross + cross * cross);
  return rotated(a, rotation);
}

/// Work dissipated by a plastic strain increment while the stress goes from `before` to `after`:
/// the trapezoidal rule, or the end point alone where the stress before opposed the flow (the
/// direction turned within the step).
inline double plastic_work(const SymTensor& before, const SymTensor& after,
                           const SymTensor& strain) {
  const double first = before.dot(strain), last = after.dot(strain);
  return first > 0.0 ? 0.5 * (first + last) : last;
}

/// Work of a step that ends without stress: the trapezoidal rule, but it gives back no more than
/// was stored.
inline double releasing_work(const SymTensor& before, const SymTensor& strain, double stored) {
  return std::max(0.5 * before.dot(strain), -stored);
}

}  // namespace grainpair
