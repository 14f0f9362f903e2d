// Hyperelastic, perfectly plastic on the Lade-Duncan cone, with flow along the cone's normal in the
// deviatoric plane and no change of volume, or a constant dilation. No critical state, no
// collisions.
//
// Isochoric flow leaves the elastic volumetric strain equal to the total one, counted from zero
// pressure. A point torn open (a <= 0) carries no stress until its void ratio is back at that of
// separation.
#include "mpm/materials/lade_duncan.hpp"

#include "mpm/body.hpp"
#include "mpm/materials/kinematics.hpp"
#include "mpm/materials/solid_volume.hpp"

namespace grainpair {
namespace {

class PerfectLadeDuncan {
 public:
  struct State {
    SymTensor strain = SymTensor::Zero();  // elastic; trace a = 0 at zero stress, < 0 when open
  };

  explicit PerfectLadeDuncan(const Case& c)
      : elasticity_(c),
        cone_(c),
        volume_(c),
        ratio_(-std::sqrt(2.0 / 3.0) * c.number("material.dilation")) {}

  Response<State> initial(const InitialState& start) const {
    if (trace(start.sigma) <= 0.0) return returned(SymTensor::Zero(), start.void_ratio);
    return returned(elasticity_.strain(start.sigma / volume_.cauchy(start.void_ratio)),
                    start.void_ratio);
  }

  Response<State> update(const State& old, const Deformation& step) const {
    const SymTensor before = corotated(old.strain, step.spin, step.dt);
    const SymTensor trial = before + strain_increment(step);
    Response<State> r = returned(trial, step.void_ratio);
    if (r.regime != 1)
      r.energies.plastic = volume_.per_mass() * plastic_work(elasticity_.stress(before),
                                                             elasticity_.stress(r.state.strain),
                                                             trial - r.state.strain);
    r.work =
        r.energies.stored - volume_.per_mass() * elasticity_.energy(before) + r.energies.plastic;
    return r;
  }

  Stability stability(const State& state, const SymTensor&, double e) const {
    return {volume_.cauchy(e) * elasticity_.p_wave_modulus(state.strain), 0.0};
  }

  double granular_temperature(const State&) const { return 0.0; }

 private:
  /// The admissible strain nearest to a trial, with its stress and energy.
  Response<State> returned(const SymTensor& trial, double e) const {
    const double a = trace(trial);
    Response<State> r;
    if (a <= 0.0) {
      r.regime = 0;
      r.state.strain = a / 3.0 * identity();
      r.sigma.setZero();
      return r;
    }
    const SymTensor dev = deviator(trial);
    if (cone_.holds(elasticity_.coupling / a * dev)) {
      r.regime = 1;
      r.state.strain = trial;
    } else {
      const ConeReturn back = cone_.along_flow(elasticity_, dev, a, ratio_);
      r.regime = 2;
      r.state.strain = back.deviatoric + back.volumetric / 3.0 * identity();
    }
    r.sigma = volume_.cauchy(e) * elasticity_.stress(r.state.strain);
    r.energies.stored = volume_.per_mass() * elasticity_.energy(r.state.strain);
    return r;
  }

  Hyperelastic elasticity_;
  LadeDuncan cone_;
  SolidVolume volume_;
  double ratio_;  // plastic volumetric over deviatoric strain, compression positive
};

GRAINPAIR_REGISTER_MATERIAL(PerfectLadeDuncan, "lade_duncan")

}  // namespace
}  // namespace grainpair
