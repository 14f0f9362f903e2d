#include "cases/case.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "cases/schema.hpp"
#include "tests/cpp/case_files.hpp"

namespace grainpair {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string cases = GRAINPAIR_SOURCE "/cases";

/// Scenes that differ from the seed's in a few lines.
class CaseFiles : public test::Files {
 protected:
  /// A case that is the seed's but for `text`, which starts at line 2.
  std::string variant(const std::string& text) {
    return file("variant.toml", "extends = \"" + cases + "/column/case.toml\"\n" + text);
  }
  std::string refusal(const std::string& path, const std::vector<std::string>& overrides = {}) {
    return test::refusal([&] { Case::load(path, overrides); });
  }
};

TEST_F(CaseFiles, EverySceneOfTheProjectIsAccepted) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(cases)) {
    std::ifstream file(entry.path() / "case.toml");
    const std::string text(std::istreambuf_iterator<char>(file), {});
    // Element tests have a schema of their own.
    if (text.empty() || text.find("[element]") != std::string::npos) continue;
    EXPECT_NO_THROW(Case::load(entry.path().string())) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 3);
}

TEST_F(CaseFiles, ValuesOfEveryTypeAreRead) {
  const Case c = Case::load(cases + "/column");
  EXPECT_EQ(c.number("grains.diameter"), 0.002);
  EXPECT_EQ(c.integer("mpm.points_per_cell"), 2);
  EXPECT_EQ(c.number("mpm.points_per_cell"), 2.0);
  EXPECT_TRUE(c.flag("material.collisions"));
  EXPECT_EQ(c.word("walls.base"), "glued");
  EXPECT_THROW(c.number("geometry.hight"), std::logic_error);
}

TEST_F(CaseFiles, EveryKeyHasAValue) {
  const Case c = Case::load(cases + "/column");
  for (const Key& key : schema()) {
    if (key.optional) {  // of a law or a scene that this case has not; every collapse has a floor
      EXPECT_EQ(c.has(key.name), key.name == "geometry.floor_length");
      continue;
    }
    if (key.type == Key::Type::real || key.type == Key::Type::integer) {
      EXPECT_THAT(c.number(key.name), AllOf(::testing::Ge(key.lower), ::testing::Le(key.upper)));
    } else if (key.type == Key::Type::boolean) {
      EXPECT_NO_THROW(c.flag(key.name));
    } else {
      EXPECT_NO_THROW(c.word(key.name));
    }
  }
}

TEST_F(CaseFiles, DefaultsAreThemselvesInBounds) {
  for (const Key& key : schema()) {
    if (!key.standard) continue;
    if (const auto* real = std::get_if<double>(&*key.standard)) {
      EXPECT_THAT(*real, AllOf(::testing::Ge(key.lower), ::testing::Le(key.upper))) << key.name;
    }
    if (key.type == Key::Type::choice) {
      EXPECT_THAT(key.choices, ::testing::Contains(std::get<std::string>(*key.standard)));
    }
  }
}

TEST_F(CaseFiles, NearestGiverWins) {
  // The card says 380, the extended file 400, the file 500, the override 600.
  file("materials/soft.toml", "[material]\nbulk_stiffness = 380\nshear_stiffness = 10\n");
  file("base.toml", "extends = \"" + cases +
                        "/column/case.toml\"\n[material]\nbulk_stiffness = 400.0\n"
                        "shear_stiffness = 20.0\n");
  const auto top = file("top.toml", "extends = 'base.toml'\n[material]\nbulk_stiffness = 500\n");
  const auto number = [](const std::string& path, const char* key,
                         std::vector<std::string> words = {}) {
    words.emplace_back("mpm.stiffness=as given");
    return Case::load(path, words).number(key);
  };
  EXPECT_EQ(number(top, "material.bulk_stiffness", {"material.bulk_stiffness=600"}), 600);
  EXPECT_EQ(number(top, "material.bulk_stiffness"), 500);
  EXPECT_EQ(number(top, "material.shear_stiffness"), 20);
  const auto carded = variant("[material]\ncard = 'soft'\n");
  EXPECT_EQ(number(carded, "material.shear_stiffness"), 10);
}

