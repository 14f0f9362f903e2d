// Element tests, paths of a material point and studies: the same validator for all.
#include <gmock/gmock.h>

#include <set>

#include "cases/file.hpp"
#include "cases/kinds.hpp"
#include "tests/cpp/case_files.hpp"

namespace grainpair {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string cases = GRAINPAIR_SOURCE "/cases";

const std::string shear = R"(title = "Shear"
[element]
test = "shear"
seeds = [1, 2]
[grains]
diameter = 2e-3
density = 2532
young_modulus = 3e8
restitution = 0.879
friction = 0.5
[shear]
solid_fractions = [0.5, 0.55]
rates = [20, 500.0]
strain = 10.0
strain_discarded = 3.0
)";

const std::string path = R"(case = "column"
set = ["material.law=mu_i", "material.young_modulus=1e5"]
[start]
stress = [1e3, 2e3, 1e3, 0, 0, 0]
[[leg]]
path = "strain"
rate = [0.1, -0.2, 0, 0, 0, 0.5]
duration = 0.1
steps = 10
[[leg]]
path = "simple_shear"
constant = "stress"
rate = 1
strain = -0.1
steps = 5
)";

const std::string study = R"([frontier]
timeout = 900.0
[[frontier.series]]
name = "law and cell size"
engine = "mpm"
set."time.maximum" = 3
vary."mpm.cell_size" = [0.004, 0.002]
vary."material.law" = ["mu_i"]
[atlas]
timeout = 60.0
[[atlas.plane]]
name = "grains"
engine = "dem"
along = "dem.time_step_fraction"
between = [0.05, 3.0]
across = "impact speed [m/s]"
values = [0.01, 0.1]
tolerance = 0.05
[[atlas.plane]]
name = "continuum"
engine = "mpm"
along = "mpm.time_step_fraction"
between = [1.0, 5.0]
across = "mpm.points_per_cell"
values = [1, 2]
[convergence]
timeout = 60.0
[[convergence.group]]
name = "all"
[[convergence.group.change]]
name = "steps half as long"
set = { "mpm.time_step_fraction" = 0.25 }
limits = { run_out = 0.02 }
[ladder]
timeout = 60.0
[[ladder.rung]]
name = "four cells"
cells = 4
)";

const std::string& sample(Kind kind) {
  return kind == Kind::element ? shear : kind == Kind::point ? path : study;
}

/// Files of a kind that differ from the sample above in one place.
class Kinds : public test::Files {
 protected:
  std::string changed(Kind kind, const std::string& from, const std::string& to) {
    std::string text = sample(kind);
    const auto found = text.find(from);
    EXPECT_NE(found, std::string::npos) << from;
    return file("file.toml", text.replace(found, from.size(), to));
  }
};

TEST_F(Kinds, EveryFileOfTheProjectIsAcceptedAndPrintsToItself) {
  int elements = 0, studies = 0;
  for (const auto& entry : fs::recursive_directory_iterator(cases)) {
    const std::string file_name = entry.path().filename().string();
    if (!file_name.ends_with(".toml") || file_name.ends_with("schema.toml")) continue;
    const std::string place = entry.path().string();
    const toml::table text = toml::parse_file(place);
    const bool element = text.contains("element");
    const bool study_file = file_name == "study.toml" || file_name == "ladder.toml";
    if (!element && !study_file) continue;
    const Kind kind = element ? Kind::element : Kind::study;
    const std::string once = read_document(place, kind).values.as_toml();
    EXPECT_EQ(read_document(file("again.toml", once), kind).values.as_toml(), once) << place;
    ++(element ? elements : studies);
  }
  EXPECT_GE(elements, 6);
  EXPECT_GE(studies, 4);
}

