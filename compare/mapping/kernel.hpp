// Coarse-graining kernels: phi(r) >= 0 with compact support and integral one in D dimensions.
//
// Each kernel is a value with three members:
//   cutoff()      radius of its support [m]
//   at(r2)        phi at squared distance r2 < cutoff^2 [1/m^D]
//   line(p2, t0, t1)  integral of phi along a straight line whose point nearest the centre is at
//   squared distance p2,
//                 from t0 to t1, distances along the line from that point; inside the support
//                 [1/m^(D-1)]
// w is the standard deviation per component, so that kernels of one width filter alike. For the
// Gaussian it is the w of the formula: cutting it at 3 w leaves 0.918 w^2, 0.949 w^2, 0.973 w^2 of
// variance in 3, 2, 1 dimensions. Definitions after Goldhirsch, Granular Matter 12:239 (2010) and
// Weinhart et al., Granular Matter 14:289 (2012).
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <variant>

namespace grainpair {

namespace kernel_detail {
inline constexpr double pi = std::numbers::pi;

/// Integral of r = sqrt(p2 + t^2) over t, and of r^3.
inline double line_r(double p2, double t) {
  const double r = std::sqrt(p2 + t * t);
  return 0.5 * (t * r + (p2 > 0.0 ? p2 * std::asinh(t / std::sqrt(p2)) : 0.0));
}
inline double line_r3(double p2, double t) {
  const double r = std::sqrt(p2 + t * t);
  return 0.25 * t * r * r * r + 0.75 * p2 * line_r(p2, t);
}

/// A polynomial that interpolates f at the Chebyshev nodes of [0, 4.5], the range of r^2 / 2 w^2
/// under a Gaussian cut at 3 w. No branch and no table, so that the loops over a row of cells run
/// in vectors.
template <int Degree>
class Polynomial {
 public:
  explicit Polynomial(auto f) {
    constexpr int n = Degree + 1;
    constexpr long double pi_l = std::numbers::pi_v<long double>;
    // c_j = 2/n sum_k f(x_k) cos(j theta_k), then sum_j c_j T_j(y) as powers of y.
    std::array<long double, n> before{}, chebyshev{}, powers{};
    for (int j = 0; j < n; ++j) {
      long double c = 0.0L;
      for (int k = 0; k < n; ++k) {
        const long double theta = pi_l * (k + 0.5L) / n;
        c += (j == 0 ? 1.0L : 2.0L) / n * f(half * (1.0L + std::cos(theta))) * std::cos(j * theta);
      }
      std::array<long double, n> next{};  // T_j+1 = 2 y T_j - T_j-1
      if (j == 0) chebyshev[0] = 1.0L;
      for (int i = 0; i < n; ++i) powers[i] += c * chebyshev[i];
      for (int i = 0; i + 1 < n; ++i) next[i + 1] = (j == 0 ? 1.0L : 2.0L) * chebyshev[i];
      for (int i = 0; i < n; ++i) next[i] -= before[i];
      before = chebyshev, chebyshev = next;
    }
    for (int i = 0; i < n; ++i) coefficient_[i] = static_cast<double>(powers[i]);
  }
  double operator()(double x) const {
    const double y = x * (1.0 / half) - 1.0;
    double value = coefficient_[Degree];
    for (int i = Degree - 1; i >= 0; --i) value = value * y + coefficient_[i];
    return value;
  }

 private:
  static constexpr double half = 2.25;
  std::array<double, Degree + 1> coefficient_;
};

/// exp(-x), 0 <= x <= 4.5: within 1.2e-15 of it, relative.
inline const Polynomial<12> fourth_root([](long double x) { return std::exp(-x / 4); });
inline double exp_minus(double x) {
  const double root = fourth_root(x), square = root * root;
  return square * square;
}
/// erf(x), x^2 <= 4.5: within 6e-16 of it.
inline const Polynomial<16> erf_ratio([](long double x2) {
  return std::erf(std::sqrt(x2)) / std::sqrt(x2);
});
inline double erf(double x) { return x * erf_ratio(x * x); }
}  // namespace kernel_detail

/// phi = Z exp(-r^2 / 2 w^2), cut at c = 3 w and renormalised.
template <int D>
class Gauss {
 public:
  explicit Gauss(double w) : w_(w), inverse_(1.0 / (2.0 * w * w)) {
    using kernel_detail::pi;
    const double q = 3.0;  // c / w
    const double inside = D == 1   ? std::erf(q / std::numbers::sqrt2)
                          : D == 2 ? 1.0 - std::exp(-0.5 * q * q)
                                   : std::erf(q / std::numbers::sqrt2) -
                                         std::sqrt(2.0 / pi) * q * std::exp(-0.5 * q * q);
    norm_ = std::pow(2.0 * pi * w * w, -0.5 * D) / inside;
  }
  double cutoff() const { return 3.0 * w_; }
  double at(double r2) const { return norm_ * kernel_detail::exp_minus(r2 * inverse_); }
  double line(double p2, double t0, double t1) const {
    using kernel_detail::erf;
    return at(p2) * line_ * (erf(t1 * root_) - erf(t0 * root_));
  }

