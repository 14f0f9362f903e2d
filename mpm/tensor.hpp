// Symmetric second-order tensors as six-vectors in Mandel notation.
//
// Mandel: (xx, yy, zz, sqrt2 xy, sqrt2 yz, sqrt2 zx), so that the double contraction a:b is the
// plain dot product and a fourth-order tensor is a 6x6 matrix. Compression is positive throughout
// the project, for stress and for strain alike: p = tr(sigma)/3 > 0 in a loaded packing.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

namespace grainpair {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using SymTensor = Eigen::Matrix<double, 6, 1>;  // Mandel components

inline SymTensor identity() {
  // loaded whole: six scalar stores followed by vector loads would stall on every use
  alignas(32) static constexpr double components[] = {1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
  return Eigen::Map<const SymTensor>(components);
}

inline double trace(const SymTensor& a) { return a[0] + a[1] + a[2]; }

inline SymTensor deviator(const SymTensor& a) {
  SymTensor s = a;
  s -= (trace(a) / 3.0) * identity();
  return s;
}

/// det a, with the Mandel shears undone.
inline double determinant(const SymTensor& a) {
  constexpr double r2 = std::numbers::sqrt2;
  return a[0] * a[1] * a[2] + a[3] * a[4] * a[5] / r2 -
         0.5 * (a[0] * a[4] * a[4] + a[1] * a[5] * a[5] + a[2] * a[3] * a[3]);
}

/// a . a (matrix product), again symmetric.
inline SymTensor square(const SymTensor& a) {
  constexpr double r = 1.0 / std::numbers::sqrt2;
  return SymTensor{a[0] * a[0] + 0.5 * (a[3] * a[3] + a[5] * a[5]),
                   a[1] * a[1] + 0.5 * (a[3] * a[3] + a[4] * a[4]),
                   a[2] * a[2] + 0.5 * (a[4] * a[4] + a[5] * a[5]),
                   a[3] * (a[0] + a[1]) + r * a[4] * a[5],
                   a[4] * (a[1] + a[2]) + r * a[3] * a[5],
                   a[5] * (a[0] + a[2]) + r * a[3] * a[4]};
}

inline SymTensor from_matrix(const Mat3& m) {
  constexpr double r = 1.0 / std::numbers::sqrt2;
  return SymTensor{m(0, 0),
                   m(1, 1),
                   m(2, 2),
                   r * (m(0, 1) + m(1, 0)),
                   r * (m(1, 2) + m(2, 1)),
                   r * (m(2, 0) + m(0, 2))};
}

inline Mat3 to_matrix(const SymTensor& a) {
  constexpr double r = 1.0 / std::numbers::sqrt2;
  Mat3 m;
  m << a[0], r * a[3], r * a[5], r * a[3], a[1], r * a[4], r * a[5], r * a[4], a[2];
  return m;
}

/// R a R^T for a proper rotation R.
inline SymTensor rotated(const SymTensor& a, const Mat3& r) {
  return from_matrix(r * to_matrix(a) * r.transpose());
}

/// q = sqrt(3/2 s:s) [same unit as a].
inline double von_mises(const SymTensor& a) { return std::sqrt(1.5) * deviator(a).norm(); }

}  // namespace grainpair
