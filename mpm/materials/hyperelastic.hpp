// Hyperelasticity of Houlsby, Amorosi and Rojas [Houlsby2005], in closed form both ways.
//
// Elastic strain is counted from zero stress: a = tr(eps) is zero at p = 0 (the paper counts from p
// = pa; the shift is 1/(k(1-n))). With c = 2g/(k(1-n)) and u^2 = a^2 + c e:e, where e = dev(eps):
//     Psi = pa/(k(2-n)) (k(1-n) u)^((2-n)/(1-n)),   P0 = pa (k(1-n) u)^(1/(1-n)),
//     p = P0 a/u,   s = P0 c e/u .
// So eta = s/p = c e/a: a cone in stress is a cone in strain, and a stress ratio needs no power.
#pragma once

#include <cmath>

#include "cases/case.hpp"
#include "mpm/numbers/tensor.hpp"

namespace grainpair {

class Hyperelastic {
 public:
  explicit Hyperelastic(const Case& c)
      : Hyperelastic(c.number("material.bulk_stiffness"), c.number("material.shear_stiffness"),
                     c.number("material.stiffness_exponent"),
                     c.number("material.atmospheric_pressure")) {}
  /// k, g, n [-] and pa [Pa]
  Hyperelastic(double bulk_stiffness, double shear_stiffness, double exponent, double pressure)
      : k(bulk_stiffness),
        g(shear_stiffness),
        n(exponent),
        pa(pressure),
        kn(k * (1.0 - n)),
        coupling(2.0 * g / kn) {}

  template <class T>
  struct Loaded {
    T stress;                   // [Pa]
    typename T::Scalar energy;  // [J/m3]
    typename T::Scalar secant;  // P0/u [Pa]
  };

  /// Stress and stored energy at an elastic strain; both zero where the strain has opened (a <= 0).
  template <class T, class Real = typename T::Scalar>
  Loaded<Tensor<Real>> evaluate(const T& strain) const {
    const Real a = trace(strain), u2 = a * a + coupling * deviator(strain).squaredNorm();
    return evaluate(strain, select(a > 0.0, secant(sqrt(u2)), Real(0.0)));
  }
  /// The same where P0/u is known: the power is the dear part.
  template <class T, class Real = typename T::Scalar>
  Loaded<Tensor<Real>> evaluate(const T& strain, const Real& P0_u) const {
    const Real a = trace(strain);
    const Tensor<Real> e = deviator(strain);
    const Real u2 = a * a + coupling * e.squaredNorm();
    return {plus_isotropic((coupling * P0_u) * e, P0_u * a), (1.0 - n) / (2.0 - n) * P0_u * u2,
            P0_u};
  }

  /// Stress [Pa] at an elastic strain.
  template <class T>
  auto stress(const T& strain) const {
    return evaluate(strain).stress;
  }

  /// Elastic strain at a stress of positive pressure.
  SymTensor strain(const SymTensor& sigma) const {
    const double p = trace(sigma) / 3.0;
    const SymTensor s = deviator(sigma);
    const double p0 = std::sqrt(p * p + s.squaredNorm() / coupling);
    const double compliance = size(p0) / p0;
    SymTensor eps = compliance / coupling * s;
    eps += (compliance * p / 3.0) * identity();
    return eps;
  }

  /// Stored energy Psi = P0^(2-n)/(pa^(1-n) k(2-n)) [J/m3].
  template <class T>
  auto energy(const T& strain) const {
    return evaluate(strain).energy;
  }

  /// Gibbs (complementary) energy as the seed prints it, P0^(2-n)/(pa^(1-n) k(1-n)(2-n)) -
  /// p/(k(1-n)) [J/m3] [Ceccato2019, Eq. 7], with P0^2 = p^2 + k(1-n)/(2g) s:s [Ceccato2019, Eq.
  /// 8]. DEVIATION: the seed's p_q/3 is read as the mean stress p, that is, p_q as the trace.
  double gibbs_energy(const SymTensor& sigma) const {
    const double p = trace(sigma) / 3.0;
    const double p0 = std::sqrt(p * p + deviator(sigma).squaredNorm() / coupling);
    return size(p0) * p0 / (2.0 - n) - p / kn;
  }

  /// d(sigma)/dt for an elastic strain rate; B = pa (P0/pa)^n:
  ///     p_dot = k B [(1 - n + n p^2/P0^2) tr D + n p/P0^2 s:D]
  ///     s_dot = 2 g B dev(D) + n k B/P0^2 s (p tr D + s:D)
  SymTensor rate(const SymTensor& sigma, const SymTensor& D) const {
    const double p = trace(sigma) / 3.0, trD = trace(D);
    const SymTensor s = deviator(sigma);
    const double p02 = p * p + s.squaredNorm() / coupling, p0 = std::sqrt(p02);
    const double B = p0 / (kn * size(p0));
    const double coupled = n * k * B / p02 * (p * trD + s.dot(D));
    SymTensor sigma_dot = 2.0 * g * B * deviator(D) + coupled * s;
    sigma_dot += (kn * B * trD + coupled * p) * identity();
    return sigma_dot;
  }

  /// Upper bound of the P-wave modulus over all directions, B [k(1-n) + 4g/3 + n k (sigma_1/P0)^2]
  /// [Pa], with the largest principal stress sigma_1 <= p + 2q/3, at an elastic strain.
  template <class T, class Real = typename T::Scalar>
  Real p_wave_modulus(const T& strain) const {
    const Real a = trace(strain), u2 = a * a + coupling * deviator(strain).squaredNorm();
    return p_wave_modulus(strain, secant(sqrt(u2)));
  }
  template <class T, class Real = typename T::Scalar>
  Real p_wave_modulus(const T& strain, const Real& P0_u) const {
    const Real a = trace(strain), e2 = deviator(strain).squaredNorm();
    const Real u2 = a * a + coupling * e2;
    const Real largest = a + coupling * sqrt(2.0 / 3.0 * e2);  // sigma_1/P0 * u
    const Real modulus = P0_u * (1.0 + 4.0 / 3.0 * g / kn + n * k / kn * largest * largest / u2);
    return select(a > 0.0, modulus, Real(0.0));
  }

  /// P0/u [Pa]
  template <class Real>
  Real secant(const Real& u) const {
    const Real x = kn * u;
    if (n == 0.5) return pa * kn * x;
    if (n == 0.0) return pa * kn;
    return pa * kn * power(x, n / (1.0 - n));
  }
  /// u at P0
  template <class Real>
  Real size(const Real& p0) const {
    const Real x = p0 / pa;
    if (n == 0.5) return sqrt(x) / kn;
    if (n == 0.0) return x / kn;
    return power(x, 1.0 - n) / kn;
  }

  double k, g, n, pa;
  double kn;        // k (1-n)
  double coupling;  // c = 2 g/(k (1-n))
};

}  // namespace grainpair
