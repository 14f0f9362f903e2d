// Isotropic linear elasticity: the bottom rung. Tension is allowed and nothing is dissipated.
#include "mpm/materials/body_of.hpp"
#include "mpm/materials/kinematics.hpp"
#include "mpm/materials/linear_in_strain.hpp"

namespace grainpair {
namespace {

class LinearElastic : public LinearInStrain {
 public:
  template <class Real>
  struct State {
    Tensor<Real> strain = Tensor<Real>::Zero();  // elastic strain, zero at zero stress
  };

  using LinearInStrain::LinearInStrain;

  Response<double, State> initial(const InitialState& start) const {
    return respond<double>(elasticity_.strain(start.sigma / volume_.cauchy(start.void_ratio)),
                           start.void_ratio);
  }

  template <class Real>
  Response<Real, State> update(const State<Real>& old, const DeformationOf<Real>& step) const {
    const Tensor<Real> strain = corotated(old.strain, step.spin, step.dt) + strain_increment(step);
    Response<Real, State> r = respond<Real>(strain, step.void_ratio);
    r.work = r.energies.stored - volume_.per_mass * elasticity_.energy(old.strain);
    return r;
  }

 private:
  template <class Real>
  Response<Real, State> respond(const Tensor<Real>& strain, const Real& e) const {
    Response<Real, State> r;
    r.state.strain = strain;
    r.sigma = volume_.cauchy(e) * elasticity_.stress(strain);
    r.energies.stored = volume_.per_mass * elasticity_.energy(strain);
    r.regime = 1.0;
    return r;
  }
};

GRAINPAIR_REGISTER_MATERIAL(LinearElastic, "linear_elastic")

}  // namespace
}  // namespace grainpair
