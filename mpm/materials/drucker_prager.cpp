// Drucker-Prager: linear elasticity inside the circular cone q = M p, plastic flow normal to the
// cone's axis, so without change of volume. The elastic volumetric strain is therefore the total
// one, counted from zero pressure: a point torn open carries no stress until its void ratio is back
// at that of separation.
#include "mpm/body.hpp"
#include "mpm/materials/kinematics.hpp"
#include "mpm/materials/linear_elasticity.hpp"
#include "mpm/materials/solid_volume.hpp"

namespace grainpair {
namespace {

class DruckerPrager {
 public:
  struct State {
    SymTensor strain =
        SymTensor::Zero();  // elastic strain; trace < 0 is the opening since separation
  };

  explicit DruckerPrager(const Case& c)
      : elasticity_(c), volume_(c), stress_ratio_(c.number("material.stress_ratio")) {}

  Response<State> initial(const InitialState& start) const {
    return returned(elasticity_.strain(start.sigma / volume_.cauchy(start.void_ratio)),
                    start.void_ratio);
  }

  Response<State> update(const State& old, const Deformation& step) const {
    const SymTensor before = corotated(old.strain, step.spin, step.dt);
    const SymTensor trial = before + strain_increment(step);
    Response<State> r = returned(trial, step.void_ratio);
    if (r.regime != 1)
      r.energies.plastic = volume_.per_mass() * plastic_work(stress(before), stress(r.state.strain),
                                                             trial - r.state.strain);
    r.work = r.energies.stored - volume_.per_mass() * energy(before) + r.energies.plastic;
    return r;
  }

  Stability stability(const State&, const SymTensor&, double e) const {
    return {elasticity_.p_wave_modulus() * volume_.cauchy(e), 0.0};
  }

  double granular_temperature(const State&) const { return 0.0; }

 private:
  SymTensor stress(const SymTensor& strain) const {
    return trace(strain) > 0.0 ? elasticity_.stress(strain) : SymTensor::Zero();
  }
  double energy(const SymTensor& strain) const {
    return trace(strain) > 0.0 ? elasticity_.energy(strain) : 0.0;
  }

  /// Radial return: q = sqrt(3/2) 2 G |dev(eps)| <= M K tr(eps).
  Response<State> returned(const SymTensor& trial, double e) const {
    const double volumetric = trace(trial);
    const SymTensor dev = deviator(trial);
    const double length2 = dev.squaredNorm();
    const double limit = std::max(
        stress_ratio_ * elasticity_.bulk * volumetric / (std::sqrt(6.0) * elasticity_.shear), 0.0);
    Response<State> r;
    r.regime = volumetric <= 0.0 ? 0 : length2 > limit * limit ? 2 : 1;
    r.state.strain = r.regime == 1
                         ? trial
                         : SymTensor(volumetric / 3.0 * identity() +
                                     (r.regime == 2 ? limit / std::sqrt(length2) : 0.0) * dev);
    r.sigma = volume_.cauchy(e) * stress(r.state.strain);
    r.energies.stored = volume_.per_mass() * energy(r.state.strain);
    return r;
  }

  LinearElasticity elasticity_;
  SolidVolume volume_;
  double stress_ratio_;  // M
};

GRAINPAIR_REGISTER_MATERIAL(DruckerPrager, "drucker_prager")

}  // namespace
}  // namespace grainpair
