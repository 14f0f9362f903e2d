// What the grains determine of a law's constants: derived, and told where a case contradicts it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "cases/case.hpp"
#include "cases/constants.hpp"
#include "tests/cpp/case_files.hpp"

namespace grainpair {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

const std::string cases = GRAINPAIR_SOURCE "/cases";

/// The seed's column with the full model and the card fitted to its grains, but for the overrides.
Case full(std::vector<std::string> overrides = {}) {
  overrides.insert(overrides.begin(), {"material.law=solid_fluid", "material.card=dem_mu05"});
  return Case::load(cases + "/column", overrides);
}
std::vector<std::string> told(const std::vector<std::string>& overrides) {
  return full(overrides).contradictions();
}

TEST(EffectiveRestitution, ExplainsTheSeedsValue) {
  EXPECT_NEAR(effective_restitution(0.879, 0.5, 0.44), 0.5904, 5e-5);
  EXPECT_NEAR(effective_restitution(0.879, 0.5, 0.0), 0.640, 5e-4);
  EXPECT_NEAR(effective_restitution(0.879, 0.5, 0.4), 0.5935, 5e-5);
  EXPECT_EQ(effective_restitution(0.879, 0.0, 0.4), 0.879);
  // small friction: en - pi/2 mu + 9/2 mu^2
  EXPECT_NEAR(effective_restitution(0.879, 0.05, 0.0),
              0.879 - std::numbers::pi / 2 * 0.05 + 4.5 * 0.0025, 1e-3);
}

TEST(DerivedConstants, AreOfTheGrainsWhereNobodyGivesThem) {
  const std::vector<std::string> bare{"material.card=", "material.law=solid_fluid"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), bare.begin(), bare.end());
    return Case::load(cases + "/column", more).number("material.effective_restitution");
  };
  EXPECT_NEAR(with({}), 0.5904, 5e-5);
  EXPECT_EQ(with({"grains.friction=0"}), 0.879);
  EXPECT_EQ(with({"grains.friction=0.3", "material.tangential_restitution=0.1"}),
            effective_restitution(0.879, 0.3, 0.1));
  EXPECT_EQ(with({"grains.restitution=0.1"}), 0.0);  // the expansion would be negative
  EXPECT_EQ(with({"material.effective_restitution=0.7"}), 0.7);
  EXPECT_EQ(full().number("material.effective_restitution"), 0.6285);  // the card's
  EXPECT_EQ(Case::load(cases + "/column").number("material.effective_restitution"), 0.59);
}

TEST(DerivedConstants, OfAResolvedCaseAreTheSame) {
  const Case c = full({"material.effective_restitution=0"});
  EXPECT_NEAR(c.number("material.effective_restitution"), 0.5904, 5e-5);
  EXPECT_THAT(c.resolved(), HasSubstr("effective_restitution = 0.590"));
}

TEST(Contradictions, NoneOfTheGrainsThatTheCardIsOf) {
  EXPECT_THAT(told({}), IsEmpty());
  EXPECT_THAT(told({"material.card=seed_table1"}), IsEmpty());
  // what only scales, what is within the card's own errors, and softness that the column feels not
  EXPECT_THAT(told({"grains.diameter=0.001", "grains.density=2600"}), IsEmpty());
  EXPECT_THAT(told({"grains.friction=0.52", "grains.restitution=0.89"}), IsEmpty());
  EXPECT_THAT(told({"mpm.young_modulus=1e7"}), IsEmpty());
  EXPECT_THAT(told({"material.stress_ratio=0.7625"}), IsEmpty());
}

TEST(Contradictions, OtherGrainsThanTheCards) {
  EXPECT_THAT(
      told({"grains.friction=0.1"}),
      ElementsAre(AllOf(StartsWith("--set grains.friction=0.1: grains.friction = 0.1 is not "
                                   "0.5, of the grains that the card dem_mu05"),
                        HasSubstr("calibrate"))));
  EXPECT_THAT(told({"grains.restitution=0.5"}), ElementsAre(HasSubstr("is not 0.879")));
  // at p = rho_s g H = 2.5 kPa, (p/E)^(2/3) is 0.018 for the one and 4e-4 for the other
  EXPECT_THAT(told({"mpm.young_modulus=1e6"}),
              ElementsAre(AllOf(HasSubstr("mpm.young_modulus = 1e+06 Pa is not 3e+08 Pa"),
                                HasSubstr("differ by 0.018 d"))));
  EXPECT_THAT(told({"grains.young_modulus=5e6", "geometry.gravity=100"}),
              ElementsAre(HasSubstr("grains.young_modulus = 5e+06 Pa")));
}