 private:
  double w_, inverse_, norm_;
  double root_ = std::sqrt(inverse_), line_ = w_ * std::sqrt(0.5 * kernel_detail::pi);
};

/// phi = Z (1 - 6 q^2 + 8 q^3 - 3 q^4), q = r / c.
template <int D>
class Lucy {
 public:
  explicit Lucy(double w)
      : c_(w / std::sqrt(D == 1   ? 2.0 / 21.0
                         : D == 2 ? 5.0 / 56.0
                                  : 1.0 / 12.0)),
        norm_((D == 1   ? 5.0 / 4.0
               : D == 2 ? 5.0 / kernel_detail::pi
                        : 105.0 / (16.0 * kernel_detail::pi)) /
              std::pow(c_, D)) {}
  double cutoff() const { return c_; }
  double at(double r2) const {
    const double q2 = r2 / (c_ * c_), q = std::sqrt(q2);
    return norm_ * (1.0 + q2 * (-6.0 + q * (8.0 - 3.0 * q)));
  }
  double line(double p2, double t0, double t1) const {
    return from_nearest(p2, t1) - from_nearest(p2, t0);
  }

 private:
  double from_nearest(double p2, double t) const {
    const double c2 = c_ * c_, t2 = t * t;
    const double r2 = t * (p2 + t2 / 3.0);
    const double r4 = t * (p2 * p2 + t2 * (2.0 * p2 / 3.0 + t2 / 5.0));
    return norm_ * (t - 6.0 * r2 / c2 + 8.0 * kernel_detail::line_r3(p2, t) / (c2 * c_) -
                    3.0 * r4 / (c2 * c2));
  }

  double c_, norm_;
};

/// phi = Z, a ball of radius c.
template <int D>
class Heaviside {
 public:
  explicit Heaviside(double w)
      : c_(w * std::sqrt(D + 2.0)),
        norm_((D == 1   ? 0.5
               : D == 2 ? 1.0 / kernel_detail::pi
                        : 0.75 / kernel_detail::pi) /
              std::pow(c_, D)) {}
  double cutoff() const { return c_; }
  double at(double) const { return norm_; }
  double line(double, double t0, double t1) const { return norm_ * (t1 - t0); }

 private:
  double c_, norm_;
};

/// phi = Z (1 - q), q = r / c: a cone.
template <int D>
class Linear {
 public:
  explicit Linear(double w)
      : c_(w / std::sqrt(D == 1   ? 1.0 / 6.0
                         : D == 2 ? 0.15
                                  : 2.0 / 15.0)),
        norm_((D == 1 ? 1.0 : 3.0 / kernel_detail::pi) / std::pow(c_, D)) {}
  double cutoff() const { return c_; }
  double at(double r2) const { return norm_ * (1.0 - std::sqrt(r2) / c_); }
  double line(double p2, double t0, double t1) const {
    return norm_ * (t1 - t0 - (kernel_detail::line_r(p2, t1) - kernel_detail::line_r(p2, t0)) / c_);
  }

 private:
  double c_, norm_;
};

template <int D>
using Kernel = std::variant<Gauss<D>, Lucy<D>, Heaviside<D>, Linear<D>>;

/// Kernel by the name a case file gives it; w in metres.
template <int D>
Kernel<D> make_kernel(const std::string& name, double w) {
  if (name == "gauss") return Gauss<D>(w);
  if (name == "lucy") return Lucy<D>(w);
  if (name == "heaviside") return Heaviside<D>(w);
  if (name == "linear") return Linear<D>(w);
  std::string line = "unknown kernel '" + name + "' (known: gauss, lucy, heaviside, linear)";
  for (char& c : line) c = c == '\n' || c == '\r' ? ' ' : c;
  throw std::invalid_argument(line);
}

}  // namespace grainpair
