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
  template <class Real>
  struct State {
    Tensor<Real> strain = Tensor<Real>::Zero();  // elastic strain; trace < 0 is the opening since separation
  };

  explicit DruckerPrager(const Case& c)
      : elasticity_(c), volume_(c), stress_ratio_(c.number("material.stress_ratio")) {}

  Response<double, State> initial(const InitialState& start) const {
    return returned<double>(elasticity_.strain(start.sigma / volume_.cauchy(start.void_ratio)), start.void_ratio);
  }

  template <class Real>
  Response<Real, State> update(const State<Real>& old, const DeformationOf<Real>& step) const {
    const Tensor<Real> before = corotated(old.strain, step.spin, step.dt);
    const Tensor<Real> trial = before + strain_increment(step);
    Response<Real, State> r = returned<Real>(trial, step.void_ratio);
    // the plastic strain is a deviator: it works with 2 G dev(eps) alone
    const auto loaded = trace(before) > 0.0;
    const Tensor<Real> plastic = trial - r.state.strain;
    const Real work = plastic_work(select(loaded, before.dot(plastic), Real(0.0)),
                                   select(r.regime == 0.0, Real(0.0), r.state.strain.dot(plastic)));
    r.energies.plastic = 2.0 * volume_.per_mass() * elasticity_.shear * work;
    r.work = r.energies.stored - select(loaded, volume_.per_mass() * elasticity_.energy(before), Real(0.0)) +
             r.energies.plastic;
    return r;
  }

  template <class Real>
  StabilityOf<Real> stability(const State<Real>&, const Real& e) const {
    return {elasticity_.p_wave_modulus() * volume_.cauchy(e), 0.0};
  }

  template <class Real>
  Real granular_temperature(const State<Real>&) const {
    return 0.0;
  }

 private:
  /// Radial return: q = sqrt(3/2) 2 G |dev(eps)| <= M K tr(eps).
  template <class Real>
  Response<Real, State> returned(const Tensor<Real>& trial, const Real& e) const {
    const Real volumetric = trace(trial);
    const Tensor<Real> dev = deviator(trial);
    const Real length2 = dev.squaredNorm();
    const Real limit = stress_ratio_ * elasticity_.bulk / (std::sqrt(6.0) * elasticity_.shear) * volumetric;
    const auto open = volumetric <= 0.0, flows = !open && length2 > limit * limit;
    const Real excess = select(open, Real(1.0), select(flows, 1.0 - limit / sqrt(length2), Real(0.0)));
    Response<Real, State> r;
    r.regime = select(open, Real(0.0), select(flows, Real(2.0), Real(1.0)));
    r.state.strain = trial - excess * dev;
    r.sigma = select(open, Real(0.0), volume_.cauchy(e)) * elasticity_.stress(r.state.strain);
    r.energies.stored = select(open, Real(0.0), volume_.per_mass() * elasticity_.energy(r.state.strain));
    return r;
  }

  LinearElasticity elasticity_;
  SolidVolume volume_;
  double stress_ratio_;  // M
};

GRAINPAIR_REGISTER_MATERIAL(DruckerPrager, "drucker_prager")

}  // namespace
}  // namespace grainpair
