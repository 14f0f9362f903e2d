// Symmetric second-order tensors as six-vectors in Mandel notation.
//
// Mandel: (xx, yy, zz, sqrt2 xy, sqrt2 yz, sqrt2 zx), so that the double contraction a:b is the
// plain dot product and a fourth-order tensor is a 6x6 matrix. Compression is positive throughout
// the project, for stress and for strain alike: p = tr(sigma)/3 > 0 in a loaded packing.
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <type_traits>

#include "mpm/numbers/rows.hpp"

namespace grainpair {

using Vec3 = Eigen::Vector3d;
/// With zeros where a plane has no axis.
template <class V>
Vec3 padded(const V& a) {
  Vec3 out = Vec3::Zero();
  out.head<V::SizeAtCompileTime>() = a;
  return out;
}
using Mat3 = Eigen::Matrix3d;
using SymTensor = Eigen::Matrix<double, 6, 1>;  // Mandel components

/// N numbers of several points at once. Copied one by one, so that they stay in registers.
template <int N, class Real = Wide>
class WideArray {
 public:
  using Scalar = Real;
  WideArray() = default;
  template <class... Component>
  requires(sizeof...(Component) == N) WideArray(const Component&... c) : c_{same(c)...} {}
  WideArray(const WideArray& a) {
    each([&](int i) { c_[i] = same(a.c_[i]); });
  }
  // NOLINTNEXTLINE(bugprone-unhandled-self-assignment): component by component, onto itself too
  WideArray& operator=(const WideArray& a) {
    each([&](int i) { c_[i] = same(a.c_[i]); });
    return *this;
  }
  static WideArray Zero() {
    return of([](int) { return Real(0.0); });
  }

  Real& operator[](int i) { return c_[i]; }
  const Real& operator[](int i) const { return c_[i]; }

  friend WideArray operator+(const WideArray& a, const WideArray& b) {
    return of([&](int i) { return a[i] + b[i]; });
  }
  friend WideArray operator-(const WideArray& a, const WideArray& b) {
    return of([&](int i) { return a[i] - b[i]; });
  }
  friend WideArray operator*(const Real& x, const WideArray& a) {
    return of([&](int i) { return x * a[i]; });
  }
  WideArray& operator+=(const WideArray& b) { return *this = *this + b; }

  /// Halves first: two chains of additions.
  Real dot(const WideArray& b) const { return sum<0, (N + 1) / 2>(b) + sum<(N + 1) / 2, N>(b); }
  Real squaredNorm() const { return dot(*this); }
  Real norm() const { return sqrt(squaredNorm()); }

 private:
  template <class F>
  static void each(F&& f) {
    [&]<int... i>(std::integer_sequence<int, i...>) { (f(i), ...); }
    (std::make_integer_sequence<int, N>());
  }
  template <class F>
  static WideArray of(F&& f) {
    WideArray out;
    each([&](int i) { out.c_[i] = same(f(i)); });
    return out;
  }
  template <int Begin, int End>
  Real sum(const WideArray& b) const {
    Real out = (*this)[Begin] * b[Begin];
    for (int i = Begin + 1; i < End; ++i) out += (*this)[i] * b[i];
    return out;
  }

  /// Copied as a class, the compiler would keep it in memory.
  static Real same(const Real& x) { return wide(lanes(x)); }

