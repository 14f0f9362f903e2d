// An extension of the seed's model [Ceccato2019], ours: beside the collisions, contacts that endure
// carry a share of the shear stress, the larger the longer velocities correlate,
//     sigma_k = 2 chi (L/d - 1) eta dev D .
// Its work chi (L/d - 1) eta gdot^2 >= 0 is friction in these contacts. It is dissipated at once
// and feeds no fluctuation: the balance of T is the seed's. Meant for the correlation length
// `softened`; chi and its onset Y_0 are fitted to element tests, never to a column.
#include "mpm/materials/solid_fluid.hpp"

namespace grainpair {
namespace {

class EnduringContacts : public WithContacts {
 public:
  explicit EnduringContacts(const Case& c) : chi_(c.number("material.contact_share")) {}

  /// chi (L/d - 1)
  template <class Real>
  Real share(const KineticTheory::Coefficients<Real>& c) const {
    return chi_ * (c.length - 1.0);
  }

 private:
  double chi_;
};

using ContactShare = SolidFluidWith<EnduringContacts>;
GRAINPAIR_REGISTER_MATERIAL(ContactShare, "contact_share")

}  // namespace
}  // namespace grainpair
