// What a constitutive law is to the solver: a value of constants, a plain State per point, and pure
// functions.
//
// They are written once over Real, for one point or for several at once (wide.hpp); structs hold
// Reals alone. A law knows no grid, no globals, no files. Each law lives in one file,
// mpm/materials/<law>.cpp, which ends in GRAINPAIR_REGISTER_MATERIAL(Law, "name"). Sign:
// compression positive, for stress, strain and D.
#pragma once

#include <concepts>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mpm/numbers/arrays.hpp"
#include "mpm/numbers/tensor.hpp"

namespace grainpair {

struct Case;

/// What a point goes through in one step.
template <class Real>
struct DeformationOf {
  Tensor<Real> D;                  // rate of deformation, compression positive [1/s]
  Eigen::Matrix<Real, 3, 1> spin;  // axial vector of W = skew(grad v), so that W a = spin x a [1/s]
  Real dt;                         // [s]
  Real void_ratio_old;             // e at the start and ...
  Real void_ratio;                 // ... at the end of the step, both from det F [-]
  Real mixing = 0.0;  // the part of tr D in which nothing flows: voids evened out in a cell [1/s]
};
using Deformation = DeformationOf<double>;

/// Energies per unit mass of solid [J/kg]: stored and fluctuation are held in the new state,
/// plastic, regime_4 and contact (by enduring contacts of grains that flow) were dissipated
/// during the update. sigma_bar : D dt (1+e)/rho_s = d(stored + fluctuation) + plastic +
/// regime_4 + contact, where sigma_bar is the mean stress `work_stress` the law reports.
template <class Real>
struct EnergiesOf {
  Real stored = 0.0, plastic = 0.0;
  Real fluctuation = 0.0, regime_4 = 0.0;
  Real contact = 0.0;
};
using Energies = EnergiesOf<double>;

/// Result of an update. `work` is the stress power integrated over the step as the law understands
/// it [J/kg].
template <class Real, template <class> class State>
struct Response {
  Tensor<Real> sigma;  // total stress, quasi-static + collisional [Pa]
  State<Real> state;
  EnergiesOf<Real> energies;
  Real work = 0.0;                  // = d(stored + fluctuation) + dissipated to round-off [J/kg]
  Real collisional_pressure = 0.0;  // the part of sigma that does no work on `mixing` [Pa]
  Real regime = 0.0;  // 1 visco-elastic, 2 visco-elasto-plastic, 3 critical, 4 collisional; 0 none
};

/// What limits an explicit step at a point.
template <class Real>
struct StabilityOf {
  Real modulus;    // P-wave modulus, so that c = sqrt(modulus/density) [Pa]
  Real viscosity;  // longitudinal viscosity lambda + 4 eta/3 [Pa s]
};
using Stability = StabilityOf<double>;

/// What is zero in a plane: of a tensor, of a struct that begins with one, and of a step.
struct InPlane {
  static constexpr Range tensor{4, 6}, step{4, 8};
};
/// Nothing.
struct InSpace {
  static constexpr Range tensor{}, step{};
};

/// What a law tells of several points after an update.
struct Outcome {
  WideTensor sigma;  // [Pa]
  EnergiesOf<Wide> energies;
  StabilityOf<Wide> stability;
  Wide granular_temperature = 0.0;  // [m2/s2]
  Wide collisional_pressure = 0.0;  // [Pa]
};

/// The state a point starts from.
struct InitialState {
  SymTensor sigma;              // [Pa]
  double void_ratio;            // [-]
  double granular_temperature;  // [m2/s2]
};

/// A law whose grains do not fluctuate.
struct Athermal {
  template <template <class> class State, class Real>
  Real granular_temperature(const State<Real>&) const {
    return 0.0;
  }
};

/// A law that dissipates in contacts that endure while grains flow.
struct WithContacts {};

/// Which energies a law has beside stored and plastic: fluctuation and regime_4, and contact.
/// What it has not is zero, and nobody carries it.
struct Accounts {
  bool fluctuates, contacts;
};

/// What a law does for several points at once.
template <class M>
concept Updates = requires(const M law, const typename M::template State<Wide> s,
                           const DeformationOf<Wide>& step, Wide e) {
  { law.update(s, step) } -> std::same_as<Response<Wide, M::template State>>;
  { law.stability(s, e) } -> std::same_as<StabilityOf<Wide>>;
  { law.granular_temperature(s) } -> std::same_as<Wide>;
};

/// A law whose granular temperature can conduct: `conductivity` [Pa s], so that the flux of energy
/// is -conductivity grad T [W/m2], and what an addition to the fluctuations [J/kg] makes of a
/// state.
template <class M>
concept Conducts = requires(const M law, const typename M::template State<double> s, double x) {
  { law.conductivity(s, x) } -> std::same_as<double>;  // x: void ratio
  { law.heated(s, x) } -> std::same_as<typename M::template State<double>>;
};

template <class M>
concept Material = Updates<M> && requires(const M law, const InitialState& initial) {
  { law.initial(initial) } -> std::same_as<Response<double, M::template State>>;
};

}  // namespace grainpair
