// Collisional stress, dissipation and granular temperature: kinetic theory of inelastic spheres
// [Garzo1999], with a correlation length [Berzi2014, Jenkins2007, or ours] and the softness of the
// grains [Berzi2015].
//
// With nu = 1/(1+e), G = nu g0, Y = 1/(1/G + kap sqrt(T)) and kap = 24/(5 sqrt(pi)) sqrt(rho/E):
//     F = (1+en)/2 + 1/(4G)
//     J = (1+en)/2 + pi/32 [5 + 2(1+en)(3en-1)G][5 + 4(1+en)G]/{[24 - 6(1-en)^2 - 5(1-en^2)]G^2}
//     p_c = 4 F nu rho Y T
//     eta = 8 J nu rho d Y sqrt(T)/(5 sqrt(pi))
//     lam = 4(1+en) nu rho d Y sqrt(T)/(3 sqrt(pi))
//     sigma_c = p_c I + lam tr(D) I + 2 eta dev(D)  [Ceccato2019, Eq. 12]
//     Gamma_c = 12/sqrt(pi) (1 - ee^2) nu rho Y T^(3/2)/L
//     M = (1+en)/2 + pi/16 [5 + 3(1+en)^2(2en-1)G][5 + 6(1+en)G]/{(1+en)[16 - 7(1-en)]G^2}
//     kappa = 4 M nu rho d Y sqrt(T)/sqrt(pi), with the flux -kappa grad T [Garzo1999, without the
//     part of grad nu]
// G is infinite at e <= e_c, so 1/G is what is carried. Coefficients here are per unit of bulk
// density nu rho.
#pragma once

#include <cmath>
#include <numbers>

#include "mpm/materials/grains.hpp"
#include "mpm/numbers/tensor.hpp"

namespace grainpair {

class KineticTheory {
 public:
  enum class Correlation { berzi, jenkins, softened, none };

  struct Parameters {
    double diameter, density, young_modulus;  // d [m], rho [kg/m3], E [Pa]
    double restitution, effective_restitution;
    double critical_void_ratio, loose_void_ratio;
    double collision_time_factor = 1.0, correlation_factor = 1.0, correlation_onset = 7.0;
    Correlation correlation = Correlation::berzi;
    bool bulk_viscosity = true;
    bool explicit_temperature = false;
  };

  /// Per bulk density: p_c = P Y T, eta = H Y s, lam = B Y s, Gamma_c = Q Y s^3, where s = sqrt(T).
  template <class Real>
  struct Coefficients {
    Real inverse_g;  // 1/G
    Real P;          // [-]
    Real H, B;       // [m]
    Real Q;          // [1/m]
    Real length;     // L/d
  };

  explicit KineticTheory(const Case& c)
      : KineticTheory(Parameters{
            c.number("grains.diameter"), c.number("grains.density"), young_modulus_of_grains(c),
            c.number("grains.restitution"), c.number("material.effective_restitution"),
            c.number("material.critical_void_ratio"), c.number("material.loose_void_ratio"),
            c.number("material.collision_time_factor"), c.number("material.correlation_factor"),
            c.number("material.correlation_onset"),
            correlation(c.word("material.correlation_length")), c.flag("material.bulk_viscosity"),
            c.word("material.temperature_update") == "explicit"}) {}

  explicit KineticTheory(const Parameters& given)
      : parameters(given),
        kap(24.0 / (5.0 * root_pi) * std::sqrt(given.density / given.young_modulus) *
            given.collision_time_factor),
        hardness_(kap / given.collision_time_factor),
        nu_c_(1.0 / (1.0 + given.critical_void_ratio)),
        nu_m_(1.0 / (1.0 + given.loose_void_ratio)) {
    const double en = given.restitution, ee = given.effective_restitution;
    en1_ = 1.0 + en;
    shear_ = 24.0 - 6.0 * (1.0 - en) * (1.0 - en) - 5.0 * (1.0 - en * en);
    loss_ = 1.0 - ee * ee;
    crowding_ = 26.0 * (1.0 - ee) / 15.0;
  }

