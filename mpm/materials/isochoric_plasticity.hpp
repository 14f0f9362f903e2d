// Linear elasticity inside a cone around the hydrostatic axis, and plastic flow normal to that
// axis, so without change of volume. The elastic volumetric strain is therefore the total one,
// counted from zero pressure: a point torn open carries no stress until its void ratio is back at
// that of separation. Which cone is the Cone's business.
#pragma once

#include "mpm/materials/kinematics.hpp"
#include "mpm/materials/linear_in_strain.hpp"

namespace grainpair {

/// Cone: cone.lost(volumetric, length2, e, dt) is the share of an elastic deviator, of square
/// length2, that flow takes away in a step, 0 inside the cone, for volumetric > 0.
template <class Cone>
class IsochoricPlasticity : public LinearInStrain {
 public:
  template <class Real>
  struct State {
    Tensor<Real> strain =
        Tensor<Real>::Zero();  // elastic strain; trace < 0 is the opening since separation
  };

  explicit IsochoricPlasticity(const Case& c) : LinearInStrain(c), cone_(c) {}

  Response<double, State> initial(const InitialState& start) const {
    const double e = start.void_ratio;
    const SymTensor strain = elasticity_.strain(start.sigma / volume_.cauchy(e));
    return returned<double>(trace(strain), deviator(strain), e, 0.0).response;
  }

  template <class Real>
  Response<Real, State> update(const State<Real>& old, const DeformationOf<Real>& step) const {
    const Tensor<Real> before = corotated(old.strain, step.spin, step.dt);
    const Real volumetric = trace(before) + volumetric_strain(step.void_ratio_old, step.void_ratio);
    const Tensor<Real> dev = deviator(Tensor<Real>(before + step.dt * step.D));
    auto [r, lost, length2] = returned<Real>(volumetric, dev, step.void_ratio, step.dt);
    // the plastic strain is `lost` times dev: it works with 2 G dev(eps) alone
    const auto loaded = trace(before) > 0.0;
    const Real work = plastic_work(select(loaded, before.dot(dev), Real(0.0)),
                                   select(r.regime == 0.0, Real(0.0), (1.0 - lost) * length2));
    r.energies.plastic = 2.0 * volume_.per_mass * elasticity_.shear * (lost * work);
    r.work = r.energies.stored -
             select(loaded, volume_.per_mass * elasticity_.energy(before), Real(0.0)) +
             r.energies.plastic;
    return r;
  }

 private:
  template <class Real>
  struct Returned {
    Response<Real, State> response;
    Real lost, length2;  // share of the trial's deviator [-], and its square
  };
  /// From the elastic strain of a trial, in parts.
  template <class Real>
  Returned<Real> returned(const Real& volumetric, const Tensor<Real>& dev, const Real& e,
                          const Real& dt) const {
    const Real length2 = dev.squaredNorm();
    const auto open = volumetric <= 0.0;
    const Real lost = select(open, Real(1.0), cone_.lost(volumetric, length2, e, dt));
    const Tensor<Real> kept = (1.0 - lost) * dev;
    const Real kept2 = (1.0 - lost) * (1.0 - lost) * length2;
    Response<Real, State> r;
    r.regime = select(open, Real(0.0), select(lost > 0.0, Real(2.0), Real(1.0)));
    r.state.strain = plus_isotropic(kept, volumetric * (1.0 / 3));
    r.sigma = select(open, Real(0.0), volume_.cauchy(e)) * elasticity_.stress(volumetric, kept);
    r.energies.stored =
        select(open, Real(0.0), volume_.per_mass * elasticity_.energy(volumetric, kept2));
    return {r, lost, length2};
  }

  Cone cone_;
};

}  // namespace grainpair
