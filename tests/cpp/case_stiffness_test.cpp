// The stiffness a scene needs: what is softened, to what, and what is left alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cases/case.hpp"
#include "cases/rates.hpp"
#include "tests/cpp/case_files.hpp"

namespace grainpair {
namespace {

using ::testing::HasSubstr;

constexpr const char* column = GRAINPAIR_SOURCE "/cases/column";
// rho_s g H/(1+e0) of that column [Pa]
constexpr double weight = 2532.0 / 1.71 * 9.81 * 0.1;

Case scene(const std::string& law, std::vector<std::string> more = {}) {
  more.push_back("material.law=" + law);
  return Case::load(column, more);
}

double bulk(const Case& c) {
  const double pa = c.number("material.atmospheric_pressure");
  return c.number("material.bulk_stiffness") * pa *
         std::pow(weight / pa, c.number("material.stiffness_exponent"));
}

TEST(Stiffness, ReachesTheBoundInEveryLaw) {
  const Case soft = scene("drucker_prager");
  const double K = soft.number("material.young_modulus") / 1.2;  // Poisson ratio 0.3
  EXPECT_NEAR(weight / K, 2e-3, 1e-12);
  for (const char* law : {"lade_duncan", "critical_state", "solid_fluid", "contact_share"})
    for (const double asked : {1e-3, 1e-2}) {
      const Case c = scene(law, {"mpm.weight_to_stiffness=" + std::to_string(asked)});
      EXPECT_NEAR(weight / bulk(c), asked, 1e-12) << law;
      EXPECT_NEAR(c.stiffness().continuum.weight, asked, 1e-12) << law;
      EXPECT_NEAR(c.number("material.shear_stiffness") / c.number("material.bulk_stiffness"),
                  48.0 / 380.0, 1e-12);
    }
}

// Of grains E_p s^(3/2), Hertz's bulk modulus is s times as large: the locus follows, a_L E_p. The
// grains that collide stay what they are.
TEST(Stiffness, OfTheLocusGoesAsHertz) {
  const Case c = scene("solid_fluid");
  const double s = c.stiffness().continuum.factor;
  EXPECT_NEAR(s, weight / 2e-3 / (380.0 * 1e5 * std::sqrt(weight / 1e5)), 1e-12);
  EXPECT_NEAR(c.number("material.critical_state_slope"), 0.56 * std::pow(s, 1.5), 1e-12);
  EXPECT_EQ(c.number("mpm.young_modulus"), 0.0);
  EXPECT_EQ(scene("lade_duncan").number("material.critical_state_slope"), 0.56);  // reads none
}

// The critical-state locus may be the softer of the two: then it sets the factor.
TEST(Stiffness, LeavesTheCriticalStateLocusStiffEnough) {
  const Case c = scene("critical_state", {"material.critical_state_slope=0.006"});
  const double aE = 3e8 * c.number("material.critical_state_slope"),
               K = aE / 1.709;  // linear: nu a_L E_p
  EXPECT_NEAR(weight / K, 2e-3, 1e-12);
  EXPECT_LT(weight / bulk(c), 2e-3);
}

TEST(Stiffness, IsNeverRaisedAndLeavesWhatIsGiven) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"mpm.stiffness=as given"},
        {"mpm.young_modulus=1e8"},
        {"material.bulk_stiffness=5", "material.shear_stiffness=48"}}) {
    const Case c = scene("solid_fluid", words);
    EXPECT_EQ(c.stiffness().continuum.factor, 1.0);
    EXPECT_EQ(c.stiffness().continuum.error, 0.0);
    EXPECT_EQ(c.number("material.shear_stiffness"), 48.0);
  }
}

TEST(Stiffness, LeavesStrengthDilationAndVoidRatios) {
  const Case as_given = scene("solid_fluid", {"mpm.stiffness=as given"}), c = scene("solid_fluid");
  EXPECT_LT(c.stiffness().continuum.factor, 1.0);
  for (const char* key : {"stress_ratio", "critical_void_ratio", "dilatancy",
                          "effective_restitution", "collision_time_factor"}) {
    const std::string name = std::string("material.") + key;
    EXPECT_EQ(c.number(name), as_given.number(name)) << name;
  }
}

class ResolvedStiffness : public test::Files {};

// What is resolved holds the law's own constants, so that it can be softened anew.
TEST_F(ResolvedStiffness, ResolvesToTheSame) {
  const Case first = scene("solid_fluid", {"dem.stiffness=needed"});
  EXPECT_THAT(first.resolved(), HasSubstr("bulk_stiffness = 380.0"));
  const Case again = Case::load(file("case.toml", first.resolved()));
  EXPECT_EQ(again.resolved(), first.resolved());
  EXPECT_EQ(again.number("material.bulk_stiffness"), first.number("material.bulk_stiffness"));
  EXPECT_EQ(again.number("material.critical_state_slope"),
            first.number("material.critical_state_slope"));
  EXPECT_EQ(again.stiffness().grains.factor, first.stiffness().grains.factor);
}

TEST(Stiffness, OfGrainsReachesTheSameBound) {
  const Case c = scene("mu_i", {"dem.stiffness=needed"});
  EXPECT_NEAR(c.stiffness().grains.weight, 2e-3, 1e-12);
  EXPECT_NEAR(c.stiffness().grains.factor, std::pow(c.number("dem.young_modulus") / 3e8, 2.0 / 3.0),
              1e-12);
  // softened by hand or not at all, it is told all the same
  EXPECT_EQ(scene("mu_i").stiffness().grains.factor, 1.0);
  EXPECT_NEAR(scene("mu_i", {"dem.young_modulus=3e5"}).stiffness().grains.factor, 0.01, 1e-12);
}

TEST(SofteningError, FollowsItsTable) {
  EXPECT_NEAR(softening_error("lade_duncan", 5e-3), 0.0092, 1e-12);
  EXPECT_NEAR(softening_error("lade_duncan", 3.5e-3), 0.5 * (0.0055 + 0.0092), 1e-12);
  EXPECT_NEAR(softening_error("lade_duncan", 5e-4), 0.5 * 0.005, 1e-12);
  EXPECT_NEAR(softening_error("lade_duncan", 4e-2), 2 * 0.0371, 1e-12);
}

}  // namespace
}  // namespace grainpair
