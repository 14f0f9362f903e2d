// The volume that elastic energy belongs to.
//
// A law's elastic energy Psi is held by the solid, so it is counted per unit of solid mass; with
// the reference void ratio e_r, psi = Psi (1+e_r)/rho_s [J/kg]. Its derivative with respect to the
// Hencky strain is then not the Cauchy stress sigma but tau = sigma (1+e)/(1+e_r), which does the
// same work on the solid:
//     sigma : deps (1+e)/rho_s = tau : deps (1+e_r)/rho_s .
// At e = e_r the two stresses agree.
// DEVIATION: the seed, for small strain, makes no such difference; without it an elastic loop loses
// energy of the order of its strain.
#pragma once

#include "cases/case.hpp"
#include "mpm/points/material.hpp"

namespace grainpair {

struct SolidVolume {
  double reference_void_ratio;  // e_r
  double grain_density;         // rho_s [kg/m3]
  double per_mass;              // J/m3 of the reference volume -> J/kg of solid

  explicit SolidVolume(const Case& c)
      : SolidVolume(c.number("initial.void_ratio"), c.number("grains.density")) {}
  SolidVolume(double void_ratio, double density)
      : reference_void_ratio(void_ratio),
        grain_density(density),
        per_mass((1.0 + void_ratio) / density) {}

  /// sigma/tau at void ratio e
  template <class Real>
  Real cauchy(const Real& e) const {
    return (1.0 + reference_void_ratio) * (1.0 / (1.0 + e));  // a quotient that others share
  }
};

}  // namespace grainpair
