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

#include <cstdint>

#include "mpm/materials/critical_state.hpp"
#include "mpm/materials/kinematics.hpp"
#include "mpm/materials/lade_duncan.hpp"
#include "mpm/materials/solid_volume.hpp"

namespace grainpair {

enum Regime : std::uint8_t {
  no_regime = 0,
  visco_elastic = 1,
  visco_plastic = 2,
  critical = 3,
  collisional = 4
};

struct QuasiStaticState {
  SymTensor strain = SymTensor::Zero();  // elastic; trace a = 0 at zero stress, < 0 when open
  Regime regime = collisional;
};

/// Stress tau (solid_volume.hpp) and energies per reference volume.
struct QuasiStaticResponse {
  QuasiStaticState state;
  SymTensor stress;         // [Pa]
  double stored = 0.0;      // [J/m3]
  double dissipated = 0.0;  // [J/m3]
  double work = 0.0;        // [J/m3]
};

class QuasiStatic {
 public:
  explicit QuasiStatic(const Case& c) : elasticity(c), cone(c), locus(c), volume(c) {}
  QuasiStatic(const Hyperelastic& h, const LadeDuncan& f, const CriticalState& g,
              const SolidVolume& v)
      : elasticity(h), cone(f), locus(g), volume(v) {}

  /// The state at a given Cauchy stress; outside the cone, the nearest one on it.
  QuasiStaticResponse initial(const SymTensor& sigma, double e) const {
    if (trace(sigma) <= 0.0) return open(0.0, e);
    const SymTensor strain = elasticity.strain(sigma / volume.cauchy(e)), dev = deviator(strain);
    if (holds(strain)) return loaded(strain, visco_elastic);
    return loaded(joined(cone.along_flow(elasticity, dev, trace(strain), 0.0)), visco_plastic);
  }

  /// One step by the closed form of the elastic strain and the return to the cone: backward Euler.
  QuasiStaticResponse implicit(const QuasiStaticState& old, const SymTensor& increment,
                               double e_old, double e) const {
    if (old.regime == collisional && e >= locus.e_c) return open(0.0, e);
    const auto before = elasticity.evaluate(old.strain);
    SymTensor trial = old.strain + increment;
    if (const double gap = -trace(old.strain); gap >= 0.0) {  // without stress
      if (old.regime == no_regime && e < locus.e_c)
        trial -= locus.flow_ratio(e, 0.0) * deviator(increment).norm() / 3.0 * identity();
      if (const double a = trace(trial); a > 0.0)  // in contact for the last part of the step
        trial -= gap / (a + gap) * deviator(increment);
    }
    if (trace(trial) <= 0.0) return released(before, increment, trace(trial), e);
    if (holds(trial)) {
      QuasiStaticResponse r = loaded(trial, visco_elastic);
      r.work = r.stored - before.energy;
      return r;
    }
    const double p = trace(before.stress) / 3.0 * volume.cauchy(e_old);
    const SymTensor dev = deviator(trial);
    if (old.regime != critical && old.regime != collisional) {
      const ConeReturn back =
          cone.along_flow(elasticity, dev, trace(trial), locus.flow_ratio(e, p));
      if (back.volumetric > 0.0) {
        const SymTensor strain = joined(back);
        const QuasiStaticResponse r = dissipating(before, trial, loaded(strain, visco_plastic));
        const double p_new = trace(r.stress) / 3.0 * volume.cauchy(e);
        const bool crossed = (p - locus.pressure(e_old)) * (p_new - locus.pressure(e)) < 0.0;
        if (!crossed) return r;
      }
    }
    // on the critical-state locus, or on the way to it
    if (e >= locus.e_c) return released(before, increment, 0.0, e);
    ConeReturn back = cone.at_pressure(elasticity, dev, locus.pressure(e) / volume.cauchy(e));
    const double plastic_volume = trace(trial) - back.volumetric;
    if (back.multiplier < 0.0 || plastic_volume < -locus.largest_ratio * back.multiplier)
      back = cone.along_flow(elasticity, dev, trace(trial), -locus.largest_ratio);
    return dissipating(before, trial, loaded(joined(back), critical));
  }

  /// Whether an elastic strain of positive volume lies in the cone.
  bool holds(const SymTensor& strain) const {
    return cone.holds(elasticity.coupling / trace(strain) * deviator(strain));
  }

  QuasiStaticResponse loaded(const SymTensor& strain, Regime regime) const {
    const auto now = elasticity.evaluate(strain);
    return {{strain, regime}, now.stress, now.energy, 0.0, 0.0};
  }

  /// Without stress. At e >= e_c contact comes back at e_c; below, where it was lost, at the strain
  /// a = 0.
  QuasiStaticResponse open(double a, double e) const {
    const double gap = e >= locus.e_c ? volumetric_strain(locus.e_c, e) : std::min(a, 0.0);
    return {{gap / 3.0 * identity(), e >= locus.e_c ? collisional : no_regime},
            SymTensor::Zero(),
            0.0,
            0.0,
            0.0};
  }

  /// The step that takes all stress away: what was stored is dissipated, less what the stress gave
  /// back as work.
  QuasiStaticResponse released(const Hyperelastic::Loaded& before, const SymTensor& increment,
                               double a, double e) const {
    QuasiStaticResponse r = open(a, e);
    r.work = releasing_work(before.stress, increment, before.energy);
    r.dissipated = before.energy + r.work;
    return r;
  }

  /// P-wave modulus: the elastic one, and in the critical regime that of the locus, K_cs sigma_1/p,
  /// with the elastic shear stiffness [Pa].
  double modulus(const QuasiStaticState& state, double e) const {
    const double elastic = volume.cauchy(e) * elasticity.p_wave_modulus(state.strain);
    if (state.regime != critical) return elastic;
    const double a = trace(state.strain), e2 = deviator(state.strain).squaredNorm(),
                 c = elasticity.coupling;
    const double u = std::sqrt(a * a + c * e2);
    const double shear =
        volume.cauchy(e) * elasticity.g * elasticity.reference_pressure(u) / (elasticity.kn * u);
    return std::max(
        elastic, locus.modulus(e) * (1.0 + c * std::sqrt(2.0 / 3.0 * e2) / a) + 4.0 / 3.0 * shear);
  }

  Hyperelastic elasticity;
  LadeDuncan cone;
  CriticalState locus;
  SolidVolume volume;

 private:
  static SymTensor joined(const ConeReturn& back) {
    return back.deviatoric + back.volumetric / 3.0 * identity();
  }
  static QuasiStaticResponse dissipating(const Hyperelastic::Loaded& before, const SymTensor& trial,
                                         QuasiStaticResponse r) {
    r.dissipated = plastic_work(before.stress, r.stress, trial - r.state.strain);
    r.work = r.stored - before.energy + r.dissipated;
    return r;
  }
};

}  // namespace grainpair