TEST_F(Kinds, ValuesAndDefaultsAreRead) {
  const Values element = read_document(file("shear.toml", shear), Kind::element).values;
  EXPECT_EQ(element.number("grains.density"), 2532.0);
  EXPECT_EQ(element.number("grains.poisson_ratio"), 0.3);
  EXPECT_EQ(element.integer("element.grains"), 500);
  EXPECT_THAT(element.numbers("shear.rates"), ElementsAre(20.0, 500.0));
  EXPECT_FALSE(element.has("cooling.samples"));  // another test's default

  const Values point = read_document(file("path.toml", path), Kind::point).values;
  EXPECT_THAT(point.words("set"), ElementsAre("material.law=mu_i", "material.young_modulus=1e5"));
  EXPECT_EQ(point.integer("every"), 1);
  EXPECT_FALSE(point.table("start").has("void_ratio"));
  EXPECT_EQ(point.table("start").numbers("stress").size(), 6u);
  const auto legs = point.tables("leg");
  ASSERT_EQ(legs.size(), 2u);
  EXPECT_EQ(legs[0].numbers("rate")[1], -0.2);
  EXPECT_EQ(legs[1].number("rate"), 1.0);
  EXPECT_EQ(legs[1].word("constant"), "stress");

  const Values recipes = read_document(file("study.toml", study), Kind::study).values;
  EXPECT_EQ(recipes.table("ladder").tables("rung")[0].word("engine"), "mpm");
  EXPECT_EQ(recipes.table("convergence").tables("group")[0].integer("runs"), 1);
}

TEST_F(Kinds, WhatAStudyVariesKeepsItsOrderAndItsTypes) {
  const std::string text = read_document(file("study.toml", study), Kind::study).values.as_toml();
  EXPECT_THAT(text, HasSubstr("vary = { \"mpm.cell_size\" = [0.004, 0.002], \"material.law\" = "
                              "[\"mu_i\"] }"));
  EXPECT_THAT(text, HasSubstr("set = { \"time.maximum\" = 3 }"));
  EXPECT_THAT(text, HasSubstr("values = [1, 2]"));
}

// Each refusal: what is put for what in the sample, and how its line must start and end.
struct Refused {
  Kind kind;
  const char *from, *to;
  const char* start;  // after the file's name
  const char* end;
};

class KindRefusals : public Kinds, public ::testing::WithParamInterface<Refused> {};

