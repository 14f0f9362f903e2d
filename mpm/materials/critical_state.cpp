// The quasi-static half of the seed's model alone: critical-state elasto-plasticity, no collisions.
#include <optional>

#include "mpm/materials/body_of.hpp"
#include "mpm/materials/dormand_prince.hpp"
#include "mpm/materials/quasi_static.hpp"

namespace grainpair {
namespace {

class CriticalStatePlasticity : public Athermal {
 public:
  static constexpr bool regimes_cost_differently = true;
  template <class Real>
  using State = QuasiStaticState<Real>;

  explicit CriticalStatePlasticity(const Case& c) : model_(c) {
    if (c.word("material.integrator") == "dormand_prince") rates_.emplace(model_);
  }

  Response<double, State> initial(const InitialState& start) const {
    return respond(model_.initial(start.sigma, start.void_ratio), start.void_ratio);
  }

  template <class Real>
  Response<Real, State> update(const State<Real>& old, const DeformationOf<Real>& step) const {
    const State<Real> turned{corotated(old.strain, step.spin, step.dt), old.regime, old.secant};
    const Tensor<Real> increment = strain_increment(step);
    return respond(rates_
                       ? (*rates_)(turned, increment, step.void_ratio_old, step.void_ratio)
                       : model_.implicit(turned, increment, step.void_ratio_old, step.void_ratio),
                   step.void_ratio);
  }

  template <class Real>
  StabilityOf<Real> stability(const State<Real>& state, const Real& e) const {
    return {model_.modulus(state, e), 0.0};
  }

 private:
  template <class Real>
  Response<Real, State> respond(const QuasiStaticResponse<Real>& q, const Real& e) const {
    const double per_mass = model_.volume.per_mass;
    Response<Real, State> r;
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
