#include "mpm/programs/point.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

namespace grainpair {
namespace {

/// Writes a path file beside the others of this run and drives it.
class PointPaths : public testing::Test {
 protected:
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() /
      ("grainpair_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
  void SetUp() override { std::filesystem::create_directories(folder); }
  void TearDown() override { std::filesystem::remove_all(folder); }

  std::string file(const std::string& text) {
    const auto path = folder / "path.toml";
    std::ofstream(path) << "case = \"" GRAINPAIR_SOURCE "/cases/column\"\n" << text;
    return path.string();
  }
  PointHistory driven(const std::string& text) { return drive(PointPath::load(file(text))); }
  std::string refused(const std::string& text) {
    try {
      PointPath::load(file(text));
    } catch (const CaseError& error) {
      return error.what();
    }
    return "";
  }
};

const std::string full = "set = [\"material.law=solid_fluid\"]\n";

TEST_F(PointPaths, CoolingFollowsHaff) {
  const auto history = driven(full + R"(
[start]
void_ratio = 2.333333
granular_temperature = 1e-2
[[leg]]
path = "rest"
duration = 0.09
steps = 4000
)");
  // hard limit, 54.7 /s; softness slows it by t_c omega = 7e-3 at most, and decreasing
  const double expected = 1e-2 / std::pow(1.0 + 54.7 * 0.09, 2);
  EXPECT_NEAR(history["granular_temperature"].back(), expected, 0.02 * expected);
  EXPECT_NEAR(history["fluctuation"].back() + history["regime_4_dissipation"].back(),
              history["fluctuation"].front(), 1e-14);
}

TEST_F(PointPaths, SteadyShearGivesTheClosuresTable) {
  const auto history = driven(full + R"(
[start]
void_ratio = 0.754385964912  # solid fraction 0.57
[[leg]]
path = "simple_shear"
rate = 10.0
strain = 5.0
steps = 50000
)");
  EXPECT_NEAR(history["p_c"].back(), 40.0, 0.004 * 40.0);
  EXPECT_NEAR(history["sigma_c_xy"].back(), 20.4, 0.004 * 20.4);
  EXPECT_NEAR(history["granular_temperature"].back() / (0.02 * 0.02), 0.2872, 0.001);
  EXPECT_EQ(history["regime"].back(), 4.0);
}

TEST_F(PointPaths, TriaxialCompressionHoldsTheConfinementAndEndsOnTheCone) {
  const auto history = driven(R"(set = ["material.law=critical_state"]
[start]
void_ratio = 0.69
pressure = 1e4
[[leg]]
path = "triaxial"
rate = 1.0
strain = 0.3
steps = 3000
)");
  const auto &xx = history["sigma_q_xx"], &yy = history["sigma_q_yy"], &zz = history["sigma_q_zz"];
  for (std::size_t i = 0; i < xx.size(); ++i) {
    ASSERT_NEAR(xx[i], 1e4, 1e-5);
    ASSERT_NEAR(zz[i], 1e4, 1e-5);
  }
  EXPECT_NEAR((yy.back() - xx.back()) / history["p_q"].back(), 0.9, 1e-6);  // q/p = M_c
  EXPECT_GT(history["void_ratio"].back(), 0.70);                            // dilates towards e_c
  EXPECT_GT(history["plastic_dissipation"].back(), 0.0);
}

TEST_F(PointPaths, IsotropicLoadingAndUnloadingIsElastic) {
  const auto history = driven(full + R"(
[start]
void_ratio = 0.65
pressure = 1e3
[[leg]]
path = "isotropic"
rate = 1.0
strain = 1e-3
steps = 100
[[leg]]
path = "isotropic"
rate = 1.0
strain = -1e-3
steps = 100
)");
  EXPECT_NEAR(history["p_q"].back(), 1e3, 1e-7);  // K = 4 MPa times the round-off of 200 strains
  EXPECT_EQ(history["plastic_dissipation"].back(), 0.0);
}

TEST_F(PointPaths, CyclicShearReturnsAndDissipates) {
  const auto history = driven(full + R"(
[start]
void_ratio = 0.70
pressure = 1e4
[[leg]]
path = "simple_shear"
rate = 1.0
strain = 0.01
cycles = 2
steps = 8000
)");
  EXPECT_NEAR(history["strain_xy"].back(), 0.0, 1e-12);
  EXPECT_GT(history["plastic_dissipation"].back(), 0.0);
  const double held = history["stored"].back() + history["fluctuation"].back() -
                      history["stored"].front() - history["fluctuation"].front();
  EXPECT_NEAR(history["work"].back(),
              held + history["plastic_dissipation"].back() + history["regime_4_dissipation"].back(),
              1e-12 * history["work"].back());
}

TEST_F(PointPaths, BiaxialAndConstantStressShearHoldWhatTheyHold) {
  for (const std::string leg :
       {"path = \"biaxial\"", "path = \"simple_shear\"\nconstant = \"stress\""}) {
    const auto history = driven(R"(set = ["material.law=lade_duncan"]
[start]
void_ratio = 0.71
pressure = 5e3
[[leg]]
rate = 1.0
strain = 0.05
steps = 500
)" + leg + "\n");
    const auto& held =
        history[leg.find("biaxial") == std::string::npos ? "sigma_q_yy" : "sigma_q_xx"];
    EXPECT_NEAR(held.back(), 5e3, 1e-5);
    EXPECT_EQ(history["regime"].back(), 2.0);
  }
}

TEST_F(PointPaths, SayWhatIsWrong) {
  EXPECT_NE(refused("[start]\nvoid_ratio = 0.7\n[[leg]]\npath = \"twist\"\nsteps = 10\n")
                .find("path.toml:5: unknown leg.path 'twist' (known: biaxial"),
            std::string::npos);
  EXPECT_NE(refused("[start]\nvoid_ratio = 0.7\n").find("at least one [[leg]]"), std::string::npos);
  EXPECT_NE(
      refused("[start]\nvoid_ratoi = 0.7\n[[leg]]\npath = \"rest\"\nduration = 1.0\nsteps = 1\n")
          .find("unknown key 'start.void_ratoi'"),
      std::string::npos);
  EXPECT_NE(refused("[start]\n[[leg]]\npath = \"triaxial\"\nrate = 1.0\nstrain = 0.1\nsteps = 10\n")
                .find("holds a stress that is zero"),
            std::string::npos);
  EXPECT_NE(refused("[start]\n[[leg]]\npath = \"rest\"\nduration = -1.0\nsteps = 10\n")
                .find("must be positive"),
            std::string::npos);
}

TEST_F(PointPaths, AStressThatIsNoNumberIsAFailureWithItsCode) {
  const auto path = PointPath::load(
      file("set = [\"material.law=linear_elastic\"]\n[start]\nvoid_ratio = 0.7\npressure = 1e3\n"
           "[[leg]]\npath = \"triaxial\"\nrate = 1e300\nstrain = 1e300\nsteps = 1\n"));
  try {
    drive(path);
    FAIL() << "driven";
  } catch (const SolverError& error) {
    EXPECT_EQ(error.code, Failure::not_finite);
    EXPECT_STREQ(error.what(), "leg 1, step 1: the stress is no number [not-finite]");
  }
}

TEST_F(PointPaths, WritesBothFormats) {
  const auto path = PointPath::load(
      file("[start]\npressure = 1e3\n[[leg]]\npath = \"rest\"\nduration = 1e-3\nsteps = 10\n"));
  const auto history = drive(path);
  for (const char* name : {"point.h5", "point.csv"}) {
    write(history, path, (folder / name).string());
    EXPECT_GT(std::filesystem::file_size(folder / name), 500u);
    EXPECT_FALSE(std::filesystem::exists(folder / (std::string(name) + ".part")));
  }
  std::ifstream csv(folder / "point.csv");
  int lines = 0;
  for (std::string line; std::getline(csv, line);) ++lines;
  EXPECT_EQ(lines, 12);
}

}  // namespace
}  // namespace grainpair