  /// 1/G = (nu_c - nu)/(nu [(nu_c - nu)(1 - w) CS + 2 w]), w = ((nu - nu_m)/(nu_c - nu_m))^2
  /// between nu_m and nu_c, CS = (2 - nu)/(2 (1 - nu)^3): Carnahan-Starling below nu_m, and the
  /// pole at nu_c.
  template <class Real>
  Real inverse_g(const Real& e) const {
    return inverse_g(e, nu_c_);
  }
  /// The same with the pole at the solid fraction `pole` in place of nu_c.
  template <class Real>
  Real inverse_g(const Real& e, double pole) const {
    const Real nu = 1.0 / (1.0 + e), gap = pole - nu;
    const Real root = larger(nu - nu_m_, Real(0.0)) * (1.0 / (pole - nu_m_)), w = root * root;
    // CS = above/below
    const Real above = 2.0 - nu, below = 2.0 * (1.0 - nu) * (1.0 - nu) * (1.0 - nu);
    const Real inverse = gap * below / (nu * (gap * (1.0 - w) * above + 2.0 * w * below));
    return select(gap <= 0.0, Real(0.0), inverse);
  }

  template <class Real>
  Real F(const Real& inverse) const {
    return 0.5 * en1_ + 0.25 * inverse;
  }
  template <class Real>
  Real J(const Real& inverse) const {
    return 0.5 * en1_ + std::numbers::pi / 32.0 / shear_ *
                            (5.0 * inverse + 2.0 * en1_ * (3.0 * en1_ - 4.0)) *
                            (5.0 * inverse + 4.0 * en1_);
  }

  template <class Real>
  Real M(const Real& inverse) const {
    const double en = parameters.restitution;
    return 0.5 * en1_ + std::numbers::pi / 16.0 / (en1_ * (16.0 - 7.0 * (1.0 - en))) *
                            (5.0 * inverse + 3.0 * en1_ * en1_ * (2.0 * en - 1.0)) *
                            (5.0 * inverse + 6.0 * en1_);
  }

  /// L/d: max{1, sqrt(2J/(15(1-ee^2))) [1 + 26(1-ee)/15 (nu - 0.49)/(nu_rcp - nu)]^(3/2)} above nu
  /// = 0.49 [Berzi2014], or max{1, G^(1/3)/4 d gdot/sqrt(T)} capped at 10 [Jenkins2007], or
  /// (Y_L/Y_0)^(1/3) between 1 and 30, Y_L = 1/(1/G + kap sqrt(T)) without the collision-time
  /// factor (`softened`); 1 for `none`.
  template <class Real>
  Real correlation_length(const Real& e, const Real& shear_rate, const Real& s) const {
    return correlation_length(e, inverse_g(e), J(inverse_g(e)), shear_rate, s);
  }

  template <class Real>
  Coefficients<Real> coefficients(const Real& e, const Real& shear_rate, const Real& s) const {
    return coefficients(e, inverse_g(e), shear_rate, s);
  }
  /// The same at 1/G = i.
  template <class Real>
  Coefficients<Real> coefficients(const Real& e, const Real& i, const Real& shear_rate,
                                  const Real& s) const {
    const double d = parameters.diameter;
    const Real j = J(i);
    const Real length = correlation_length(e, i, j, shear_rate, s);
    return {i,
            4.0 * F(i),
            8.0 * d / (5.0 * root_pi) * j,
            parameters.bulk_viscosity ? 4.0 * en1_ * d / (3.0 * root_pi) : 0.0,
            12.0 * loss_ / (root_pi * d) / length,
            length};
  }

  /// kappa per bulk density at s = sqrt(T) [m2/s]
  template <class Real>
  Real conductivity(const Real& e, const Real& s) const {
    const Real i = inverse_g(e), y = i + kap * s;
    return 4.0 * parameters.diameter / root_pi * M(i) * select(y > 0.0, s / y, Real(0.0));
  }

  /// Y = 1/(1/G + kap s)
  template <class Real>
  Real softened(const Coefficients<Real>& c, const Real& s) const {
    const Real y = c.inverse_g + kap * s;
    return select(y > 0.0, 1.0 / y, Real(0.0));
  }

