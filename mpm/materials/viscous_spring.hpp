// The spring through which collisions are viscous on a grid.
//
// Dense collisions are viscous whatever T: at e <= e_c eta/density is H/kap, and an explicit step
// must resolve how that diffuses over a cell, which takes less time than sound does. So the dashpot
// acts through a spring (Maxwell's element), as stiff as the scene needs and no stiffer: per bulk
// density, with a the deviator and q the mean of the viscous stress,
//     a_dot/(2 G) + a/(2 eta) = dev D,   q_dot/G + q/lam = tr D,   psi = a:a/(4 G) + q^2/(2 G) .
// In a time eta/G, which is short, the stress is that of the dashpot.
// DEVIATION: [Ceccato2019, Eq. 12] has no spring. It is a numerical stiffness: what it stores is
// part of the elastic energy, and 0 weights are a rigid one, for a law by itself.
#pragma once

#include "cases/case.hpp"
#include "mpm/numbers/tensor.hpp"

namespace grainpair {

class ViscousSpring {
 public:
  explicit ViscousSpring(const Case& c)
      : ViscousSpring(c.number("mpm.viscous_stiffness") * c.number("geometry.gravity") *
                      c.number("geometry.height")) {}
  /// G per bulk density [m2/s2]; 0: rigid
  explicit ViscousSpring(double stiffness) : stiffness_(stiffness) {}

  bool rigid() const { return stiffness_ == 0.0; }
  /// Of the spring alone, per bulk density [m2/s2].
  double p_wave_modulus() const { return 7.0 / 3.0 * stiffness_; }

  /// At the end of a step: stress per bulk density [m2/s2]; per mass, what the spring stores, the
  /// work of the step, and what the dashpots took of it, by shear and by volume [J/kg].
  template <class Real>
  struct Stretched {
    Tensor<Real> stress;
    Real stored, work, shear_heat, bulk_heat;
  };

  /// Backward Euler from the stress `old`, which has turned with the material; eta and lam per bulk
  /// density [m2/s]. The heats are never negative, and the energies balance.
  template <class Real>
  Stretched<Real> stretched(const Tensor<Real>& old, const Tensor<Real>& dev, const Real& trD,
                            const Real& eta, const Real& lam, const Real& dt) const {
    if (rigid()) {
      const Real shear = dt * eta * (2.0 * dev.squaredNorm()), bulk = dt * lam * trD * trD;
      return {plus_isotropic((2.0 * eta) * dev, lam * trD), 0.0, shear + bulk, shear, bulk};
    }
    const double G = stiffness_;
    const Real q_old = trace(old) * (1.0 / 3), q = lam * (q_old + G * dt * trD) / (lam + G * dt);
    const Tensor<Real> a_old = deviator(old);
    const Tensor<Real> a = (eta / (eta + G * dt)) * (a_old + (2.0 * G * dt) * dev);
    const Real shear = a.squaredNorm() * (0.25 / G), bulk = q * q * (0.5 / G);
    const Real shear_work = dt * a.dot(dev), bulk_work = dt * q * trD;
    return {plus_isotropic(a, q), shear + bulk, shear_work + bulk_work,
            shear_work - (shear - a_old.squaredNorm() * (0.25 / G)),
            bulk_work - (bulk - q_old * q_old * (0.5 / G))};
  }

  /// What a stress per bulk density holds [J/kg].
  template <class T, class Real = typename T::Scalar>
  Real stored(const T& stress) const {
    if (rigid()) return 0.0;
    const Real q = trace(stress) * (1.0 / 3);
    return deviator(stress).squaredNorm() * (0.25 / stiffness_) + q * q * (0.5 / stiffness_);
  }

 private:
  double stiffness_;
};

}  // namespace grainpair
