// The quasi-static half of the seed's model: hyperelasticity, the Lade-Duncan cone, the
// critical-state locus, and the regimes between them [Ceccato2019, sections 2.1 and 2.3].
//
//   1 visco-elastic         f < 0, or unloading from f = 0
//   2 visco-elasto-plastic  f = 0, G_1 != 0: flow with the dilatancy of the state
//   3 critical              f = G_1 = 0, e < e_c: extended consistency, p stays p_cs(e); the
//                           plastic volumetric strain is the total less the elastic
//   4 collisional           no quasi-static stress
//   0                       no quasi-static stress either, but torn open while denser than e_c:
//                           shear dilates it, so that contact comes back
//
// 2 -> 3 when G_1 changes sign; 3 -> 4 when e reaches e_c; 1, 2 -> 4 (e < e_c: 0) when the pressure
// is used up; 3 -> 1 on unloading; 4 -> 1 or 3 when a point is compressed below e_c, where it
// starts from zero stress; 0 -> 1 or 2 where contact is back.
// DEVIATION: where following p_cs(e) would take more plastic dilation than the bound of the
// dilatancy, the flow is at that bound and p lags behind p_cs(e) until it has caught up. The locus
// is stiffer than the skeleton (K_cs > K), so that following it at any rate would create energy.
#pragma once

#include "mpm/materials/critical_state.hpp"
#include "mpm/materials/kinematics.hpp"
#include "mpm/materials/lade_duncan.hpp"
#include "mpm/materials/solid_volume.hpp"

namespace grainpair {

inline constexpr double no_regime = 0.0, visco_elastic = 1.0, visco_plastic = 2.0, critical = 3.0,
                        collisional = 4.0;

template <class Real>
struct QuasiStaticState {
  Tensor<Real> strain = Tensor<Real>::Zero();  // elastic; trace a = 0 at zero stress, < 0 when open
  Real regime = collisional;
  Real secant = 0.0;  // P0/u at that strain, which costs a power [Pa]; 0: not told, or open
};

/// Stress tau (solid_volume.hpp) and energies per reference volume.
template <class Real>
struct QuasiStaticResponse {
  QuasiStaticState<Real> state;
  Tensor<Real> stress;    // [Pa]
  Real stored = 0.0;      // [J/m3]
  Real dissipated = 0.0;  // [J/m3]
  Real work = 0.0;        // [J/m3]
};

template <class Real>
QuasiStaticResponse<Real> select(const Mask<Real>& m, const QuasiStaticResponse<Real>& yes,
                                 const QuasiStaticResponse<Real>& no) {
  return {
      {select(m, yes.state.strain, no.state.strain), select(m, yes.state.regime, no.state.regime),
       select(m, yes.state.secant, no.state.secant)},
      select(m, yes.stress, no.stress),
      select(m, yes.stored, no.stored),
      select(m, yes.dissipated, no.dissipated),
      select(m, yes.work, no.work)};
}

class QuasiStatic {
 public:
  explicit QuasiStatic(const Case& c) : elasticity(c), cone(c), locus(c), volume(c) {}
  QuasiStatic(const Hyperelastic& h, const LadeDuncan& f, const CriticalState& g,
              const SolidVolume& v)
      : elasticity(h), cone(f), locus(g), volume(v) {}

  /// The state at a given Cauchy stress; outside the cone, the nearest one on it.
  QuasiStaticResponse<double> initial(const SymTensor& sigma, double e) const {
    if (trace(sigma) <= 0.0) return open(0.0, e);
    const SymTensor strain = elasticity.strain(sigma / volume.cauchy(e)), dev = deviator(strain);
    if (holds(strain)) return loaded(strain, visco_elastic);
    return loaded(joined(cone.along_flow(elasticity, dev, trace(strain), 0.0)), visco_plastic);
  }

  /// One step by the closed form of the elastic strain and the return to the cone: backward Euler.
  template <class Real>
  QuasiStaticResponse<Real> implicit(const QuasiStaticState<Real>& old,
                                     const std::type_identity_t<Tensor<Real>>& increment,
                                     const std::type_identity_t<Real>& e_old,
                                     const std::type_identity_t<Real>& e) const {
    const auto loose = e >= locus.e_c, gas = old.regime == collisional && loose;
    if (all(gas)) return open(Real(0.0), e);
    const auto before = elasticity.evaluate(old.strain, secant(old));
    const Tensor<Real> trial = tried(old, increment, e);
    const Real a = trace(trial);
    const auto flows = !gas && !(a <= 0.0) && !holds(trial);
    auto stressless = gas || a <= 0.0;

    Tensor<Real> strain = trial;
    Real regime = select(flows, Real(visco_plastic), Real(visco_elastic));
    if (any(flows)) {
      const Tensor<Real> dev = deviator(trial);
      // with the dilatancy of the state, up to the critical-state locus
      const auto off_locus = flows && old.regime != critical && old.regime != collisional;
      auto arrived = flows;
      if (any(off_locus)) {
        const Real p = trace(before.stress) / 3.0 * volume.cauchy(e_old);
        const auto back = cone.along_flow(elasticity, dev, a, locus.flow_ratio(e, p), off_locus);
        strain = select(off_locus, joined(back), strain);
        const Real p_new = trace(elasticity.stress(strain)) / 3.0 * volume.cauchy(e);
        const auto crossed = (p - locus.pressure(e_old)) * (p_new - locus.pressure(e)) < 0.0;
        arrived = flows && !(off_locus && back.volumetric > 0.0 && !crossed);
      }
      stressless = stressless || (arrived && loose);
      // on the locus, or on the way to it
      const auto dense = arrived && !loose;
      if (any(dense)) {
        auto at = cone.at_pressure(elasticity, dev, locus.pressure(e) / volume.cauchy(e), dense);
        const auto lags = dense && (at.multiplier < 0.0 ||
                                    a - at.volumetric < -locus.largest_ratio * at.multiplier);
        if (any(lags))
          at = select<Real>(lags, cone.along_flow(elasticity, dev, a, -locus.largest_ratio, lags),
                            at);
        strain = select(dense, joined(at), strain);
        regime = select(dense, Real(critical), regime);
      }
    }
    const auto now = elasticity.evaluate(strain);
    QuasiStaticResponse<Real> r{{strain, regime, now.secant}, now.stress, now.energy};
    const Tensor<Real> plastic = trial - strain;
    r.dissipated = select(
        flows, plastic_work<Real>(before.stress.dot(plastic), now.stress.dot(plastic)), Real(0.0));
    r.work = r.stored - before.energy + r.dissipated;
    return any(stressless) ? select(stressless, released(before, increment, a, e), r) : r;
  }