  /// sqrt(T) at the end of a step. Backward Euler on (3/2) rho nu T_dot = sigma_c : D - Gamma_c,
  /// times 1/Y:
  ///     (3/2 kap + dt Q) s^3 + (3/2 /G - dt P trD) s^2
  ///       - (3/2 kap T_old + dt (H gdot^2 + B trD^2)) s - 3/2 T_old/G = 0 .
  /// The step's energies balance.
  template <class Real>
  Real advance(const Coefficients<Real>& c, const Real& s_old, const Real& shear_rate2,
               const Real& trD, const Real& dt) const {
    return advanced(c, s_old, shear_rate2, trD, dt, to_the_last);
  }
  /// The same to the square of its change, for coefficients that are taken there.
  template <class Real>
  Real foreseen(const Coefficients<Real>& c, const Real& s_old, const Real& shear_rate2,
                const Real& trD, const Real& dt) const {
    return advanced(c, s_old, shear_rate2, trD, dt, roughly);
  }

  /// The same where the viscous stress has heated by `heat` [J/kg], sought from `near`:
  ///     (3/2 kap + dt Q) s^3 + (3/2 /G - dt P trD) s^2 - (kap s + 1/G)(3/2 T_old + heat) = 0 .
  template <class Real>
  Real heated(const Coefficients<Real>& c, const Real& s_old, const Real& heat, const Real& trD,
              const Real& dt, const Real& near) const {
    if (parameters.explicit_temperature) return forward(c, s_old, heat, trD, dt);
    const Real held = 1.5 * s_old * s_old + heat;
    return ended(c, near, trD, dt, -kap * held, -c.inverse_g * held, to_the_last);
  }

  /// dp_c/d(strain) over a step of `heated` that ends at s, per bulk density [m2/s2]. With
  /// p_c = P Y s^2, ds from the cubic, and nu d(1/G)/dnu = -1/2, what it is at the pole (0 at e_c):
  ///     P Y s [s + s Y/2 + (2 - kap Y s) ds],   held = 3/2 T_old + heat,
  ///     ds = [P s^2 - (held - 3/2 s^2)/2] s
  ///          /[(3 kap + 2 dt Q) s^3 + (3/2 /G - dt P trD) s^2 + held/G] .
  template <class Real>
  Real pressure_modulus(const Coefficients<Real>& c, const Real& s_old, const Real& heat,
                        const Real& s, const Real& trD, const Real& dt) const {
    const Real held = 1.5 * s_old * s_old + heat, T = s * s, Y = softened(c, s);
    const Real half = select(c.inverse_g > 0.0, Real(0.5), Real(0.0));
    const Real steep = ((3.0 * kap + 2.0 * dt * c.Q) * s + 1.5 * c.inverse_g - dt * c.P * trD) * T +
                       c.inverse_g * held;
    const Real rise = (c.P * T - half * (held - 1.5 * T)) * s;
    const Real ds = select(steep > 0.0, rise / steep, Real(0.0));
    return c.P * Y * s * (s + half * Y * s + (2.0 - kap * Y * s) * ds);
  }

  /// Below this solid fraction a point is empty space: no collisional stress [-].
  static constexpr double void_fraction = 1e-4;
  /// Random close packing of frictionless spheres and the packing above which velocities correlate
  /// [Berzi2014].
  static constexpr double nu_rcp = 0.636, nu_correlated = 0.49;
  static constexpr double root_pi = 1.77245385090551602730;

  Parameters parameters;
  double kap;  // [s/m]

 private:
  /// Forward Euler: NaN where the step overshoots zero.
  template <class Real>
  Real forward(const Coefficients<Real>& c, const Real& s, const Real& heat, const Real& trD,
               const Real& dt) const {
    const Real t = s * s, collisions = softened(c, s) * t * (c.P * trD - c.Q * s);
    return sqrt(t + (heat + dt * collisions) / 1.5);
  }

  /// Newton converges quadratically: after a change of 1e-8 what is left is below round-off, after
  /// one of a tenth it is a hundredth.
  static constexpr double to_the_last = 1e-8, roughly = 0.1;

