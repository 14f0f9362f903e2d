// The quasi-static half of the seed's model alone: critical-state elasto-plasticity, no collisions.
#include <optional>

#include "mpm/body.hpp"
#include "mpm/materials/dormand_prince.hpp"
#include "mpm/materials/quasi_static.hpp"

namespace grainpair {
namespace {

class CriticalStatePlasticity {
 public:
  using State = QuasiStaticState;

  explicit CriticalStatePlasticity(const Case& c) : model_(c) {
    if (c.word("material.integrator") == "dormand_prince") rates_.emplace(model_);
  }

  Response<State> initial(const InitialState& start) const {
    return respond(model_.initial(start.sigma, start.void_ratio), start.void_ratio);
  }

  Response<State> update(const State& old, const Deformation& step) const {
    const State turned{corotated(old.strain, step.spin, step.dt), old.regime};
    const SymTensor increment = strain_increment(step);
    return respond(rates_
                       ? (*rates_)(turned, increment, step.void_ratio_old, step.void_ratio)
                       : model_.implicit(turned, increment, step.void_ratio_old, step.void_ratio),
                   step.void_ratio);
  }

  Stability stability(const State& state, const SymTensor&, double e) const {
    return {model_.modulus(state, e), 0.0};
  }

  double granular_temperature(const State&) const { return 0.0; }

 private:
  Response<State> respond(const QuasiStaticResponse& q, double e) const {
    const double per_mass = model_.volume.per_mass();
    Response<State> r;
    r.sigma = model_.volume.cauchy(e) * q.stress;
    r.state = q.state;
    r.energies.stored = per_mass * q.stored;
    r.energies.plastic = per_mass * q.dissipated;
    r.work = per_mass * q.work;
    r.regime = q.state.regime;
    return r;
  }

  QuasiStatic model_;
  std::optional<DormandPrince> rates_;
};

GRAINPAIR_REGISTER_MATERIAL(CriticalStatePlasticity, "critical_state")

}  // namespace
}  // namespace grainpair
