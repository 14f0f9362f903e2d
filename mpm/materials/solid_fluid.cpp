// The seed's model, whole [Ceccato2019]: quasi-static and collisional stress in parallel, sigma =
// sigma_q + sigma_c (Eq. 6), with the energies and the dissipations of both (Eqs. 4, 5).
#include <optional>

#include "mpm/body.hpp"
#include "mpm/materials/dormand_prince.hpp"
#include "mpm/materials/kinetic_theory.hpp"
#include "mpm/materials/quasi_static.hpp"

namespace grainpair {
namespace {

class SolidFluid {
 public:
  struct State {
    QuasiStaticState skeleton;
    double speed = 0.0;      // sqrt(T) [m/s]
    double viscosity = 0.0;  // lam + 4 eta/3 [Pa s]
  };

  explicit SolidFluid(const Case& c)
      : model_(c), gas_(c), collisions_(c.flag("material.collisions")) {
    if (c.word("material.integrator") == "dormand_prince") rates_.emplace(model_);
  }

  Response<State> initial(const InitialState& start) const {
    const Deformation still{SymTensor::Zero(), Vec3::Zero(), 0.0, start.void_ratio,
                            start.void_ratio};
    const double speed = collisions_ ? std::sqrt(start.granular_temperature) : 0.0;
    return in_parallel(model_.initial(start.sigma, start.void_ratio), still, SymTensor::Zero(),
                       speed);
  }

  Response<State> update(const State& old, const Deformation& step) const {
    const QuasiStaticState turned{corotated(old.skeleton.strain, step.spin, step.dt),
                                  old.skeleton.regime};
    const SymTensor increment = strain_increment(step);
    return in_parallel(
        rates_ ? (*rates_)(turned, increment, step.void_ratio_old, step.void_ratio)
               : model_.implicit(turned, increment, step.void_ratio_old, step.void_ratio),
        step, increment / step.dt, old.speed);
  }

  Stability stability(const State& state, const SymTensor&, double e) const {
    return {model_.modulus(state.skeleton, e), state.viscosity};
  }

  double granular_temperature(const State& state) const { return state.speed * state.speed; }

  SymTensor quasi_static_stress(const State& state, double e) const {
    return model_.volume.cauchy(e) * model_.elasticity.stress(state.skeleton.strain);
  }

 private:
  /// sigma = sigma_q + sigma_c [Ceccato2019, Eq. 6] and the energies per mass of both; D carries
  /// the volume of det F.
  Response<State> in_parallel(const QuasiStaticResponse& q, const Deformation& step,
                              const SymTensor& D, double old_speed) const {
    const double e = step.void_ratio, per_mass = model_.volume.per_mass();
    Response<State> r;
    r.regime = q.state.regime;
    r.sigma = model_.volume.cauchy(e) * q.stress;
    r.state.skeleton = q.state;
    r.energies.stored = per_mass * q.stored;
    r.energies.plastic = per_mass * q.dissipated;
    r.work = per_mass * q.work;

    double s = old_speed;
    if (collisions_ && (1.0 + e) * KineticTheory::void_fraction < 1.0) {
      const double trD = trace(D), gdot2 = 2.0 * deviator(D).squaredNorm(), dt = step.dt;
      const auto c = gas_.coefficients(e, std::sqrt(gdot2), old_speed);
      s = gas_.advance(c, old_speed, gdot2, trD, dt);
      const double Y = gas_.softened(c, s), density = gas_.parameters.density / (1.0 + e);
      const double p_c = c.P * Y * s * s, eta = c.H * Y * s, lam = c.B * Y * s;  // per bulk density
      // sigma_c = p_c I + lam tr(D) I + 2 eta dev(D) [Ceccato2019, Eq. 12]
      r.sigma += density * ((p_c + lam * trD) * identity() + 2.0 * eta * deviator(D));
      r.state.viscosity = density * (lam + 4.0 / 3.0 * eta);
      r.work += dt * (p_c * trD + lam * trD * trD + eta * gdot2);
      r.energies.collisional = dt * c.Q * Y * s * s * s;
    }
    r.state.speed = s;
    r.energies.fluctuation =
        1.5 * s * s;  // E_c = 3/2 rho_s T/(1+e) per volume [Ceccato2019, Eq. 11]
    return r;
  }

  QuasiStatic model_;
  std::optional<DormandPrince> rates_;
  KineticTheory gas_;
  bool collisions_;
};

GRAINPAIR_REGISTER_MATERIAL(SolidFluid, "solid_fluid")

}  // namespace
}  // namespace grainpair