TEST_F(CaseFiles, CardIsFoundByNameAboveTheCaseOrByPath) {
  file("materials/mine.toml", "[material]\ndilatancy = 0.7\n");
  const auto deep = file(
      "a/b/case.toml", "extends = \"" + cases + "/column/case.toml\"\n[material]\ncard = 'mine'\n");
  EXPECT_EQ(Case::load(deep).number("material.dilatancy"), 0.7);
  EXPECT_EQ(Case::load((folder_ / "a/b").string()).number("material.dilatancy"), 0.7);
  const auto named = variant("[material]\ncard = 'materials/mine.toml'\n");
  EXPECT_EQ(Case::load(named).number("material.dilatancy"), 0.7);
}

TEST_F(CaseFiles, CardOfAnOverrideIsFoundAsTheFilesOwnIs) {
  file("mine.toml", "[material]\ndilatancy = 0.7\n");
  file("materials/own.toml", "[material]\ndilatancy = 0.6\n");
  const auto path = variant("");
  const auto with = [&](const std::string& card) {
    return Case::load(path, {"material.card=" + card}).number("material.dilatancy");
  };
  EXPECT_EQ(with("mine"), 0.7);  // whatever folder the program works in
  EXPECT_EQ(with("mine.toml"), 0.7);
  EXPECT_EQ(with("own"), 0.6);
  EXPECT_EQ(with("materials/own.toml"), 0.6);
  EXPECT_EQ(with((folder_ / "mine.toml").string()), 0.7);
}

TEST_F(CaseFiles, CardsOfThisCloneAreFoundFromAnywhere) {
  const auto card = [&](const std::string& name) {
    return Case::load(variant("[material]\ncard = '" + name + "'\n")).resolved();
  };
  EXPECT_NE(card("dem_mu05"), card("seed_table1"));
  EXPECT_THAT(card("dem_mu05.toml"), HasSubstr("card = \"dem_mu05.toml\""));
}

TEST_F(CaseFiles, CardThatIsNowhereIsRefusedWithThePlaces) {
  const std::string beside = folder_.string(), own = cases + "/materials";
  for (const std::string& card : {std::string("nope"), std::string("x/nope.toml")}) {
    const std::string line = refusal(variant(""), {"material.card=" + card});
    EXPECT_THAT(
        line, AllOf(StartsWith("--set material.card=" + card), HasSubstr(beside), HasSubstr(own)));
  }
}

TEST_F(CaseFiles, ResolvedTextIsACaseThatResolvesToItself) {
  // Reals whose shortest form is an exponent, a bare integer or many digits; text that needs
  // escapes.
  const auto path =
      variant("title = 'a \"quoted\" \\ and \ttab'\n[initial]\ngranular_temperature = 1e-15\n");
  const std::string once =
      Case::load(path, {"grains.young_modulus=5e6", "grains.friction=0.1000000000000001"})
          .resolved();
  const std::string twice = Case::load(file("resolved.toml", once)).resolved();
  EXPECT_EQ(once, twice);
  EXPECT_THAT(once, HasSubstr("friction = 0.1000000000000001\n"));
}

TEST_F(CaseFiles, OverridesTakeBareWords) {
  const Case c =
      Case::load(cases + "/column", {"walls.base=coulomb", "walls.base_friction=0.3", "title=12"});
  EXPECT_EQ(c.word("walls.base"), "coulomb");
  EXPECT_EQ(c.word("title"), "12");
}

TEST_F(CaseFiles, TextIsVerbatim) {
  const std::string text = "# a comment\nextends = \"" + cases + "/column/case.toml\"\n";
  EXPECT_EQ(Case::load(file("commented.toml", text)).text(), text);
}

// Each refusal: the text from line 2 on, and how its line must start and end.
struct Refused {
  const char* text;
  const char* start;  // after the file's name
  const char* end;
};

class Refusals : public CaseFiles, public ::testing::WithParamInterface<Refused> {};

