// The seed's model, whole [Ceccato2019]: quasi-static and collisional stress in parallel, sigma =
// sigma_q + sigma_c (Eq. 6), with the energies and the dissipations of both (Eqs. 4, 5); and room
// for the stress of enduring contacts, which is ours.
#pragma once

#include <optional>
#include <type_traits>

#include "mpm/materials/body_of.hpp"
#include "mpm/materials/dormand_prince.hpp"
#include "mpm/materials/kinetic_theory.hpp"
#include "mpm/materials/quasi_static.hpp"
#include "mpm/materials/viscous_spring.hpp"

namespace grainpair {

/// A law beside whose collisions no contacts endure.
struct NoContacts {
  explicit NoContacts(const Case&) {}

  template <class Real>
  struct Memory {};

  template <class Real>
  Memory<Real> followed(const Memory<Real>& old, const DeformationOf<Real>&) const {
    return old;
  }
  template <class Real>
  Real inverse_g(const KineticTheory& gas, const Real& e, const Memory<Real>&) const {
    return gas.inverse_g(e);
  }
};

/// `Contacts` says what enduring contacts add to the collisions: nothing (NoContacts), or, derived
/// from WithContacts, `share(c, memory, dev)`, their shear stress over that of collisions of
/// coefficients c where dev D is `dev`. Their Memory follows the strain (`followed`), and the
/// contact value 1/G of collisions may depend on it (`inverse_g`).
template <class Contacts>
class SolidFluidWith : public Contacts {
 public:
  static constexpr bool regimes_cost_differently = true;
  template <class Real>
  struct State {
    Tensor<Real> strain = Tensor<Real>::Zero();  // as of QuasiStaticState
    // tensors first: among scalars they would need padding, and states are arrays of numbers
    Tensor<Real> viscous = Tensor<Real>::Zero();  // stress of the viscosity, per bulk density
    [[no_unique_address]] typename Contacts::template Memory<Real> memory{};
    Real regime = collisional, secant = 0.0;  // as of QuasiStaticState
    Real speed = 0.0;                         // sqrt(T) [m/s]
    Real viscosity = 0.0;                     // lam + 4 eta/3 [Pa s]
    Real pressing = 0.0;                      // modulus of p_c [Pa]
  };

  explicit SolidFluidWith(const Case& c)
      : Contacts(c), model_(c), gas_(c), spring_(c), collisions_(c.flag("material.collisions")) {
    if (c.word("material.integrator") == "dormand_prince") rates_.emplace(model_);
  }

  Response<double, State> initial(const InitialState& start) const {
    const Deformation still{SymTensor::Zero(), Vec3::Zero(), 0.0, start.void_ratio,
                            start.void_ratio};
    return in_parallel(model_.initial(start.sigma, start.void_ratio), still,
                       collisions_ ? std::sqrt(start.granular_temperature) : 0.0, SymTensor::Zero(),
                       {});
  }

  template <class Real>
  Response<Real, State> update(const State<Real>& old, const DeformationOf<Real>& step) const {
    const QuasiStaticState<Real> turned{corotated(old.strain, step.spin, step.dt), old.regime,
                                        old.secant};
    const Tensor<Real> increment = strain_increment(step);
    return in_parallel(
        rates_ ? (*rates_)(turned, increment, step.void_ratio_old, step.void_ratio)
               : model_.implicit(turned, increment, step.void_ratio_old, step.void_ratio),
        step, old.speed, corotated(old.viscous, step.spin, step.dt),
        Contacts::followed(old.memory, step));
  }

  template <class Real>
  StabilityOf<Real> stability(const State<Real>& state, const Real& e) const {
    const Real modulus =
        model_.modulus(QuasiStaticState<Real>{state.strain, state.regime, state.secant}, e);
    if (spring_.rigid() || !collisions_) return {modulus, state.viscosity};
    return {modulus + spring_.p_wave_modulus() * bulk_density(e) + felt * state.pressing, 0.0};
  }

  template <class Real>
  Real granular_temperature(const State<Real>& state) const {
    return state.speed * state.speed;
  }

  double conductivity(const State<double>& state, double e) const {
    return gas_.parameters.density / (1.0 + e) * gas_.conductivity(e, state.speed);
  }

  /// The state after `energy` has come to its fluctuations [J/kg]; they can not give more than they
  /// hold.
  State<double> heated(State<double> state, double energy) const {
    state.speed = std::sqrt(std::max(0.0, state.speed * state.speed + energy / 1.5));
    return state;
  }

  SymTensor quasi_static_stress(const State<double>& state, double e) const {
    return model_.volume.cauchy(e) * model_.elasticity.stress(state.strain);
  }

