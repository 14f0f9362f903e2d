// Isotropic linear elasticity in terms of the elastic strain; trace 0 is zero pressure.
#pragma once

#include "mpm/case.hpp"
#include "mpm/tensor.hpp"

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
  SymTensor stress(const SymTensor& strain) const {
    SymTensor sigma = 2.0 * shear * strain;
    sigma += ((bulk - 2.0 / 3.0 * shear) * trace(strain)) * identity();
    return sigma;
  }
  SymTensor strain(const SymTensor& sigma) const {
    SymTensor e = sigma / (2.0 * shear);
    e += (trace(sigma) / 3.0 * (1.0 / (3.0 * bulk) - 1.0 / (2.0 * shear))) * identity();
    return e;
  }
  /// Psi = K tr(eps)^2 / 2 + G dev(eps):dev(eps) [J/m3]
  double energy(const SymTensor& strain) const { return 0.5 * stress(strain).dot(strain); }
  double p_wave_modulus() const { return bulk + 4.0 / 3.0 * shear; }  // [Pa]
};

}  // namespace grainpair
