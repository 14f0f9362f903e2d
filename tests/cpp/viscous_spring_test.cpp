// The spring that the viscosity of collisions acts through: its balance, its limits, its step.
#include "mpm/materials/viscous_spring.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace grainpair {
namespace {

constexpr double G = 200.0, eta = 0.1,
                 lam = 0.15;  // [m2/s2], [m2/s]: relaxes in half a millisecond

SymTensor shearing(double rate) {
  SymTensor dev = SymTensor::Zero();
  dev[3] = std::numbers::sqrt2 * 0.5 * rate;
  return dev;
}

// 0 weights are the law as printed: 2 eta dev D + lam tr D I, whatever was before, all of it heat.
TEST(ViscousSpring, RigidIsTheDashpot) {
  const ViscousSpring rigid(0.0);
  const SymTensor before = 5.0 * identity(), dev = shearing(30.0);
  const double trD = 4.0, dt = 1e-5;
  const auto r = rigid.stretched<double>(before, dev, trD, eta, lam, dt);
  EXPECT_LT((r.stress - (2.0 * eta * dev + lam * trD * identity())).norm(),
            1e-15 * r.stress.norm());
  EXPECT_EQ(r.stored, 0.0);
  EXPECT_DOUBLE_EQ(r.shear_heat, dt * 2.0 * eta * dev.squaredNorm());
  EXPECT_DOUBLE_EQ(r.bulk_heat, dt * lam * trD * trD);
}

// Whatever the path: work = what is stored + heat, and no heat is negative.
TEST(ViscousSpring, BalancesOnAnyPath) {
  const ViscousSpring spring(G);
  std::mt19937 draw(1);
  std::normal_distribution<double> any;
  SymTensor stress = SymTensor::Zero();
  double held = 0.0, worked = 0.0, heated = 0.0, largest = 0.0;
  for (int i = 0; i < 1000; ++i) {
    SymTensor D;
    for (int k = 0; k < 6; ++k) D[k] = 20.0 * any(draw);
    const double dt = 1e-4 * std::exp(2.0 * any(draw));
    const auto r = spring.stretched<double>(
        stress, deviator(D), trace(D), eta * std::exp(any(draw)), lam * std::exp(any(draw)), dt);
    EXPECT_GE(r.shear_heat, 0.0);
    EXPECT_GE(r.bulk_heat, 0.0);
    stress = r.stress, held = r.stored;
    worked += r.work, heated += r.shear_heat + r.bulk_heat;
    largest = std::max(largest, held);
    EXPECT_DOUBLE_EQ(held, spring.stored(stress));
  }
  EXPECT_GT(largest, 0.01 * heated / 1000);  // the spring held something
  EXPECT_NEAR(worked, held + heated, 1e-12 * worked);
}

// At a constant rate from rest: a = 2 eta D (1 - exp(-G t/eta)), and the mean likewise with lam.
// Backward Euler is of first order in the step.
TEST(ViscousSpring, RelaxesToTheDashpot) {
  const ViscousSpring spring(G);
  const double rate = 30.0, trD = -7.0, end = eta / G;
  const auto error = [&](int steps) {
    SymTensor stress = SymTensor::Zero();
    for (int i = 0; i < steps; ++i)
      stress = spring.stretched<double>(stress, shearing(rate), trD, eta, lam, end / steps).stress;
    const SymTensor exact = 2.0 * eta * (1.0 - std::exp(-G * end / eta)) * shearing(rate) +
                            lam * trD * (1.0 - std::exp(-G * end / lam)) * identity();
    return (stress - exact).norm() / exact.norm();
  };
  EXPECT_LT(error(1000), 1e-3);
  EXPECT_NEAR(error(500) / error(1000), 2.0, 0.01);
  SymTensor stress = SymTensor::Zero();
  for (int i = 0; i < 100; ++i)
    stress = spring.stretched<double>(stress, shearing(rate), trD, eta, lam, end).stress;
  const SymTensor dashpot = 2.0 * eta * shearing(rate) + lam * trD * identity();
  EXPECT_LT((stress - dashpot).norm(), 1e-12 * dashpot.norm());
}

}  // namespace
}  // namespace grainpair
