// mu(I) rheology [Jop2006] with linear elasticity: below mu_s p the point is elastic; above, it
// flows without change of volume at the rate at which tau = mu(I) p,
//     mu(I) = mu_s + (mu_2 - mu_s)/(1 + I_0/I),  I = gdot d sqrt(rho_s/p).
// Backward Euler in the plastic rate gdot, in closed form. A point torn open (a <= 0) carries no
// stress.
#include "mpm/body.hpp"
#include "mpm/materials/kinematics.hpp"
#include "mpm/materials/linear_elasticity.hpp"
#include "mpm/materials/solid_volume.hpp"

namespace grainpair {
namespace {

class MuI {
 public:
  template <class Real>
  struct State {
    Tensor<Real> strain = Tensor<Real>::Zero();  // elastic; trace < 0 is the opening since separation
  };

  explicit MuI(const Case& c)
      : elasticity_(c),
        volume_(c),
        mu_s_(c.number("material.static_friction")),
        mu_2_(c.number("material.dynamic_friction")),
        i_0_(c.number("material.inertial_number")),
        diameter_(c.number("grains.diameter")) {}

  Response<double, State> initial(const InitialState& start) const {
    const SymTensor strain = elasticity_.strain(start.sigma / volume_.cauchy(start.void_ratio));
    const bool loaded = trace(strain) > 0.0;
    return respond<double>(loaded ? strain : SymTensor::Zero(), start.void_ratio, loaded ? 1.0 : 0.0);
  }

  template <class Real>
  Response<Real, State> update(const State<Real>& old, const DeformationOf<Real>& step) const {
    const Tensor<Real> before = corotated(old.strain, step.spin, step.dt);
    const Tensor<Real> trial = before + strain_increment(step);
    Response<Real, State> r = returned<Real>(trial, step);
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
  template <class Real>
  Response<Real, State> returned(const Tensor<Real>& trial, const DeformationOf<Real>& step) const {
    const Real a = trace(trial);
    const Tensor<Real> dev = deviator(trial);
    const Real p = elasticity_.bulk * a, tau = std::numbers::sqrt2 * elasticity_.shear * dev.norm();
    const Real excess = tau - mu_s_ * p;
    const auto open = a <= 0.0, flows = !open && excess > 0.0;
    // With x = G gdot dt: (excess - x)(x + x_0) = B x, where B = (mu_2 - mu_s) p and x_0 = I_0 G
    // dt/(d sqrt(rho/p)).
    const Real B = (mu_2_ - mu_s_) * p;
    const Real x_0 = i_0_ * elasticity_.shear / diameter_ * step.dt *
                     sqrt(p * volume_.cauchy(step.void_ratio) / volume_.grain_density);
    const Real b = x_0 + B - excess, root = sqrt(b * b + 4.0 * excess * x_0);
    const Real x = select(b > 0.0, 2.0 * excess * x_0 / (b + root), 0.5 * (root - b));
    const Real lost = select(open, Real(1.0), select(flows, x / tau, Real(0.0)));
    return respond<Real>(trial - lost * dev, step.void_ratio,
                         select(open, Real(0.0), select(flows, Real(2.0), Real(1.0))));
  }

  template <class Real>
  Response<Real, State> respond(const Tensor<Real>& strain, const Real& e, const Real& regime) const {
    const auto open = regime == 0.0;
    Response<Real, State> r;
    r.regime = regime;
    r.state.strain = strain;
    r.sigma = select(open, Real(0.0), volume_.cauchy(e)) * elasticity_.stress(strain);
    r.energies.stored = select(open, Real(0.0), volume_.per_mass() * elasticity_.energy(strain));
    return r;
  }

  LinearElasticity elasticity_;
  SolidVolume volume_;
  double mu_s_, mu_2_, i_0_;
  double diameter_;  // [m]
};

GRAINPAIR_REGISTER_MATERIAL(MuI, "mu_i")

}  // namespace
}  // namespace grainpair