 private:
  /// Share of the modulus of p_c that counts in the limit of the step: collisions dissipate what an
  /// unstable step puts into them, and a pressure is the mean of its cell. Without it grains that
  /// are harder than the softened skeleton make energy on fine cells.
  static constexpr double felt = 0.1;

  template <class Real>
  Real bulk_density(const Real& e) const {
    return gas_.parameters.density * (1.0 / (1.0 + e));
  }

  /// sigma = sigma_q + sigma_c [Ceccato2019, Eq. 6] and the energies per mass of both.
  template <class Real>
  Response<Real, State> in_parallel(const QuasiStaticResponse<Real>& q,
                                    const DeformationOf<Real>& step, const Real& old_speed,
                                    const std::type_identity_t<Tensor<Real>>& old_viscous,
                                    const typename Contacts::template Memory<Real>& memory) const {
    const Real e = step.void_ratio;
    const double per_mass = model_.volume.per_mass;
    Response<Real, State> r;
    r.regime = q.state.regime;
    r.sigma = model_.volume.cauchy(e) * q.stress;
    r.state = {q.state.strain, old_viscous, memory, q.state.regime, q.state.secant, old_speed, 0.0};
    r.energies.stored = per_mass * q.stored;
    r.energies.plastic = per_mass * q.dissipated;
    r.work = per_mass * q.work;
    if (collisions_) collide(step, r);
    r.energies.fluctuation =
        1.5 * r.state.speed *
        r.state.speed;  // E_c = 3/2 rho_s T/(1+e) per volume [Ceccato2019, Eq. 11]
    return r;
  }

  /// Adds sigma_c = p_c I + lam tr(D) I + 2 eta dev(D) [Ceccato2019, Eq. 12], its viscous part by
  /// way of the spring, and that of contacts, if any endure; and what they do to the energies.
  template <class Real>
  void collide(const DeformationOf<Real>& step, Response<Real, State>& r) const {
    const auto old = r.state;
    const Real e = step.void_ratio, dt = step.dt;
    // Voids evened out between points are no flow: collisions neither heat by it nor resist it.
    const Real trD = trace(step.D) - step.mixing;
    const Tensor<Real> dev = deviator(step.D);
    const Real gdot2 = 2.0 * dev.squaredNorm();
    const auto c =
        gas_.coefficients(e, Contacts::inverse_g(gas_, e, old.memory), sqrt(gdot2), old.speed);
    Real s = spring_.rigid() ? gas_.advance(c, old.speed, gdot2, trD, dt)
                             : gas_.foreseen(c, old.speed, gdot2, trD, dt);
    Real Y = gas_.softened(c, s);
    const Real eta = c.H * Y * s, lam = c.B * Y * s;  // per bulk density
    Real share = 0.0;
    if constexpr (std::is_base_of_v<WithContacts, Contacts>)
      share = Contacts::share(c, old.memory, dev);
    const auto viscous = spring_.stretched(old.viscous, dev, trD, (1.0 + share) * eta, lam, dt);
    const Real of_contacts = share / (1.0 + share) * viscous.shear_heat;
    Real pressing = 0.0;
    if (!spring_.rigid()) {
      const Real heat = viscous.shear_heat - of_contacts + viscous.bulk_heat;
      s = gas_.heated(c, old.speed, heat, trD, dt, s);
      Y = gas_.softened(c, s);
      pressing = larger(gas_.pressure_modulus(c, old.speed, heat, s, trD, dt), Real(0.0));
    }
    const Real p_c = c.P * Y * s * s, density = bulk_density(e);
    const auto matter = (1.0 + e) * KineticTheory::void_fraction < 1.0;
    const auto if_matter = [&](const Real& a) { return select(matter, a, Real(0.0)); };
    r.collisional_pressure = if_matter(density * (p_c + trace(viscous.stress) * (1.0 / 3)));
    r.sigma = plus_isotropic(r.sigma + if_matter(density) * deviator(viscous.stress),
                             r.collisional_pressure);
    r.state.speed = select(matter, s, old.speed);
    r.state.viscous = select(matter, viscous.stress, old.viscous);
    r.state.viscosity = if_matter(density * (lam + 4.0 / 3.0 * (1.0 + share) * eta));
    r.state.pressing = if_matter(density * pressing);
    r.energies.stored += select(matter, viscous.stored, spring_.stored(old.viscous));
    r.energies.regime_4 = if_matter(dt * c.Q * Y * s * s * s);
    r.energies.contact = if_matter(of_contacts);
    r.work += if_matter(dt * p_c * trD + viscous.work);
  }

  QuasiStatic model_;
  std::optional<DormandPrince> rates_;
  KineticTheory gas_;
  ViscousSpring spring_;
  bool collisions_;
};

}  // namespace grainpair
