// Grains harder than their softened skeleton, on fine cells: where e comes below e_c the pressure
// of collisions is the stiffest thing there is, and a step that does not know it makes energy.
#include <gtest/gtest.h>

#include "mpm/step/simulation.hpp"

namespace grainpair {
namespace {

TEST(HardGrains, MakeNoEnergyOnFineCells) {
  const Case scene =
      Case::load(GRAINPAIR_SOURCE "/cases/column_ci",
                 {"material.law=solid_fluid", "material.card=seed_table1", "geometry.length=0.01",
                  "mpm.cell_size=0.0005", "mpm.time_step_fraction=0.8"});
  const auto simulation = make_simulation(scene, {});
  const double held = simulation->ledger().held(), end = 1.6 * time_scale(scene);
  double most = 0.0;
  while (simulation->time() < end) {
    simulation->step(simulation->stable_step().dt);
    most = std::max(most, -simulation->ledger().time_integration / held);
  }
  EXPECT_LT(most, 1e-4);  // what columns make at most within the limit; without: a tenth of it all
}

}  // namespace
}  // namespace grainpair
