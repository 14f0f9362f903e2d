// Isotropic linear elasticity: the bottom rung. Tension is allowed and nothing is dissipated.
#include "mpm/body.hpp"
#include "mpm/materials/kinematics.hpp"
#include "mpm/materials/linear_elasticity.hpp"
#include "mpm/materials/solid_volume.hpp"

namespace grainpair {
namespace {

class LinearElastic {
 public:
  struct State {
    SymTensor strain = SymTensor::Zero();  // elastic strain, zero at zero stress
  };

  explicit LinearElastic(const Case& c) : elasticity_(c), volume_(c) {}

  Response<State> initial(const InitialState& start) const {
    return respond({elasticity_.strain(start.sigma / volume_.cauchy(start.void_ratio))},
                   start.void_ratio);
  }

  Response<State> update(const State& old, const Deformation& step) const {
    const SymTensor strain = corotated(old.strain, step.spin, step.dt) + strain_increment(step);
    Response<State> r = respond({strain}, step.void_ratio);
    r.work = r.energies.stored - volume_.per_mass() * elasticity_.energy(old.strain);
    return r;
  }

  Stability stability(const State&, const SymTensor&, double e) const {
    return {elasticity_.p_wave_modulus() * volume_.cauchy(e), 0.0};
  }

  double granular_temperature(const State&) const { return 0.0; }

 private:
  Response<State> respond(const State& state, double e) const {
    Response<State> r;
    r.state = state;
    r.sigma = volume_.cauchy(e) * elasticity_.stress(state.strain);
    r.energies.stored = volume_.per_mass() * elasticity_.energy(state.strain);
    r.regime = 1;
    return r;
  }

  LinearElasticity elasticity_;
  SolidVolume volume_;
};

GRAINPAIR_REGISTER_MATERIAL(LinearElastic, "linear_elastic")

}  // namespace
}  // namespace grainpair
