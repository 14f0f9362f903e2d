#include "mpm/programs/steady.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "cases/failure.hpp"
#include "cases/hdf5.hpp"

namespace grainpair {
namespace {

constexpr double own = std::numeric_limits<double>::quiet_NaN();

Case seed(const std::string& law, std::vector<std::string> more = {}) {
  more.insert(more.end(), {"mpm.stiffness=as given", "material.law=" + law});
  return Case::load(GRAINPAIR_SOURCE "/cases/column", more);
}

TEST(Steady, PlasticLawsAnswerWithTheirCones) {
  const Condition flow[] = {{100.0, 5.0, own}, {1000.0, 50.0, own}};
  const auto circular = steady_shear(seed("drucker_prager"), flow);
  const auto rate_dependent = steady_shear(seed("mu_i"), flow);
  for (std::size_t i = 0; i < 2; ++i) {
    // isochoric flow on q = M p: tau = M p/sqrt(3)
    EXPECT_NEAR(circular.shear_stress[i] / flow[i].pressure, 0.9 / std::sqrt(3.0), 1e-6);
    EXPECT_NEAR(circular.void_ratio[i], 0.71, 1e-6);
    // mu(I) = mu_s + (mu_2 - mu_s)/(I_0/I + 1)
    const double I = flow[i].shear_rate * 2e-3 * std::sqrt(2532.0 / flow[i].pressure);
    const double mu = 0.382 + (0.643 - 0.382) / (0.279 / I + 1.0);
    EXPECT_NEAR(rate_dependent.shear_stress[i] / flow[i].pressure, mu, 1e-3 * mu);
    // What is done is dissipated: nothing is stored any more.
    for (const auto* answers : {&circular, &rate_dependent})
      EXPECT_NEAR(answers->dissipation[i] / (answers->shear_stress[i] * flow[i].shear_rate), 1.0,
                  2e-3);
  }
}

TEST(Steady, TheFullModelAnswersWithItsClosures) {
  // The closures at a solid fraction of 0.57 and 10 /s: p = 40.0 Pa, s = 20.4 Pa, T* = .2872.
  const Condition flow[] = {{40.0, 10.0, own}};
  const auto found = steady_shear(seed("solid_fluid"), flow);
  EXPECT_NEAR(1.0 / (1.0 + found.void_ratio[0]), 0.57, 1e-4);
  EXPECT_NEAR(found.shear_stress[0], 20.4, 0.004 * 20.4);
  EXPECT_NEAR(found.granular_temperature[0] / (0.02 * 0.02), 0.2872, 0.001);
  EXPECT_NEAR(found.dissipation[0] / (found.shear_stress[0] * 10.0), 1.0, 2e-3);
}

TEST(Steady, AHeldTemperatureIsHeld) {
  const auto law = seed("solid_fluid");
  const Condition free[] = {{40.0, 10.0, own}};
  const auto by_itself = steady_shear(law, free);
  const double T = by_itself.granular_temperature[0];
  const Condition held[] = {{40.0, 10.0, T}, {40.0, 10.0, 2.0 * T}};
  const auto found = steady_shear(law, held);
  EXPECT_NEAR(found.granular_temperature[0], T, 1e-5 * T);
  EXPECT_NEAR(found.shear_stress[0], by_itself.shear_stress[0], 2e-3 * by_itself.shear_stress[0]);
  EXPECT_NEAR(found.dissipation[0], by_itself.dissipation[0], 5e-3 * by_itself.dissipation[0]);
  // Hotter than its own balance it dissipates more than is done on it.
  EXPECT_NEAR(found.granular_temperature[1], 2.0 * T, 1e-5 * T);
  EXPECT_GT(found.dissipation[1], 1.5 * found.shear_stress[1] * 10.0);
}

TEST(Steady, WhatHasNoSteadyStateIsTold) {
  const Condition flow[] = {{100.0, 10.0, own}};
  EXPECT_GT(steady_shear(seed("linear_elastic"), flow).change[0], steady_change);
  // At I = 5 the collisional pressure is above the asked one at every void ratio.
  const Condition thin[] = {{100.0, 5.0 / (2e-3 * std::sqrt(25.32)), own}};
  EXPECT_GT(steady_shear(seed("solid_fluid"), thin).change[0], steady_change);
  EXPECT_LT(steady_shear(seed("solid_fluid"), flow).change[0], steady_change);
}

TEST(Steady, ConditionsOfNoFlowAreRefused) {
  const auto file = (std::filesystem::temp_directory_path() / "grainpair_conditions.h5").string();
  const auto write = [&](std::vector<double> pressure, std::vector<double> rate) {
    const hdf5::Handle out = hdf5::create_file(file);
    hdf5::write_dataset<double>(out, "pressure", pressure);
    hdf5::write_dataset<double>(out, "shear_rate", rate);
  };
  write({10.0, 20.0}, {1.0, 2.0});
  EXPECT_EQ(read_conditions(file).size(), 2u);
  EXPECT_TRUE(std::isnan(read_conditions(file)[1].granular_temperature));
  for (const auto& [pressure, rate] : {std::pair{std::vector{10.0, -1.0}, std::vector{1.0, 1.0}},
                                       {std::vector{10.0}, std::vector{1.0, 1.0}},
                                       {std::vector{own}, std::vector{1.0}},
                                       {std::vector<double>{}, std::vector<double>{}}}) {
    write(pressure, rate);
    EXPECT_THROW(read_conditions(file), CaseError);
  }
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace grainpair
