#include "mpm/materials/lade_duncan.hpp"

#include <gtest/gtest.h>

#include <random>

namespace grainpair {
namespace {

SymTensor random_deviator(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  SymTensor a;
  for (double& x : a) x = normal(random);
  return deviator(a).normalized();
}

const Hyperelastic elasticity{380.0, 48.0, 0.5, 1e5};

// model: kappa = 27/(1 - M^2/3 + 2 M^3/27), and the strength in extension and in pure shear.
TEST(LadeDuncan, StrengthsOfTheSeedsCone) {
  const LadeDuncan cone(0.9);
  EXPECT_NEAR(cone.kappa(), 34.4388, 5e-5);
  const auto ratio_at_yield = [&](const SymTensor& direction) {  // q/p, by bisection
    double in = 0.0, out = 1.2;
    for (int i = 0; i < 60; ++i) {
      const double r = 0.5 * (in + out);
      (cone.holds(r * direction) ? in : out) = r;
    }
    return std::sqrt(1.5) * in;
  };
  const SymTensor compression = SymTensor{2.0, -1.0, -1.0, 0, 0, 0} / std::sqrt(6.0);
  EXPECT_NEAR(ratio_at_yield(compression), 0.9, 1e-12);
  EXPECT_NEAR(ratio_at_yield(-compression), 0.7456, 5e-5);
  const SymTensor shear{0, 0, 0, 1.0, 0, 0};
  EXPECT_NEAR(ratio_at_yield(shear) / std::sqrt(3.0), 0.4648, 5e-5);
}

TEST(LadeDuncan, YieldIsTheOneOfItsInvariants) {
  // I1^3 - kappa I3 < 0 inside; both forms change sign together.
  const LadeDuncan cone(0.9);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> radius(0.0, 0.9);
  for (int i = 0; i < 1000; ++i) {
    const SymTensor eta = radius(random) * random_deviator(random);
    const double invariants = 27.0 - cone.kappa() * determinant(eta + identity());
    EXPECT_NEAR(invariants, cone.kappa() * cone.yield(eta), 1e-12);
  }
}

TEST(LadeDuncan, NormalIsTheDerivativeOfYield) {
  std::mt19937_64 random(2);
  const LadeDuncan cone(0.9);
  for (int i = 0; i < 100; ++i) {
    const SymTensor eta = 0.6 * random_deviator(random), step = 1e-6 * random_deviator(random);
    const double difference = cone.yield(eta + step) - cone.yield(eta - step);
    EXPECT_NEAR(difference, 2.0 * LadeDuncan::normal(eta).dot(step), 1e-15);  // f rounds to 1e-16
  }
}

// The closest point satisfies: on the cone, and the return parallel to the normal there, for any
// trial however far.
class Return : public testing::TestWithParam<double> {};

TEST_P(Return, EndsOnTheConeAlongItsNormal) {
  const LadeDuncan cone(GetParam());
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> decades(-9.0, 6.0), ratio(-0.4, 0.4), kind(0.0, 1.0);
  int outside = 0;
  double most = 0.0;
  for (int i = 0; i < 200000; ++i) {
    SymTensor direction = random_deviator(random);
    if (i % 10 == 0)
      direction = (i % 20 ? 1.0 : -1.0) * SymTensor{2, -1, -1, 1e-9 * (i % 7), 0, 0}.normalized();
    const double a = 1e-3, flow = i % 3 ? ratio(random) : 0.0;
    // a trial beyond the cone's corner in compression by 1e-9 to 1e6 of its radius
    const SymTensor trial = a / elasticity.coupling * std::sqrt(2.0 / 3.0) * GetParam() *
                            (1.0 + std::pow(10.0, decades(random))) * direction;
    const ConeReturn<SymTensor> back = cone.along_flow(elasticity, trial, a, flow);
    if (back.volumetric <= 0.0) {
      EXPECT_GE(flow * trial.norm(), a);
      continue;
    }
    ++outside;
    most = std::max(most, back.iterations);
    ASSERT_TRUE(back.converged) << trial.transpose() << " flow " << flow;
    const SymTensor eta = elasticity.coupling / back.volumetric * back.deviatoric;
    ASSERT_NEAR(cone.yield(eta), 0.0, 1e-11);
    ASSERT_LT(eta.squaredNorm(), 6.0);
    const SymTensor plastic = trial - back.deviatoric;
    ASSERT_GE(back.multiplier, 0.0);
    const SymTensor n = LadeDuncan::normal(eta).normalized();
    ASSERT_NEAR((plastic - back.multiplier * n).norm(), 0.0, 1e-10 * trial.norm());
    ASSERT_NEAR(back.volumetric, a - flow * back.multiplier,
                1e-10 * (a + std::abs(flow) * trial.norm()));
  }
  EXPECT_GT(outside, 100000);
  RecordProperty("most_iterations", static_cast<int>(most));
  EXPECT_LE(most, 12);
}

TEST_P(Return, HitsTheAskedPressure) {
  const LadeDuncan cone(GetParam());
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> decades(-3.0, 3.0);
  int inside = 0;
  for (int i = 0; i < 200000; ++i) {
    const double p = 1e3 * std::pow(10.0, decades(random));
    const double reach = i % 2 ? std::pow(10.0, decades(random)) : 0.8 + 0.05 * decades(random);
    const SymTensor trial = elasticity.size(p) / elasticity.coupling * std::sqrt(2.0 / 3.0) *
                            GetParam() * reach * random_deviator(random);
    const ConeReturn<SymTensor> back = cone.at_pressure(elasticity, trial, p);
    ASSERT_TRUE(back.converged) << reach;
    if (back.multiplier <
        0.0) {  // inside the section: sheared further, at this pressure, it would still hold
      ++inside;
      ASSERT_LT(reach, 1.2);
      continue;
    }
    const SymTensor stress =
        elasticity.stress(back.deviatoric + back.volumetric / 3.0 * identity());
    const SymTensor eta = deviator(stress) / p;
    ASSERT_NEAR(trace(stress) / 3.0, p, 1e-11 * p);
    ASSERT_NEAR(cone.yield(eta), 0.0, 1e-11);
    ASSERT_LT(
        (trial - back.deviatoric - back.multiplier * LadeDuncan::normal(eta).normalized()).norm(),
        1e-10 * trial.norm());
  }
  EXPECT_GT(inside, 10000);
}

INSTANTIATE_TEST_SUITE_P(StressRatios, Return, testing::Values(0.3, 0.6, 0.9, 1.2));

}  // namespace
}  // namespace grainpair