  template <class Real>
  Real advanced(const Coefficients<Real>& c, const Real& s_old, const Real& shear_rate2,
                const Real& trD, const Real& dt, double enough) const {
    const Real t_old = s_old * s_old, viscous = c.H * shear_rate2 + c.B * trD * trD;
    if (parameters.explicit_temperature)
      return forward(c, s_old, dt * viscous * s_old * softened(c, s_old), trD, dt);
    return ended(c, s_old, trD, dt, -(1.5 * kap * t_old + dt * viscous), -1.5 * c.inverse_g * t_old,
                 enough);
  }

  /// The positive root of (3/2 kap + dt Q) s^3 + (3/2 /G - dt P trD) s^2 + c1 s + c0, until it
  /// changes by no more than `enough` of it. The signs (+, any, -, -) leave exactly one, for any
  /// step.
  template <class Real>
  Real ended(const Coefficients<Real>& c, const Real& near, const Real& trD, const Real& dt,
             const Real& c1, const Real& c0, double enough) const {
    const Real c3 = 1.5 * kap + dt * c.Q, c2 = 1.5 * c.inverse_g - dt * c.P * trD;
    const auto at_rest = c1 == 0.0 && c0 == 0.0;  // and cold
    // The cubic is convex to the right of its positive root, so Newton from there descends to it.
    // From nearby too, where the cubic rises and curves upwards: its first step goes past the root.
    const auto descends =
        3.0 * c3 * near + c2 > 0.0 && (3.0 * c3 * near + 2.0 * c2) * near + 2.0 * c1 > 0.0;
    Real s = near;
    if (!all(descends)) {
      const Real cold = any(c0 != 0.0) ? cube_root(-3.0 * c0 / c3) : Real(0.0);
      const Real bound =
          larger(larger(3.0 * larger(-c2, Real(0.0)) / c3, sqrt(-3.0 * c1 / c3)), cold);
      s = select(descends, near, bound);
    }
    Mask<Real> pending = !at_rest;
    for (int i = 0; i < 100 && any(pending); ++i) {
      const Real change =
          (((c3 * s + c2) * s + c1) * s + c0) / ((3.0 * c3 * s + 2.0 * c2) * s + c1);
      s = select(pending, s - change, s);
      pending = pending && abs(change) > enough * s;
    }
    return select(at_rest, Real(0.0), s);
  }

  static constexpr double longest = 30.0;  // of the softened correlation length, in d

  static Correlation correlation(const std::string& word) {
    return word == "berzi"      ? Correlation::berzi
           : word == "jenkins"  ? Correlation::jenkins
           : word == "softened" ? Correlation::softened
                                : Correlation::none;
  }

  template <class Real>
  Real correlation_length(const Real& e, const Real& inverse, const Real& j, const Real& shear_rate,
                          const Real& s) const {
    Real length = 1.0;
    if (parameters.correlation == Correlation::berzi && loss_ > 0.0) {
      const Real nu = 1.0 / (1.0 + e);
      const Real x = 1.0 + crowding_ * (nu - nu_correlated) / larger(nu_rcp - nu, Real(1e-3));
      length = select(nu > nu_correlated, sqrt(2.0 / (15.0 * loss_) * j * x) * x, length);
    } else if (parameters.correlation == Correlation::jenkins) {
      constexpr double cap = 10.0;
      // length <= cap wherever d gdot/4 <= cap G^(-1/3) s
      const Real pull = 0.25 * parameters.diameter * shear_rate;
      const Real room = s * cube_root(inverse);
      length = select(shear_rate > 0.0, select(pull < cap * room, pull / room, Real(cap)), length);
    } else if (parameters.correlation == Correlation::softened) {
      // 1/Y_L is zero in a dense gas at rest; the cap holds long before 1e-9
      const Real inverse_y = larger(inverse + hardness_ * s, Real(1e-9));
      const Real cubed = 1.0 / (parameters.correlation_onset * inverse_y);
      length = cube_root(cubed);
      return clamped(length, Real(1.0), Real(longest));
    }
    return 1.0 + parameters.correlation_factor * (larger(length, Real(1.0)) - 1.0);
  }

  double hardness_;  // kap without the collision-time factor [s/m]
  double nu_c_, nu_m_;
  double en1_, shear_, loss_, crowding_;
};

}  // namespace grainpair
