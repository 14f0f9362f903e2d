// An extension of the seed's model [Ceccato2019], ours: beside the collisions, contacts that endure
// carry a share of the shear stress, the larger the longer velocities correlate,
//     sigma_k = 2 chi max(0, a:n) (L/d - 1) eta dev D .
// Its work >= 0 is friction in these contacts. It is dissipated at once and feeds no fluctuation:
// the balance of T is the seed's. Meant for the correlation length `softened`; the constants are
// fitted to element tests, never to a column.
//
// a, the fabric, says how far contacts have aligned with the flow n = dev D/|dev D|; it turns with
// the material and relaxes over the shear strain gamma_s,
//     a_dot = W a - a W + gdot/gamma_s (sqrt(1 + gamma_s^2) n - a) ,
// so that |a| = 1 in steady simple shear, whose rotation holds it back. Chains of grains that jam
// at nu_c take shear to form; grains without that structure jam at random close packing:
//     1/G = x /G(nu_c) + (1 - x)/G(nu_rcp),  x = min(1, |a|) .
// With gamma_s = 0 contacts are aligned at once: x = a:n = 1.
#include "mpm/materials/solid_fluid.hpp"

namespace grainpair {
namespace {

class EnduringContacts : public WithContacts {
 public:
  explicit EnduringContacts(const Case& c)
      : chi_(c.number("material.contact_share")), strain_(c.number("material.fabric_strain")) {}

  template <class Real>
  struct Memory {
    Tensor<Real> fabric = Tensor<Real>::Zero();  // a [-]
  };

  /// Backward Euler: no step is too long.
  template <class Real>
  Memory<Real> followed(const Memory<Real>& old, const DeformationOf<Real>& step) const {
    if (strain_ == 0.0) return old;
    const Tensor<Real> dev = deviator(step.D), turned = corotated(old.fabric, step.spin, step.dt);
    const Real rate = dev.norm(), passed = std::numbers::sqrt2 / strain_ * rate * step.dt;
    const Real kept = 1.0 / (1.0 + passed);
    // (1 - kept) n without a division by the rate
    const Real gain = std::sqrt(1.0 + strain_ * strain_) * std::numbers::sqrt2 / strain_ * step.dt;
    return {kept * (turned + gain * dev)};
  }

  template <class Real>
  Real inverse_g(const KineticTheory& gas, const Real& e, const Memory<Real>& memory) const {
    if (strain_ == 0.0) return gas.inverse_g(e);
    const Real x = smaller(memory.fabric.norm(), Real(1.0));
    return x * gas.inverse_g(e) + (1.0 - x) * gas.inverse_g(e, KineticTheory::nu_rcp);
  }

  /// chi (L/d - 1), where contacts have aligned with dev D as far as they do
  template <class Real>
  Real share(const KineticTheory::Coefficients<Real>& c, const Memory<Real>& memory,
             const Tensor<Real>& dev) const {
    const Real full = chi_ * (c.length - 1.0);
    if (strain_ == 0.0) return full;
    const Real along = memory.fabric.dot(dev) / larger(dev.norm(), Real(1e-300));
    return full * larger(along, Real(0.0));
  }

 private:
  double chi_;     // [-]
  double strain_;  // gamma_s [-]
};

using ContactShare = SolidFluidWith<EnduringContacts>;
GRAINPAIR_REGISTER_MATERIAL(ContactShare, "contact_share")

}  // namespace
}  // namespace grainpair
