// Hyperelastic, perfectly plastic on the Lade-Duncan cone, with flow along the cone's normal in the
// deviatoric plane and no change of volume, or a constant dilation. No critical state, no
// collisions.
//
// Isochoric flow leaves the elastic volumetric strain equal to the total one, counted from zero
// pressure. A point torn open (a <= 0) carries no stress until its void ratio is back at that of
// separation.
#include "mpm/materials/lade_duncan.hpp"

#include "mpm/materials/body_of.hpp"
#include "mpm/materials/kinematics.hpp"
#include "mpm/materials/solid_volume.hpp"

namespace grainpair {
namespace {

class PerfectLadeDuncan : public Athermal {
 public:
  template <class Real>
  struct State {
    Tensor<Real> strain =
        Tensor<Real>::Zero();  // elastic; trace a = 0 at zero stress, < 0 when open
  };

  explicit PerfectLadeDuncan(const Case& c)
      : elasticity_(c),
        cone_(c),
        volume_(c),
        ratio_(-std::sqrt(2.0 / 3.0) * c.number("material.dilation")) {}

  Response<double, State> initial(const InitialState& start) const {
    if (trace(start.sigma) <= 0.0) return returned<double>(SymTensor::Zero(), start.void_ratio);
    return returned<double>(elasticity_.strain(start.sigma / volume_.cauchy(start.void_ratio)),
                            start.void_ratio);
  }

  template <class Real>
  Response<Real, State> update(const State<Real>& old, const DeformationOf<Real>& step) const {
    const Tensor<Real> turned = corotated(old.strain, step.spin, step.dt);
    const Tensor<Real> trial = turned + strain_increment(step);
    Response<Real, State> r = returned<Real>(trial, step.void_ratio);
    const auto before = elasticity_.evaluate(turned);
    const Tensor<Real> plastic = trial - r.state.strain;
    const Real work = plastic_work<Real>(before.stress.dot(plastic),
                                         r.sigma.dot(plastic) / volume_.cauchy(step.void_ratio));
    r.energies.plastic = volume_.per_mass * select(r.regime == 1.0, Real(0.0), work);
    r.work = r.energies.stored - volume_.per_mass * before.energy + r.energies.plastic;
    return r;
  }

  template <class Real>
  StabilityOf<Real> stability(const State<Real>& state, const Real& e) const {
    return {volume_.cauchy(e) * elasticity_.p_wave_modulus(state.strain), 0.0};
  }

 private:
  /// The admissible strain nearest to a trial, with its stress and energy.
  template <class Real>
  Response<Real, State> returned(const Tensor<Real>& trial, const Real& e) const {
    const Real a = trace(trial);
    const Tensor<Real> dev = deviator(trial);
    const auto open = a <= 0.0;
    const auto flows = !open && !cone_.holds(elasticity_.coupling / a * dev);
    Response<Real, State> r;
    r.regime = select(open, Real(0.0), select(flows, Real(2.0), Real(1.0)));
    r.state.strain = select(open, isotropic(a * (1.0 / 3)), trial);
    if (any(flows)) {
      const auto back = cone_.along_flow(elasticity_, dev, a, ratio_, flows);
      r.state.strain = select(flows, plus_isotropic(back.deviatoric, back.volumetric * (1.0 / 3)),
                              r.state.strain);
    }
    const auto now = elasticity_.evaluate(r.state.strain);
    r.sigma = volume_.cauchy(e) * now.stress;
    r.energies.stored = volume_.per_mass * now.energy;
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
