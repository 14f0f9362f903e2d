// Drucker-Prager: linear elasticity inside the circular cone q = M p, isochoric plastic flow.
#include "mpm/materials/body_of.hpp"
#include "mpm/materials/isochoric_plasticity.hpp"

namespace grainpair {
namespace {

class CircularCone {
 public:
  explicit CircularCone(const Case& c) {
    const LinearElasticity elasticity(c);
    slope_ =
        c.number("material.stress_ratio") * elasticity.bulk / (std::sqrt(6.0) * elasticity.shear);
  }

  /// Radial return: q = sqrt(3/2) 2 G |dev(eps)| <= M K tr(eps).
  template <class Real>
  Real lost(const Real& volumetric, const Real& length2, const Real& /*e*/,
            const Real& /*dt*/) const {
    const Real limit = slope_ * volumetric;
    return select(length2 > limit * limit, 1.0 - limit / sqrt(length2), Real(0.0));
  }

 private:
  double slope_;  // |dev(eps)| / tr(eps) on the cone
};

using DruckerPrager = IsochoricPlasticity<CircularCone>;
GRAINPAIR_REGISTER_MATERIAL(DruckerPrager, "drucker_prager")

}  // namespace
}  // namespace grainpair
