#include "compare/mapping/kernel.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace grainpair {
namespace {

constexpr double w = 0.7;

/// Composite Gauss-Legendre quadrature (5 points in each of n panels): exact to round-off for the
/// smooth parts.
double integrate(double a, double b, auto f, int n = 400) {
  constexpr std::array x{0.0, 0.5384693101056831, 0.9061798459386640};
  constexpr std::array weight{0.5688888888888889, 0.4786286704993665, 0.2369268850561891};
  double sum = 0.0;
  const double h = (b - a) / n;
  for (int i = 0; i < n; ++i) {
    const double m = a + (i + 0.5) * h;
    sum += weight[0] * f(m);
    for (int k = 1; k < 3; ++k) sum += weight[k] * (f(m + 0.5 * h * x[k]) + f(m - 0.5 * h * x[k]));
  }
  return 0.5 * h * sum;
}

/// Integral over the support of phi(r) g(r).
template <int D>
double over_support(const auto& kernel, auto g) {
  constexpr double pi = std::numbers::pi;
  return integrate(0.0, kernel.cutoff(), [&](double r) {
    const double shell = D == 1 ? 2.0 : D == 2 ? 2.0 * pi * r : 4.0 * pi * r * r;
    return shell * kernel.at(r * r) * g(r);
  });
}

template <class K>
struct KernelTest : testing::Test {};
template <template <int> class K, int N>
struct Of {
  static constexpr int D = N;
  using type = K<N>;
};
using Kernels = testing::Types<Of<Gauss, 1>, Of<Gauss, 2>, Of<Gauss, 3>, Of<Lucy, 1>, Of<Lucy, 2>,
                               Of<Lucy, 3>, Of<Heaviside, 1>, Of<Heaviside, 2>, Of<Heaviside, 3>,
                               Of<Linear, 1>, Of<Linear, 2>, Of<Linear, 3>>;
TYPED_TEST_SUITE(KernelTest, Kernels);

TYPED_TEST(KernelTest, IntegralIsOne) {
  const typename TypeParam::type kernel(w);
  // The quadrature's own round-off: 2000 terms of order eps.
  EXPECT_NEAR(over_support<TypeParam::D>(kernel, [](double) { return 1.0; }), 1.0, 1e-13);
}

TYPED_TEST(KernelTest, SecondMomentPerComponentIsTheWidthSquared) {
  constexpr int D = TypeParam::D;
  const typename TypeParam::type kernel(w);
  const double moment = over_support<D>(kernel, [](double r) { return r * r; }) / D;
  double expected = w * w;
  if (std::is_same_v<typename TypeParam::type, Gauss<D>>) {
    // The truncated Gaussian's: w^2 (1 - c^D exp(-c^2/2) / (D gamma_D)), gamma_D the
    // normalisation's integral.
    const double q = 3.0, e = std::exp(-0.5 * q * q), root = std::sqrt(2.0 / std::numbers::pi);
    const double inside = std::erf(q / std::numbers::sqrt2);
    expected *= D == 1   ? 1.0 - root * q * e / inside
                : D == 2 ? 1.0 - 0.5 * q * q * e / (1.0 - e)
                         : 1.0 - root * q * q * q * e / (3.0 * (inside - root * q * e));
  }
  EXPECT_NEAR(moment, expected, 1e-13);
}

TYPED_TEST(KernelTest, LineIntegralIsExact) {
  const typename TypeParam::type kernel(w);
  const double c = kernel.cutoff();
  for (const double p : {0.0, 0.2 * c, 0.77 * c}) {
    const double half = std::sqrt(c * c - p * p);
    for (const double t : {-half, -0.3 * half, 0.5 * half, half}) {
      // sqrt has no Taylor series at r = 0: there the panels converge as h^2 (Lucy, Linear), 400 of
      // them to 1e-6.
      const double numeric =
          integrate(0.0, t, [&](double s) { return kernel.at(std::min(p * p + s * s, c * c)); });
      EXPECT_NEAR(kernel.line(p * p, 0.0, t), numeric, 1e-10 * kernel.at(0.0) * c)
          << "p " << p << " t " << t;
      EXPECT_NEAR(kernel.line(p * p, -t, t), 2.0 * numeric, 2e-10 * kernel.at(0.0) * c);
    }
  }
}

TEST(Kernel, TruncatedGaussKeepsTheQuotedVariance) {
  EXPECT_NEAR(over_support<3>(Gauss<3>(1.0), [](double r) { return r * r; }) / 3.0, 0.918, 5e-4);
  EXPECT_NEAR(over_support<2>(Gauss<2>(1.0), [](double r) { return r * r; }) / 2.0, 0.949, 5e-4);
  EXPECT_NEAR(over_support<1>(Gauss<1>(1.0), [](double r) { return r * r; }), 0.973, 5e-4);
}

TEST(Kernel, LucyIsMercurysPolynomial) {
  // 105 / (16 pi c^3) (1 - 6 q^2 + 8 q^3 - 3 q^4), c = sqrt(12) w
  const Lucy<3> lucy(w);
  const double c = std::sqrt(12.0) * w, q = 0.4;
  EXPECT_DOUBLE_EQ(lucy.cutoff(), c);
  EXPECT_NEAR(lucy.at(q * q * c * c),
              105.0 / (16.0 * std::numbers::pi * c * c * c) *
                  (1 - 6 * q * q + 8 * q * q * q - 3 * q * q * q * q),
              1e-15);
}

TEST(Kernel, UnknownNameIsRefused) {
  EXPECT_THROW(make_kernel<2>("gaus", w), std::invalid_argument);
}

}  // namespace
}  // namespace grainpair
