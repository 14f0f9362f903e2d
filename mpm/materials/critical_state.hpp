// The critical-state locus G_1(p, e) = p - p_cs(e) and the dilatancy that leads to it.
//
// The seed gives its parameters (E_p, e_c, a_L, delta) but not its form; here, with nu = 1/(1+e),
//     p_cs = a_L E_p (nu - nu_c)^m for nu > nu_c, 0 otherwise;   m = 1, 3/2 or 2,
//     D = eps_pv/eps_pq = A psi, psi = e - e_cs(p), |D| <= min(1/2, M_c/2),
// where A is M_c/delta, delta or 0. The bound keeps plastic dissipation positive: q eps_pq + p
// eps_pv > 0 needs D > -q/p.
// DEVIATION: a reconstruction, judged by the grains' element tests.
#pragma once

#include <algorithm>
#include <cmath>

#include "mpm/materials/grains.hpp"
#include "mpm/numbers/wide.hpp"

namespace grainpair {

class CriticalState {
 public:
  enum class Form { linear, two_thirds, square_root };

  explicit CriticalState(const Case& c)
      : CriticalState(young_modulus_of_grains(c), c.number("material.critical_void_ratio"),
                      c.number("material.critical_state_slope"),
                      form(c.word("material.critical_state_form")), rate(c),
                      c.number("material.stress_ratio")) {}
  /// E_p [Pa], e_c, a_L, the locus's form, A and M_c
  CriticalState(double young_modulus, double critical_void_ratio, double slope, Form f,
                double dilatancy_rate, double stress_ratio)
      : e_c(critical_void_ratio),
        A(dilatancy_rate),
        largest_ratio(root_two_thirds * std::min(0.5, 0.5 * stress_ratio)),
        scale_(slope * young_modulus),
        nu_c_(1.0 / (1.0 + critical_void_ratio)),
        form_(f) {}

  /// p_cs(e) [Pa]
  template <class Real>
  Real pressure(const Real& e) const {
    const Real x = larger(1.0 / (1.0 + e) - nu_c_, Real(0.0));
    return scale_ * (form_ == Form::linear ? x : form_ == Form::square_root ? x * x : x * sqrt(x));
  }

  /// K_cs = nu dp_cs/dnu [Pa]
  template <class Real>
  Real modulus(const Real& e) const {
    const Real nu = 1.0 / (1.0 + e), x = nu - nu_c_,
               dense = select(x > 0.0, scale_ * nu, Real(0.0));
    if (form_ == Form::linear) return dense;
    return dense * (form_ == Form::square_root ? 2.0 * x : 1.5 * sqrt(larger(x, Real(0.0))));
  }

  /// e_cs(p), the void ratio at which p_cs = p
  template <class Real>
  Real void_ratio(const Real& p) const {
    const Real x = p / scale_;
    return 1.0 / (nu_c_ + (form_ == Form::linear        ? x
                           : form_ == Form::square_root ? sqrt(x)
                                                        : cube_root(x * x))) -
           1.0;
  }

  /// sqrt(2/3) D: plastic volumetric strain per unit of plastic deviatoric strain |dev eps_p|,
  /// compression positive
  template <class Real>
  Real flow_ratio(const Real& e, const Real& p) const {
    const Real psi = e - void_ratio(larger(p, Real(0.0)));
    return clamped(root_two_thirds * A * psi, Real(-largest_ratio), Real(largest_ratio));
  }

  double e_c;
  double A;              // [-]
  double largest_ratio;  // bound of |flow_ratio|

 private:
  static constexpr double root_two_thirds = 0.81649658092772603273;

  static Form form(const std::string& word) {
    return word == "linear"       ? Form::linear
           : word == "two_thirds" ? Form::two_thirds
                                  : Form::square_root;
  }
  static double rate(const Case& c) {
    const std::string& word = c.word("material.dilatancy_form");
    const double delta = c.number("material.dilatancy");
    return word == "none"    ? 0.0
           : word == "delta" ? delta
                             : c.number("material.stress_ratio") / delta;
  }

  double scale_, nu_c_;
  Form form_;
};

}  // namespace grainpair
