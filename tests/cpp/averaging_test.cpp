// What laws average over their cells unless the case says.
#include <gtest/gtest.h>

#include "mpm/step/simulation.hpp"

namespace grainpair {
namespace {

/// Whether any point of a column that has begun to fall passes on another pressure than its own.
bool averages(const std::string& law, const std::vector<std::string>& more = {}) {
  std::vector<std::string> keys{"material.law=" + law, "mpm.cell_size=0.002"};
  keys.insert(keys.end(), more.begin(), more.end());
  const auto simulation =
      make_simulation(Case::load(GRAINPAIR_SOURCE "/cases/column_ci", keys), {});
  for (int k = 0; k < 200; ++k) simulation->step(simulation->stable_step().dt);
  bool found = false;
  simulation->visit_points([&](const auto& points) {
    for (const std::size_t p : points.occupied())
      found = found || simulation->pressure_correction(p) != 0.0;
  });
  return found;
}

TEST(Averaging, IsForLawsThatResistSlowAndFastFlowAlike) {
  for (const std::string law :
       {"linear_elastic", "drucker_prager", "lade_duncan", "critical_state"})
    EXPECT_TRUE(averages(law)) << law;
  for (const std::string law : {"mu_i", "solid_fluid", "contact_share"})
    EXPECT_FALSE(averages(law)) << law;
}

TEST(Averaging, IsWhatTheCaseSays) {
  EXPECT_TRUE(averages("mu_i", {"mpm.volumetric_averaging=cell"}));
  EXPECT_FALSE(averages("drucker_prager", {"mpm.volumetric_averaging=none"}));
}

}  // namespace
}  // namespace grainpair
