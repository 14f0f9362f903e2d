#include <gtest/gtest.h>

#include "mpm/body.hpp"
#include "mpm/case.hpp"

namespace grainpair {
namespace {

// At constant volume the pressure stays, and the steady shear stress is mu(I) p.
TEST(MuI, SteadyShearFollowsTheRheology) {
  const double mu_s = 0.382, mu_2 = 0.643, I_0 = 0.279, d = 0.002, rho = 2532.0, p = 500.0;
  const auto body = material_registry().at("mu_i")(
      Case::load(GRAINPAIR_SOURCE "/cases/column", {"material.law=mu_i"}));
  for (const double rate : {0.1, 10.0, 300.0}) {
    body->resize(1);
    SymTensor sigma;
    Energies energies{};
    double work = 0, temperature = 0;
    Stability stability{};
    std::uint8_t regime = 0;
    const InitialState initial{p * identity(), 0.71, 0.0};
    const auto batch = [&](std::span<const Deformation> steps) {
      return Batch{steps,           {&sigma, 1}, {&energies, 1}, {&work, 1}, {&temperature, 1},
                   {&stability, 1}, {&regime, 1}};
    };
    body->initialise(0, {&initial, 1}, batch({}));
    const Deformation step{SymTensor{0, 0, 0, rate / std::numbers::sqrt2, 0, 0}, Vec3::Zero(),
                           1e-3 / rate, 0.71, 0.71};
    for (int i = 0; i < 100; ++i) body->update(0, batch({&step, 1}));
    const double I = rate * d * std::sqrt(rho / p), mu = mu_s + (mu_2 - mu_s) / (1.0 + I_0 / I);
    EXPECT_NEAR(sigma[3] / std::numbers::sqrt2, mu * p, 1e-9 * p) << rate;
    EXPECT_NEAR(trace(sigma) / 3.0, p, 1e-9 * p);
    EXPECT_NEAR(energies.plastic * rho / 1.71, mu * p * 1e-3, 1e-9 * p);
    EXPECT_EQ(regime, 2);
  }
}

}  // namespace
}  // namespace grainpair