  /// Whether an elastic strain of positive volume lies in the cone.
  template <class T>
  Mask<typename T::Scalar> holds(const T& strain) const {
    return cone.holds(elasticity.coupling / trace(strain) * deviator(strain));
  }

  QuasiStaticResponse<double> loaded(const SymTensor& strain, double regime) const {
    const auto now = elasticity.evaluate(strain);
    return {{strain, regime, now.secant}, now.stress, now.energy};
  }

  /// Without stress. At e >= e_c contact comes back at e_c; below, where it was lost, at the strain
  /// a = 0.
  template <class Real>
  QuasiStaticResponse<Real> open(const Real& a, const Real& e) const {
    const auto loose = e >= locus.e_c;
    const Real gap = select(loose, volumetric_strain(Real(locus.e_c), e), smaller(a, Real(0.0)));
    return {{isotropic(gap * (1.0 / 3)), select(loose, Real(collisional), Real(no_regime))},
            Tensor<Real>::Zero()};
  }

  /// P-wave modulus: the elastic one, and in the critical regime that of the locus, K_cs sigma_1/p,
  /// with the elastic shear stiffness [Pa].
  template <class Real>
  Real modulus(const QuasiStaticState<Real>& state, const Real& e) const {
    const Real P0_u = secant(state);
    const Real elastic = volume.cauchy(e) * elasticity.p_wave_modulus(state.strain, P0_u);
    const auto on_locus = state.regime == critical;
    if (!any(on_locus)) return elastic;
    const Real a = trace(state.strain), e2 = deviator(state.strain).squaredNorm();
    const double c = elasticity.coupling;
    const Real shear = volume.cauchy(e) * (elasticity.g / elasticity.kn) * P0_u;
    const Real followed =
        locus.modulus(e) * (1.0 + c * sqrt(2.0 / 3.0 * e2) / a) + 4.0 / 3.0 * shear;
    return select(on_locus, larger(elastic, followed), elastic);
  }

  Hyperelastic elasticity;
  LadeDuncan cone;
  CriticalState locus;
  SolidVolume volume;

 private:
  /// P0/u at a state's strain, 0 where that has opened [Pa].
  template <class Real>
  Real secant(const QuasiStaticState<Real>& state) const {
    const auto open = trace(state.strain) <= 0.0;
    if (all(open || state.secant > 0.0)) return select(open, Real(0.0), state.secant);
    return elasticity.evaluate(state.strain).secant;
  }

  /// The elastic strain if nothing flowed. A point without stress strains elastically only while it
  /// is in contact.
  template <class Real>
  Tensor<Real> tried(const QuasiStaticState<Real>& old, const Tensor<Real>& increment,
                     const Real& e) const {
    Tensor<Real> whole = old.strain + increment;
    const Real gap = -trace(old.strain);
    const auto apart = gap >= 0.0;
    if (!any(apart)) return whole;
    const Tensor<Real> shear = deviator(increment);
    const auto dilates = apart && old.regime == no_regime && e < locus.e_c;
    const Real ratio = select(dilates, locus.flow_ratio(e, Real(0.0)), Real(0.0));
    const Tensor<Real> trial = plus_isotropic(whole, ratio * shear.norm() * (-1.0 / 3));
    const Real a = trace(trial);
    const Real waited =
        select(apart && a > 0.0, gap / (a + gap), Real(0.0));  // part of the step before contact
    return trial - waited * shear;
  }

  /// The step that takes all stress away: what was stored is dissipated, less what the stress gave
  /// back as work.
  template <class Real>
  QuasiStaticResponse<Real> released(const Hyperelastic::Loaded<Tensor<Real>>& before,
                                     const Tensor<Real>& increment, const Real& a,
                                     const Real& e) const {
    QuasiStaticResponse<Real> r = open(a, e);
    r.work = releasing_work(before.stress, increment, before.energy);
    r.dissipated = before.energy + r.work;
    return r;
  }

  template <class T>
  static T joined(const ConeReturn<T>& back) {
    return plus_isotropic(back.deviatoric, back.volumetric * (1.0 / 3));
  }
};

}  // namespace grainpair
