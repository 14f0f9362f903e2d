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
  struct State {
    SymTensor strain = SymTensor::Zero();  // elastic; trace < 0 is the opening since separation
  };

  explicit MuI(const Case& c)
      : elasticity_(c),
        volume_(c),
        mu_s_(c.number("material.static_friction")),
        mu_2_(c.number("material.dynamic_friction")),
        i_0_(c.number("material.inertial_number")),
        diameter_(c.number("grains.diameter")) {}

  Response<State> initial(const InitialState& start) const {
    const SymTensor strain = elasticity_.strain(start.sigma / volume_.cauchy(start.void_ratio));
    return trace(strain) > 0.0 ? loaded(strain, start.void_ratio, 1) : open(0.0);
  }

  Response<State> update(const State& old, const Deformation& step) const {
    const SymTensor before = corotated(old.strain, step.spin, step.dt);
    const SymTensor trial = before + strain_increment(step);
    const SymTensor stress_before =
        trace(before) > 0.0 ? elasticity_.stress(before) : SymTensor::Zero();
    Response<State> r = returned(trial, step);
    if (r.regime != 1)
      r.energies.plastic = volume_.per_mass() *
                           plastic_work(stress_before, r.sigma / volume_.cauchy(step.void_ratio),
                                        trial - r.state.strain);
    r.work = r.energies.stored - 0.5 * volume_.per_mass() * stress_before.dot(before) +
             r.energies.plastic;
    return r;
  }

  Stability stability(const State&, const SymTensor&, double e) const {
    return {elasticity_.p_wave_modulus() * volume_.cauchy(e), 0.0};
  }

  double granular_temperature(const State&) const { return 0.0; }

 private:
  Response<State> returned(const SymTensor& trial, const Deformation& step) const {
    const double a = trace(trial);
    if (a <= 0.0) return open(a);
    const SymTensor dev = deviator(trial);
    const double p = elasticity_.bulk * a,
                 tau = std::numbers::sqrt2 * elasticity_.shear * dev.norm();
    const double excess = tau - mu_s_ * p;
    if (excess <= 0.0) return loaded(trial, step.void_ratio, 1);
    // With x = G gdot dt: (excess - x)(x + x_0) = B x, where B = (mu_2 - mu_s) p and x_0 = I_0 G
    // dt/(d sqrt(rho/p)).
    const double B = (mu_2_ - mu_s_) * p;
    const double x_0 = i_0_ * elasticity_.shear * step.dt / diameter_ *
                       std::sqrt(p * volume_.cauchy(step.void_ratio) / volume_.grain_density);
    const double b = x_0 + B - excess, root = std::sqrt(b * b + 4.0 * excess * x_0);
    const double x = b > 0.0 ? 2.0 * excess * x_0 / (b + root) : 0.5 * (root - b);
    return loaded(trial - x / tau * dev, step.void_ratio, 2);
  }

  Response<State> loaded(const SymTensor& strain, double e, int regime) const {
    Response<State> r;
    r.regime = regime;
    r.state.strain = strain;
    r.sigma = volume_.cauchy(e) * elasticity_.stress(strain);
    r.energies.stored = volume_.per_mass() * elasticity_.energy(strain);
    return r;
  }

  Response<State> open(double a) const {
    Response<State> r;
    r.state.strain = a / 3.0 * identity();
    r.sigma.setZero();
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