TEST_P(Refusals, NameFileLineReasonAndHint) {
  const auto path = variant(GetParam().text);
  EXPECT_THAT(refusal(path), AllOf(StartsWith(path + GetParam().start), EndsWith(GetParam().end)));
}

INSTANTIATE_TEST_SUITE_P(
    CaseText, Refusals,
    ::testing::Values(
        Refused{"[grains]\nfriktion = 0.3",
                ":3: unknown key 'grains.friktion' (known: diameter, density",
                "Did you mean 'friction'?"},
        Refused{"[grain]\nfriction = 0.3", ":2: unknown table 'grain'", "Did you mean 'grains'?"},
        Refused{"[grains]\nheight = 0.3", ":3: unknown key 'grains.height'",
                "Did you mean 'geometry.height'?"},
        Refused{"[mpm]\nrelaxation_time = 3e-3", ":3: 'mpm.relaxation_time' is no more",
                "Write mpm.velocity_relaxation, in sqrt(H/g)"},
        Refused{"titel = 'x'", ":2: unknown key 'titel'", "Did you mean 'title'?"},
        Refused{"grains = 3", ":2: 'grains' is a table", ")"},
        Refused{"[mpm.inner]\nx = 1", ":2: unknown table 'mpm.inner'", "."},
        Refused{"[material]\nlaw = 'lade_dunkan'",
                ":3: unknown material.law 'lade_dunkan' (known: linear",
                "Did you mean 'lade_duncan'?"},
        Refused{"[geometry]\nheight = 'tall'", ":3: geometry.height must be a number",
                "not the string \"tall\""},
        Refused{"[geometry]\nheight = 'two\\nlines'", ":3: geometry.height must be a number", "\""},
        Refused{"[geometry]\nheight = [0.1]", ":3: geometry.height must be a number",
                "not an array"},
        Refused{"[mpm]\npoints_per_cell = 2.5", ":3: mpm.points_per_cell must be an integer",
                "2.5"},
        Refused{"[output]\ncontacts = 1", ":3: output.contacts must be true or false",
                "the integer 1"},
        Refused{"[grains]\ndiameter = -0.002", ":3: grains.diameter = -0.002 m is out of bounds",
                "."},
        Refused{"[grains]\ndiameter = 2.0", ":3: grains.diameter = 2 m is out of bounds",
                "Is it in m? 1000 times less would fit."},
        Refused{"[grains]\ndensity = 2.532", ":3: grains.density = 2.532 kg/m3 is out of bounds",
                "Is it in kg/m3? 1000 times more would fit."},
        Refused{"[grains]\nfriction = nan", ":3: grains.friction = nan is not a finite number",
                ")"},
        Refused{"[grains]\ndensity = inf", ":3: grains.density = inf is not a finite number", ")"},
        Refused{"[grains\nfriction = 0.3", ":2: not valid TOML", ")"},
        Refused{"[walls]\nbase_friction = 0.3",
                ":3: walls.base_friction = 0.3 contradicts walls.base", ")"},
        Refused{"[walls]\nbase = 'coulomb'",
                ":3: walls.base = \"coulomb\" without walls.base_friction", ")"},
        Refused{"[walls]\nleft_friction = 0.3",
                ":3: walls.left_friction = 0.3 contradicts walls.left", ")"},
        Refused{"[walls]\nleft = 'coulomb'",
                ":3: walls.left = \"coulomb\" without walls.left_friction", ")"},
        Refused{"[walls]\ngate_speed = 1", ":3: walls.gate_speed = 1 contradicts walls.gate", ")"},
        Refused{"[walls]\ngate = 'lifted'", ":3: walls.gate = \"lifted\" without walls.gate_speed",
                ")"},
        Refused{"[walls]\ngate = 'lifted'\ngate_speed = 0", ":4: walls.gate_speed = 0 contradicts",
                ")"},
        Refused{"[geometry]\nfloor_length = 0.1", ":3: geometry.floor_length = 0.1 is not longer",
                ")"},
        Refused{"[mpm]\ncell_size = 0.05",
                ":3: mpm.cell_size = 0.05 is more than 0.25 of geometry.length", ")"},
        Refused{"[grains]\ndiameter = 0.03", ":3: grains.diameter = 0.03 is more than 0.25", ")"},
        Refused{"[grains]\ndiameter = 1e-5\n[geometry]\nheight = 10.0", ":5: geometry.height = 10",
                ")"},
        Refused{"[material]\ncard = 'nope'", ":3: no material card 'nope'", ".toml."}));

