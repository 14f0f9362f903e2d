#include <gtest/gtest.h>

#include "cases/case.hpp"
#include "mpm/points/body.hpp"

namespace grainpair {
namespace {

// At constant volume the pressure stays, and the steady shear stress is mu(I) p.
TEST(MuI, SteadyShearFollowsTheRheology) {
  const double mu_s = 0.382, mu_2 = 0.643, I_0 = 0.279, d = 0.002, rho = 2532.0, p = 500.0;
  const auto body = material_registry().at("mu_i")(
      Case::load(GRAINPAIR_SOURCE "/cases/column", {"material.law=mu_i"}));
  for (const double rate : {0.1, 10.0, 300.0}) {
    body->resize(1);
    Batch batch(1);
    const InitialState initial{p * identity(), 0.71, 0.0};
    body->initialise(0, {&initial, 1}, batch);
    const Deformation step{SymTensor{0, 0, 0, rate / std::numbers::sqrt2, 0, 0}, Vec3::Zero(),
                           1e-3 / rate, 0.71, 0.71};
    batch.steps.set(0, step);
    for (int i = 0; i < 100; ++i) body->update(0, batch);
    const SymTensor sigma = batch.sigma[0];
    const double I = rate * d * std::sqrt(rho / p), mu = mu_s + (mu_2 - mu_s) / (1.0 + I_0 / I);
    EXPECT_NEAR(sigma[3] / std::numbers::sqrt2, mu * p, 1e-9 * p) << rate;
    EXPECT_NEAR(trace(sigma) / 3.0, p, 1e-9 * p);
    EXPECT_NEAR(batch.energies[0].plastic * rho / 1.71, mu * p * 1e-3, 1e-9 * p);
    EXPECT_EQ(batch.regime[0], 2);
  }
}

}  // namespace
}  // namespace grainpair
