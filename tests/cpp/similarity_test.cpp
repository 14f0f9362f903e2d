// Similar columns have one answer. Sixteen times as large, with all that is a stress or a granular
// temperature sixteen times as much and nothing else told, a column does the same in four times the
// time: powers of two, so that not even rounding tells the two apart. A constant in metres, seconds
// or pascals that the case does not tell would.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "mpm/step/simulation.hpp"

namespace grainpair {
namespace {

class Similarity : public testing::TestWithParam<const char*> {
 protected:
  static std::unique_ptr<Simulation> column(double scale, const std::vector<std::string>& more) {
    std::vector<std::string> keys{std::string("material.law=") + GetParam()};
    for (const auto& [key, value] : std::initializer_list<std::pair<const char*, double>>{
             {"geometry.height", 0.02},
             {"geometry.length", 0.02},
             {"geometry.thickness", 0.006},
             {"geometry.floor_length", 0.12},
             {"grains.diameter", 0.002},
             {"mpm.cell_size", 0.004},
             {"mpm.young_modulus", 5e6},
             {"material.young_modulus", 3e5},
             {"material.atmospheric_pressure", 62500.0},
             {"initial.granular_temperature", 1e-15}})
      keys.push_back(fmt::format("{}={:.17g}", key, scale * value));
    keys.insert(keys.end(), more.begin(), more.end());
    return make_simulation(Case::load(GRAINPAIR_SOURCE "/cases/column_ci", keys), {});
  }

  /// Until √(H/g) of the smaller: whether steps and places of the larger are its own, scaled.
  static bool similar(Simulation& small, Simulation& large) {
    const double end = std::sqrt(0.02 / 9.81);
    while (small.time() < end) {
      const double dt = small.stable_step().dt;
      if (large.stable_step().dt != 4.0 * dt) return false;
      small.step(dt), large.step(4.0 * dt);
    }
    bool same = true;
    small.visit_points([&](const auto& points) {
      for (const std::size_t p : points.occupied())
        same = same && 16.0 * small.position(p) == large.position(p) &&
               4.0 * small.velocity(p) == large.velocity(p);
    });
    return same;
  }
};

TEST_P(Similarity, ColumnsDifferByNothingButTheirSize) {
  const auto small = column(1.0, {}), large = column(16.0, {});
  EXPECT_TRUE(similar(*small, *large));
}

TEST_P(Similarity, ARelaxationTimeOfItsOwnIsSeen) {
  const auto small = column(1.0, {});
  // as long in seconds as the smaller's, a quarter in the larger's own unit
  EXPECT_FALSE(similar(*small, *column(16.0, {"mpm.gradient_relaxation=0.075"})));
}

INSTANTIATE_TEST_SUITE_P(Laws, Similarity,
                         testing::Values("drucker_prager", "mu_i", "lade_duncan", "critical_state",
                                         "solid_fluid", "contact_share"));

}  // namespace
}  // namespace grainpair