TEST_F(CaseFiles, PeriodicImagesOfAWedgeAreRefused) {
  EXPECT_THAT(refusal(cases + "/column", {"geometry.dimension=axisymmetric"}),
              HasSubstr("walls.front_back = \"periodic\" contradicts"));
}

TEST_F(CaseFiles, ElementTestsAreToldFromScenes) {
  EXPECT_THAT(refusal(cases + "/shear"), HasSubstr("this is an element test, not a scene"));
}

TEST_F(CaseFiles, MissingKeyIsNamedWithItsMeaning) {
  EXPECT_THAT(refusal(file("little.toml", "title = 'x'\n[geometry]\nheight = 0.1\n")),
              HasSubstr("missing key 'geometry.length' (Length L0"));
}

TEST_F(CaseFiles, FilesThatAreNoCaseFilesAreRefused) {
  EXPECT_THAT(refusal(file("empty.toml", "")), HasSubstr("is empty"));
  EXPECT_THAT(refusal(file("binary.toml", std::string("\x89HDF\0\1\2", 7))),
              HasSubstr("binary data"));
  EXPECT_THAT(refusal(file("latin1.toml", "title = '\xe9'")), HasSubstr(":1: not valid TOML"));
  EXPECT_THAT(refusal(file("long.toml", std::string(2 << 20, '#'))),
              HasSubstr("longer than 1 MiB"));
  EXPECT_THAT(refusal((folder_ / "none.toml").string()),
              EndsWith("cannot be read (No such file or directory)"));
  EXPECT_THAT(refusal(folder_.string()),
              EndsWith("/case.toml: cannot be read (No such file or directory)"));
}

TEST_F(CaseFiles, ExtendingInACircleIsRefused) {
  file("b.toml", "extends = 'a.toml'\n");
  const auto a = file("a.toml", "extends = 'b.toml'\n");
  EXPECT_THAT(refusal(a), AllOf(HasSubstr("b.toml:1: extends"), HasSubstr("circle")));
  EXPECT_THAT(refusal(variant("") + "x"), HasSubstr("cannot be read"));
  EXPECT_THAT(refusal(file("lost.toml", "extends = 'none.toml'")), HasSubstr("does not exist"));
}

TEST_F(CaseFiles, MistakesInWhatAFileRestsOnAreFoundThere) {
  const auto base =
      file("base.toml", "extends = \"" + cases + "/column/case.toml\"\n[geometry]\nheight = -1\n");
  // The file overrides the bad value; it is a mistake all the same.
  EXPECT_THAT(refusal(file("top.toml", "extends = 'base.toml'\n[geometry]\nheight = 0.1\n")),
              StartsWith(base + ":3: geometry.height = -1"));
  file("materials/odd.toml", "[geometry]\nheight = 0.1\n");
  EXPECT_THAT(refusal(variant("[material]\ncard = 'odd'")),
              HasSubstr("odd.toml:1: 'geometry' does not belong in a material card"));
}

TEST_F(CaseFiles, BadOverridesAreRefused) {
  const auto say = [&](const char* assignment) { return refusal(cases + "/column", {assignment}); };
  EXPECT_THAT(say("mpm.cell_size"), HasSubstr("no value"));
  EXPECT_THAT(say("mpm.cellsize=1"), HasSubstr("Did you mean 'cell_size'?"));
  EXPECT_THAT(say("mpm.cell_size=abc"),
              StartsWith("--set mpm.cell_size=abc: mpm.cell_size must be a number"));
  EXPECT_THAT(say("walls.base=glue"), HasSubstr("Did you mean 'glued'?"));
  EXPECT_THAT(say("extends=x.toml"), HasSubstr("only a file can extend"));
}

}  // namespace
}  // namespace grainpair
