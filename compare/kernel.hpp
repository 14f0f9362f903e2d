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
  double at(double r2) const { return norm_ * std::exp(-r2 * inverse_); }
  double line(double p2, double t0, double t1) const {
    return at(p2) * line_ * (std::erf(t1 * root_) - std::erf(t0 * root_));
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
  throw std::invalid_argument("unknown kernel '" + name +
                              "' (known: gauss, lucy, heaviside, linear)");
}

}  // namespace grainpair