TEST(Contradictions, SizesAndRollingThatTheCardsGrainsHaveNot) {
  EXPECT_THAT(told({"grains.size_spread=0.01", "grains.rolling_friction=0.005"}), IsEmpty());
  EXPECT_THAT(told({"grains.size_spread=0.2"}),
              ElementsAre(AllOf(HasSubstr("grains.size_spread = 0.2 is not 0, of the grains"),
                                HasSubstr("critical_void_ratio"))));
  EXPECT_THAT(told({"grains.rolling_friction=0.1"}),
              ElementsAre(HasSubstr("grains.rolling_friction = 0.1 is not 0, of the grains")));
}

TEST(Contradictions, ConstantsSetBesideACardForTheseGrains) {
  EXPECT_THAT(told({"material.stress_ratio=0.9"}),
              ElementsAre(AllOf(HasSubstr("material.stress_ratio = 0.9 is set beside the card"),
                                HasSubstr("0.7625"))));
  EXPECT_THAT(told({"material.critical_void_ratio=0.709"}), ElementsAre(HasSubstr("0.7138")));
  // of other grains the card says nothing
  EXPECT_THAT(told({"material.stress_ratio=0.6", "grains.friction=0.1"}),
              ElementsAre(HasSubstr("grains.friction")));
}

TEST(Contradictions, DissipationThatNoTangentialRestitutionExplains) {
  // the case that dissipates .0007 of its energy where grains lose .86 by friction
  EXPECT_THAT(
      told({"grains.restitution=1", "material.effective_restitution=1", "material.card="}),
      ElementsAre(AllOf(HasSubstr("material.effective_restitution = 1 where the grains have "
                                  "0.718"),
                        HasSubstr("0 and not 0.48"))));
  EXPECT_THAT(told({"material.effective_restitution=0.7"}), ElementsAre(HasSubstr("0.59")));
  for (const char* explained : {"0.59", "0.64", "0.56"})
    EXPECT_THAT(told({std::string("material.effective_restitution=") + explained}), IsEmpty());
}

TEST(Contradictions, OnlyWhatTheLawReads) {
  const auto of = [&](const std::string& law, std::vector<std::string> more) {
    more.insert(more.end(), {"material.law=" + law, "material.card=dem_mu05"});
    return Case::load(cases + "/column", more).contradictions();
  };
  const std::vector<std::string> wrong{"grains.friction=0.1", "grains.restitution=0.5"};
  EXPECT_THAT(of("mu_i", wrong), IsEmpty());
  EXPECT_THAT(of("lade_duncan", wrong), ElementsAre(HasSubstr("grains.friction")));
  EXPECT_EQ(of("solid_fluid", wrong).size(), 2u);
  EXPECT_THAT(of("critical_state", {"material.effective_restitution=1"}), IsEmpty());
  EXPECT_THAT(of("solid_fluid", {"material.effective_restitution=1", "material.collisions=false"}),
              IsEmpty());
}

class Cards : public test::Files {};

TEST_F(Cards, OfGrainsWithSizesAndRolling) {
  const std::string card = file("rolling.toml", R"([grains]
diameter = 0.002
density = 2532
young_modulus = 3e8
restitution = 0.879
friction = 0.5
size_spread = 0.2
rolling_friction = 0.1

[material]
stress_ratio = 0.8
)");
  const std::vector<std::string> own{"material.card=" + card, "grains.size_spread=0.2",
                                     "grains.rolling_friction=0.1"};
  EXPECT_THAT(told(own), IsEmpty());
  EXPECT_THAT(told({own[0]}), ElementsAre(HasSubstr("is not 0.2, of the grains"),
                                          HasSubstr("is not 0.1, of the grains")));
}

TEST_F(Cards, WithoutGrainsAreHeldAgainstTheDerivedValueAlone) {
  file("plain.toml", "[material]\nstress_ratio = 0.8\neffective_restitution = 0.9\n");
  const auto path = file("case.toml", "extends = \"" + cases +
                                          "/column/case.toml\"\n[material]\nlaw = "
                                          "'solid_fluid'\ncard = 'plain'\n");
  EXPECT_THAT(Case::load(path).contradictions(),
              ElementsAre(HasSubstr("plain.toml:3: material.effective_restitution = 0.9")));
  EXPECT_THAT(
      Case::load(path, {"grains.friction=0.01", "grains.restitution=0.92"}).contradictions(),
      IsEmpty());
}

TEST_F(Cards, SayAllOfTheirGrainsOrNothing) {
  file("half.toml", "[grains]\nfriction = 0.5\n[material]\nstress_ratio = 0.8\n");
  const auto path = file(
      "case.toml", "extends = \"" + cases + "/column/case.toml\"\n[material]\ncard = 'half'\n");
  EXPECT_THAT(test::refusal([&] { Case::load(path); }),
              HasSubstr("half.toml:1: missing key 'grains.diameter'"));
}

}  // namespace
}  // namespace grainpair
