// What a constitutive law is to the solver: a value of constants, a plain State per point, and pure functions.
//
// A law knows no grid, no globals, no files. Each law lives in one file, mpm/materials/<law>.cpp, which ends in
// GRAINPAIR_REGISTER_MATERIAL(Law, "name"). Sign: compression positive, for stress, strain and D.
#pragma once

#include <concepts>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mpm/tensor.hpp"

namespace grainpair {

struct Case;

/// What a point goes through in one step.
struct Deformation {
  SymTensor D;             // rate of deformation, compression positive [1/s]
  Vec3 spin;               // axial vector of W = skew(grad v), so that W a = spin x a [1/s]
  double dt;               // [s]
  double void_ratio_old;   // e at the start and ...
  double void_ratio;       // ... at the end of the step, both from det F [-]
};

/// Energies per unit mass of solid [J/kg]: the first two are held in the new state, the last two were dissipated
/// during the update. sigma_bar : D dt (1+e)/rho_s = d(stored + fluctuation) + plastic + collisional, where
/// sigma_bar is the mean stress `work_stress` the law reports.
struct Energies {
  double stored = 0.0, fluctuation = 0.0;
  double plastic = 0.0, collisional = 0.0;
};

/// Result of an update. `work` is the stress power integrated over the step as the law understands it [J/kg].
template <class State>
struct Response {
  SymTensor sigma;  // total stress, quasi-static + collisional [Pa]
  State state;
  Energies energies;
  double work = 0.0;  // = d(stored + fluctuation) + plastic + collisional to round-off [J/kg]
  int regime = 0;     // 1 visco-elastic, 2 visco-elasto-plastic, 3 critical, 4 collisional; 0 none
};

/// What limits an explicit step at a point.
struct Stability {
  double modulus;    // P-wave modulus, so that c = sqrt(modulus/density) [Pa]
  double viscosity;  // longitudinal viscosity lambda + 4 eta/3 [Pa s]
};

/// The state a point starts from.
struct InitialState {
  SymTensor sigma;             // [Pa]
  double void_ratio;           // [-]
  double granular_temperature; // [m2/s2]
};

template <class M>
concept Material = requires(const M law, const typename M::State s, const Deformation& step,
                            const InitialState& initial, const SymTensor& sigma, double e) {
  { law.initial(initial) } -> std::same_as<Response<typename M::State>>;
  { law.update(s, step) } -> std::same_as<Response<typename M::State>>;
  { law.stability(s, sigma, e) } -> std::same_as<Stability>;
  { law.granular_temperature(s) } -> std::convertible_to<double>;  // 0 where the law has none
};

}  // namespace grainpair