TEST_P(KindRefusals, NameFileLineReasonAndHint) {
  const auto& [kind, from, to, start, end] = GetParam();
  const std::string place = changed(kind, from, to);
  const std::string line = test::refusal([&] { read_document(place, GetParam().kind); });
  EXPECT_THAT(line, AllOf(StartsWith(place + start), EndsWith(end)));
  EXPECT_EQ(line.find('\n'), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    ElementText, KindRefusals,
    ::testing::Values(
        Refused{Kind::element, "friction", "friktion", ":10: unknown key 'grains.friktion'",
                "Did you mean 'friction'?"},
        Refused{Kind::element, "[grains]", "[grain]", ":5: unknown table 'grain'",
                "Did you mean 'grains'?"},
        Refused{Kind::element, "friction = 0.5\n", "", ": missing key 'grains.friction'", ")"},
        Refused{Kind::element, "strain = 10.0", "strain = 'ten'",
                ":14: shear.strain must be a number", "not the string \"ten\""},
        Refused{Kind::element, "[20, 500.0]", "20.0",
                ":13: shear.rates must be a list of at least one value", "real number 20"},
        Refused{Kind::element, "[20, 500.0]", "[]", ":13: shear.rates must be a list of at least",
                "not an empty array"},
        Refused{Kind::element, "[20, 500.0]", "[20, 'x']",
                ":13: each of shear.rates must be a number", "not the string \"x\""},
        Refused{Kind::element, "[20, 500.0]", "[\n20,\n-1.0]",
                ":15: shear.rates = -1 1/s is out of bounds (outside 0.001 .. 10000 1/s)", "."},
        Refused{Kind::element, "seeds = [1, 2]", "seeds = [1.5]",
                ":4: each of element.seeds must be an integer", "1.5"},
        Refused{Kind::element, "\"shear\"", "\"sheer\"",
                ":3: unknown element.test 'sheer' (known: shear, bumpy_shear",
                "Did you mean 'shear'?"},
        Refused{Kind::element, "\"shear\"", "\"cooling\"",
                ":12: unknown key 'shear.solid_fractions'",
                "(it goes with element.test = shear alone)"},
        Refused{Kind::element, "test = \"shear\"\n", "", ": missing key 'element.test'", ")"}));

INSTANTIATE_TEST_SUITE_P(
    PathText, KindRefusals,
    ::testing::Values(
        Refused{Kind::point, "case = \"column\"\n", "", ": missing key 'case'", ")"},
        Refused{Kind::point, "case = \"column\"", "case = 3", ":1: case must be a string",
                "the integer 3"},
        Refused{Kind::point, "material.law=", "material.lew=", ":2: unknown key 'material.lew'",
                "Did you mean 'law'?"},
        Refused{Kind::point, "law=mu_i", "law=mu_y", ":2: unknown material.law 'mu_y'",
                "Did you mean 'mu_i'?"},
        Refused{Kind::point, "law=mu_i", "law", ":2: no value", ")"},
        Refused{Kind::point, "stress = [1e3, 2e3,", "stress = [1e3,",
                ":4: start.stress must be a list of 6 values", "not one of 5"},
        Refused{Kind::point, "[1e3, 2e3, 1e3", "[0, 0, 0",
                ":11: this leg holds a stress that is zero", ")"},
        Refused{Kind::point, "duration = 0.1", "duration = 0",
                ":8: leg.duration = 0 s must be positive", ")"},
        Refused{Kind::point, "duration = 0.1\n", "", ":5: missing key 'leg.duration'", ")"},
        Refused{Kind::point, "rate = [0.1, -0.2, 0, 0, 0, 0.5]", "rate = 1.0",
                ":7: leg.rate must be a list of 6 values", "real number 1"},
        Refused{Kind::point, "rate = 1\n", "rate = 1\nduration = 3.0\n",
                ":14: unknown key 'leg.duration' (it goes with leg.path = rest | strain alone)",
                ")"},
        Refused{Kind::point, "steps = 10", "steps = 0", ":9: leg.steps = 0 steps is out of bounds",
                "."},
        Refused{Kind::point, "strain = -0.1", "strain = 0.0", ":14: leg.strain = 0 goes nowhere",
                ")"},
        Refused{Kind::point, "\"simple_shear\"", "\"twist\"",
                ":11: unknown leg.path 'twist' (known: biaxial", "."}));

INSTANTIATE_TEST_SUITE_P(
    StudyText, KindRefusals,
    ::testing::Values(
        Refused{Kind::study, "[frontier]", "[frontieer]", ":1: unknown table 'frontieer'",
                "Did you mean 'frontier'?"},
        Refused{Kind::study, "[frontier]\ntimeout = 900.0\n", "[frontier]\n",
                ":1: missing key 'frontier.timeout'", ")"},
        Refused{Kind::study, "timeout = 900.0", "timeout = -900.0",
                ":2: frontier.timeout = -900 s is out of bounds", "."},
        Refused{Kind::study, "[[frontier.series]]", "[[frontier.serie]]",
                ":3: unknown key 'frontier.serie'", "Did you mean 'series'?"},
        Refused{Kind::study, "[[frontier.series]]", "[frontier.series]",
                ":3: frontier.series must be tables, [[frontier.series]]", "not a table"},
        Refused{Kind::study, "engine = \"mpm\"\n", "", ":3: missing key 'frontier.series.engine'",
                ")"},
        Refused{Kind::study, "engine = \"mpm\"", "engin = \"mpm\"",
                ":5: unknown key 'frontier.series.engin'", "Did you mean 'engine'?"},
        Refused{Kind::study, "\"mpm\"", "\"mmp\"", ":5: unknown frontier.series.engine 'mmp'",
                "Did you mean 'mpm'?"},
        Refused{Kind::study, "set.\"time.maximum\" = 3", "set.\"time.maximun\" = 3",
                ":6: unknown key 'time.maximun'", "Did you mean 'maximum'?"},
        Refused{Kind::study, "set.\"time.maximum\" = 3", "set.\"time.maximum\" = 3e9",
                ":6: time.maximum = 3e+09 sqrt(H/g) is out of bounds", "."},
        Refused{Kind::study, "set.\"time.maximum\" = 3", "set.\"extends\" = 'x.toml'",
                ":6: only a file can extend another", ")"},
        Refused{Kind::study, "set.\"time.maximum\" = 3", "set = 3",
                ":6: frontier.series.set must be a table", "the integer 3"},
        Refused{Kind::study, "[\"mu_i\"]", "[\"mu_y\"]", ":8: unknown material.law 'mu_y'",
                "Did you mean 'mu_i'?"},
        Refused{Kind::study, "[\"mu_i\"]", "\"mu_i\"",
                ":8: frontier.series.vary.material.law must be a list of at least one value",
                "not the string \"mu_i\""},
        Refused{Kind::study, "dem.time_step_fraction", "dem.time_step_fractoin",
                ":14: unknown key 'dem.time_step_fractoin'", "Did you mean 'time_step_fraction'?"},
        Refused{Kind::study, "tolerance = 0.05\n", "", ":11: missing key 'atlas.plane.tolerance'",
                ")"},
        Refused{Kind::study, "between = [1.0, 5.0]", "between = [1.0]",
                ":23: atlas.plane.between must be a list of 2 values", "not one of 1"},
        Refused{Kind::study, "between = [1.0, 5.0]", "between = [1.0, 50.0]",
                ":23: mpm.time_step_fraction = 50 is out of bounds", "."},
        Refused{Kind::study, "values = [1, 2]", "values = [1, 2.5]",
                ":25: mpm.points_per_cell must be an integer", "2.5"},
        Refused{Kind::study, "values = [1, 2]", "values = [1, 2]\ntolerance = 0.05",
                ":26: unknown key 'atlas.plane.tolerance'", "alone)"},
        Refused{Kind::study, "run_out = 0.02", "runout = 0.02",
                ":33: unknown key 'convergence.group.change.limits.runout'",
                "Did you mean 'run_out'?"},
        Refused{Kind::study, "[[convergence.group]]\nname = \"all\"", "[convergence.group]",
                ":28: convergence.group must be tables", "not a table"},
        Refused{
            Kind::study, "cells = 4", "cells = 4\nengine = 'dem'",
            ":38: unknown key 'ladder.rung.cells' (it goes with ladder.rung.engine = mpm alone)",
            ")"}));

TEST_F(Kinds, FilesThatAreNoInputAreRefused) {
  for (const Kind kind : {Kind::element, Kind::point, Kind::study}) {
    const auto said = [&](const std::string& place) {
      return test::refusal([&] { read_document(place, kind); });
    };
    EXPECT_THAT(said((folder_ / "none.toml").string()), EndsWith("(No such file or directory)"));
    EXPECT_THAT(said(file("empty.toml", "")), HasSubstr("is empty"));
    EXPECT_THAT(said(file("bad.toml", "x = \n")), HasSubstr("bad.toml:1: not valid TOML"));
  }
}

TEST_F(Kinds, AConditionNamesAKeyBesideItAndWordsThatItMayBe) {
  const std::function<void(const std::vector<Key>&)> look = [&](const std::vector<Key>& keys) {
    for (const Key& key : keys) {
      for (const auto& [other, words] : key.when) {
        const Key* choice = find_key(keys, other);
        ASSERT_TRUE(choice) << key.name;
        for (const std::string& word : words)
          EXPECT_THAT(choice->choices, ::testing::Contains(word)) << key.name;
      }
      EXPECT_TRUE(key.of.empty() || find_key(keys, key.of)) << key.name;
      look(key.keys);
    }
  };
  for (const Kind kind : {Kind::scene, Kind::element, Kind::point, Kind::study}) look(schema(kind));
}

TEST(Describe, TellsBothKeysOfAName) {
  const std::string text = describe_keys("leg.rate", Kind::point);
  EXPECT_THAT(text, AllOf(StartsWith("leg.rate"), HasSubstr("list of 6: number [1/s]"),
                          HasSubstr("> 0 [1/s] (required, where path = biaxial")));
  EXPECT_EQ(describe_keys("leg.rates", Kind::point), "");
}

TEST(Failures, EveryCodeHasANameOfItsOwnThatEndsTheLine) {
  std::set<std::string> names;
  for (const auto& failure : failure_codes) {
    names.insert(failure.name);
    const SolverError error(failure.code, "point {}: gone", 3);
    EXPECT_EQ(error.code, failure.code);
    EXPECT_EQ(std::string(error.what()), fmt::format("point 3: gone [{}]", failure.name));
  }
  EXPECT_EQ(names.size(), std::size(failure_codes));
}

}  // namespace
}  // namespace grainpair
