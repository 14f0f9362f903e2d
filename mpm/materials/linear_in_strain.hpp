// What laws of linear elasticity share, whatever else they do: constants, and the step they allow.
#pragma once

#include "mpm/materials/linear_elasticity.hpp"
#include "mpm/materials/solid_volume.hpp"
#include "mpm/points/material.hpp"

namespace grainpair {

class LinearInStrain : public Athermal {
 public:
  explicit LinearInStrain(const Case& c) : elasticity_(c), volume_(c) {}

  template <class State, class Real>
  StabilityOf<Real> stability(const State&, const Real& e) const {
    return {elasticity_.p_wave_modulus() * volume_.cauchy(e), 0.0};
  }

 protected:
  LinearElasticity elasticity_;
  SolidVolume volume_;
};

}  // namespace grainpair
