// mu(I) rheology [Jop2006] with linear elasticity: below mu_s p the point is elastic; above, it
// flows without change of volume at the rate at which tau = mu(I) p,
//     mu(I) = mu_s + (mu_2 - mu_s)/(1 + I_0/I),  I = gdot d sqrt(rho_s/p).
// Backward Euler in the plastic rate gdot, in closed form.
#include "mpm/materials/body_of.hpp"
#include "mpm/materials/isochoric_plasticity.hpp"

namespace grainpair {
namespace {

class RateDependentCone {
 public:
  explicit RateDependentCone(const Case& c)
      : elasticity_(c),
        volume_(c),
        mu_s_(c.number("material.static_friction")),
        mu_2_(c.number("material.dynamic_friction")),
        i_0_(c.number("material.inertial_number")),
        diameter_(c.number("grains.diameter")) {}

  /// With x = G gdot dt: (excess - x)(x + x_0) = B x, where excess = tau - mu_s p, B = (mu_2 -
  /// mu_s) p and x_0 = I_0 G dt/(d sqrt(rho/p)).
  template <class Real>
  Real lost(const Real& volumetric, const Real& length2, const Real& e, const Real& dt) const {
    const Real p = elasticity_.bulk * volumetric,
               tau = std::numbers::sqrt2 * elasticity_.shear * sqrt(length2);
    const Real excess = tau - mu_s_ * p, B = (mu_2_ - mu_s_) * p;
    const Real x_0 = i_0_ * elasticity_.shear / diameter_ * dt *
                     sqrt(p * volume_.cauchy(e) / volume_.grain_density);
    const Real b = x_0 + B - excess, root = sqrt(b * b + 4.0 * excess * x_0);
    const Real x = select(b > 0.0, 2.0 * excess * x_0 / (b + root), 0.5 * (root - b));
    return select(excess > 0.0, x / tau, Real(0.0));
  }

 private:
  LinearElasticity elasticity_;
  SolidVolume volume_;
  double mu_s_, mu_2_, i_0_;
  double diameter_;  // [m]
};

using MuI = IsochoricPlasticity<RateDependentCone>;
GRAINPAIR_REGISTER_MATERIAL(MuI, "mu_i")

}  // namespace
}  // namespace grainpair
