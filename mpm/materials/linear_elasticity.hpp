// Isotropic linear elasticity in terms of the elastic strain; trace 0 is zero pressure.
#pragma once

#include "cases/case.hpp"
#include "mpm/numbers/tensor.hpp"

namespace grainpair {

struct LinearElasticity {
  double bulk, shear;  // K, G [Pa]

  explicit LinearElasticity(const Case& c) {
    const double young = c.number("material.young_modulus"),
                 nu = c.number("material.poisson_ratio");
    bulk = young / (3.0 * (1.0 - 2.0 * nu));
    shear = young / (2.0 * (1.0 + nu));
  }
  LinearElasticity(double bulk_modulus, double shear_modulus)
      : bulk(bulk_modulus), shear(shear_modulus) {}

  /// sigma = K tr(eps) I + 2 G dev(eps) [Pa]
  template <class T>
  Tensor<typename T::Scalar> stress(const T& strain) const {
    return plus_isotropic(2.0 * shear * strain, (bulk - 2.0 / 3.0 * shear) * trace(strain));
  }
  /// The same of the strain's parts, tr(eps) and dev(eps).
  template <class T>
  Tensor<typename T::Scalar> stress(const typename T::Scalar& volumetric, const T& dev) const {
    return plus_isotropic(2.0 * shear * dev, bulk * volumetric);
  }
  SymTensor strain(const SymTensor& sigma) const {
    return plus_isotropic(sigma / (2.0 * shear),
                          trace(sigma) / 3.0 * (1.0 / (3.0 * bulk) - 1.0 / (2.0 * shear)));
  }
  /// Psi = K tr(eps)^2 / 2 + G dev(eps):dev(eps), where dev(eps):dev(eps) = eps:eps - tr(eps)^2 / 3
  /// [J/m3]
  template <class T>
  typename T::Scalar energy(const T& strain) const {
    const typename T::Scalar tr = trace(strain);
    return (0.5 * bulk - 1.0 / 3.0 * shear) * tr * tr + shear * strain.squaredNorm();
  }
  /// The same, of tr(eps) and dev(eps):dev(eps).
  template <class Real>
  Real energy(const Real& volumetric, const Real& length2) const {
    return 0.5 * bulk * volumetric * volumetric + shear * length2;
  }
  double p_wave_modulus() const { return bulk + 4.0 / 3.0 * shear; }  // [Pa]
};

}  // namespace grainpair
