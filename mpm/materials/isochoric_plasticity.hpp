// Linear elasticity inside a cone around the hydrostatic axis, and plastic flow normal to that axis, so without change of
// volume. The elastic volumetric strain is therefore the total one, counted from zero pressure: a point torn open
// carries no stress until its void ratio is back at that of separation. Which cone is the Cone's business.
#pragma once

#include "mpm/materials/kinematics.hpp"
#include "mpm/materials/linear_in_strain.hpp"

namespace grainpair {

/// Cone: cone.lost(volumetric, dev, e, dt) is the share of the elastic deviator dev that flow takes away in a step, 0
/// inside the cone, for volumetric > 0.
template <class Cone>
class IsochoricPlasticity : public LinearInStrain {
 public:
  template <class Real>
  struct State {
    Tensor<Real> strain = Tensor<Real>::Zero();  // elastic strain; trace < 0 is the opening since separation
  };

  explicit IsochoricPlasticity(const Case& c) : LinearInStrain(c), cone_(c) {}

  Response<double, State> initial(const InitialState& start) const {
    const double e = start.void_ratio;
    return returned<double>(elasticity_.strain(start.sigma / volume_.cauchy(e)), e, 0.0);
  }

  template <class Real>
  Response<Real, State> update(const State<Real>& old, const DeformationOf<Real>& step) const {
    const Tensor<Real> before = corotated(old.strain, step.spin, step.dt);
    const Tensor<Real> trial = before + strain_increment(step);
    Response<Real, State> r = returned<Real>(trial, step.void_ratio, step.dt);
    // the plastic strain is a deviator: it works with 2 G dev(eps) alone
    const auto loaded = trace(before) > 0.0;
    const Tensor<Real> plastic = trial - r.state.strain;
    const Real work = plastic_work(select(loaded, before.dot(plastic), Real(0.0)),
                                   select(r.regime == 0.0, Real(0.0), r.state.strain.dot(plastic)));
    r.energies.plastic = 2.0 * volume_.per_mass * elasticity_.shear * work;
    r.work = r.energies.stored - select(loaded, volume_.per_mass * elasticity_.energy(before), Real(0.0)) +
             r.energies.plastic;
    return r;
  }

 private:
  template <class Real>
  Response<Real, State> returned(const Tensor<Real>& trial, const Real& e, const Real& dt) const {
    const Real volumetric = trace(trial);
    const Tensor<Real> dev = deviator(trial);
    const auto open = volumetric <= 0.0;
    const Real lost = select(open, Real(1.0), cone_.lost(volumetric, dev, e, dt));
    Response<Real, State> r;
    r.regime = select(open, Real(0.0), select(lost > 0.0, Real(2.0), Real(1.0)));
    r.state.strain = trial - lost * dev;
    r.sigma = select(open, Real(0.0), volume_.cauchy(e)) * elasticity_.stress(r.state.strain);
    r.energies.stored = select(open, Real(0.0), volume_.per_mass * elasticity_.energy(r.state.strain));
    return r;
  }

  Cone cone_;
};

}  // namespace grainpair