  Real c_[N];
};
using WideTensor = WideArray<6>;

/// A vector of `Dim` axes.
template <int Dim, class Real>
using VectorOf = std::conditional_t<std::is_same_v<Real, double>, Eigen::Matrix<double, Dim, 1>,
                                    WideArray<Dim, Real>>;

/// A matrix of `Dim` by `Dim`; of several points at once, by columns.
template <int Dim, class Real>
using MatrixOf = std::conditional_t<std::is_same_v<Real, double>, Eigen::Matrix<double, Dim, Dim>,
                                    std::array<WideArray<Dim, Real>, Dim>>;

/// SymTensor for Real = double.
template <class Real>
using Tensor = std::conditional_t<std::is_same_v<Real, double>, SymTensor, WideTensor>;

inline SymTensor identity() {
  // loaded whole: six scalar stores followed by vector loads would stall on every use
  alignas(32) static constexpr double components[] = {1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
  return Eigen::Map<const SymTensor>(components);
}

/// a + x I
inline SymTensor plus_isotropic(const SymTensor& a, double x) { return a + x * identity(); }
inline WideTensor plus_isotropic(const WideTensor& a, const Wide& x) {
  return {a[0] + x, a[1] + x, a[2] + x, a[3], a[4], a[5]};
}
/// x I
inline SymTensor isotropic(double x) { return x * identity(); }
inline WideTensor isotropic(const Wide& x) { return {x, x, x, 0.0, 0.0, 0.0}; }

/// m ? yes : no, point by point.
inline SymTensor select(bool m, const SymTensor& yes, const SymTensor& no) { return m ? yes : no; }
inline WideTensor select(const Mask<Wide>& m, const WideTensor& yes, const WideTensor& no) {
  const auto at = [&](int i) { return select(m, yes[i], no[i]); };
  return {at(0), at(1), at(2), at(3), at(4), at(5)};
}

template <class T>
typename T::Scalar trace(const T& a) {
  return a[0] + a[1] + a[2];
}

template <class T>
Tensor<typename T::Scalar> deviator(const T& a) {
  return plus_isotropic(a, trace(a) * (-1.0 / 3));
}

/// det a, with the Mandel shears undone.
template <class T>
typename T::Scalar determinant(const T& a) {
  constexpr double r2 = std::numbers::sqrt2;
  return a[0] * a[1] * a[2] + a[3] * a[4] * a[5] / r2 -
         0.5 * (a[0] * a[4] * a[4] + a[1] * a[5] * a[5] + a[2] * a[3] * a[3]);
}

/// a . a (matrix product), again symmetric.
template <class T>
Tensor<typename T::Scalar> square(const T& a) {
  constexpr double r = 1.0 / std::numbers::sqrt2;
  return Tensor<typename T::Scalar>{a[0] * a[0] + 0.5 * (a[3] * a[3] + a[5] * a[5]),
                                    a[1] * a[1] + 0.5 * (a[3] * a[3] + a[4] * a[4]),
                                    a[2] * a[2] + 0.5 * (a[4] * a[4] + a[5] * a[5]),
                                    a[3] * (a[0] + a[1]) + r * a[4] * a[5],
                                    a[4] * (a[1] + a[2]) + r * a[3] * a[5],
                                    a[5] * (a[0] + a[2]) + r * a[3] * a[4]};
}

template <class E>
Tensor<typename E::Scalar> from_matrix(const Eigen::MatrixBase<E>& matrix) {
  const Eigen::Matrix<typename E::Scalar, 3, 3> m = matrix;
  constexpr double r = 1.0 / std::numbers::sqrt2;
  return {m(0, 0),
          m(1, 1),
          m(2, 2),
          r * (m(0, 1) + m(1, 0)),
          r * (m(1, 2) + m(2, 1)),
          r * (m(2, 0) + m(0, 2))};
}

template <class T>
Eigen::Matrix<typename T::Scalar, 3, 3> to_matrix(const T& a) {
  constexpr double r = 1.0 / std::numbers::sqrt2;
  Eigen::Matrix<typename T::Scalar, 3, 3> m;
  m << a[0], r * a[3], r * a[5], r * a[3], a[1], r * a[4], r * a[5], r * a[4], a[2];
  return m;
}

/// a_ij, with the Mandel shear undone.
template <class T>
typename T::Scalar component(const T& a, int i, int j) {
  constexpr double r = 1.0 / std::numbers::sqrt2;
  if (i == j) return a[i];
  return r * a[i + j == 1 ? 3 : i + j == 3 ? 4 : 5];
}

/// R a R^T for a proper rotation R.
template <class T>
T rotated(const T& a, const Eigen::Matrix<typename T::Scalar, 3, 3>& r) {
  return from_matrix(r * to_matrix(a) * r.transpose());
}

/// q = sqrt(3/2 s:s) [same unit as a].
inline double von_mises(const SymTensor& a) { return std::sqrt(1.5) * deviator(a).norm(); }

}  // namespace grainpair
