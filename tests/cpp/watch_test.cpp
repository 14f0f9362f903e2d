// The watch: each trouble is found where it is made, and nowhere else.
#include "mpm/step/watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "tests/cpp/block.hpp"

namespace grainpair {
namespace {

using namespace test;
using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double height = 1.0, gravity = 9.81, cell = 0.1, floor_length = 2.0;

/// A block at rest with the given velocity field, and a watch on it.
struct Watched {
  std::unique_ptr<Solver<2>> solver;
  Watch watch;
  explicit Watched(std::function<Eigen::Vector2d(const Eigen::Vector2d&)> velocity,
                   bool averaging = true)
      : solver(build(velocity, averaging)), watch(*solver, {height, gravity, floor_length}, cell) {}
  static std::unique_ptr<Solver<2>> build(
      const std::function<Eigen::Vector2d(const Eigen::Vector2d&)>& velocity, bool averaging) {
    Cuboid<PlaneStrain> block{.box = {20, 20}, .low = {4, 4}, .high = {12, 12}};
    block.velocity = velocity;
    block.numerics.averaging = averaging;
    return block.build<BSpline<2>>();
  }
};

/// +1 and -1 on alternate points both ways: within a cell, no affine field looks like it.
double chequer(const Eigen::Vector2d& x) {
  const double pitch = 0.5 * cell;
  return (static_cast<int>(x[0] / pitch) + static_cast<int>(x[1] / pitch)) % 2 ? 1.0 : -1.0;
}

TEST(Watch, SaysNothingOfAMotionThatCellsCanSee) {
  Watched block([](const auto& x) { return Eigen::Vector2d(0.3 * x[1], 0.1 - 0.2 * x[0]); });
  EXPECT_NO_THROW(block.watch.step(*block.solver, 1));
  EXPECT_NO_THROW(block.watch.points(*block.solver));
  EXPECT_TRUE(block.watch.warnings(block.solver->ledger(), block.solver->ledger()).empty());
}

TEST(Watch, WarnsOfMotionThatCellsCannotSee) {
  Watched block([](const auto&) { return Eigen::Vector2d(1.0, 0.0); });
  auto& points = block.solver->points();
  for (const std::size_t p : points.occupied()) points.v[p][1] = 0.5 * chequer(points.x[p]);
  block.watch.points(*block.solver);
  const auto warnings = block.watch.warnings(block.solver->ledger(), block.solver->ledger());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("noise: "));
}

TEST(Watch, WarnsOfMatterInTheLastCellOfTheFloor) {
  Watched block([](const auto&) { return Eigen::Vector2d(0.0, 0.0); });
  auto& points = block.solver->points();
  const std::size_t one = *points.occupied().begin();
  points.x[one][0] = floor_length - 1.01 * cell;
  block.watch.points(*block.solver);
  EXPECT_TRUE(block.watch.warnings(block.solver->ledger(), block.solver->ledger()).empty());
  points.x[one][0] = floor_length - 0.99 * cell;
  block.watch.points(*block.solver);
  const auto warnings = block.watch.warnings(block.solver->ledger(), block.solver->ledger());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("end: "));
}

TEST(Watch, EndsTheRunOfAPointNoFallCouldHaveMadeSoFast) {
  const double fall = std::sqrt(2.0 * gravity * height);
  Watched fast([&](const auto&) { return Eigen::Vector2d(3.01 * fall, 0.0); });
  EXPECT_THAT([&] { fast.watch.points(*fast.solver); },
              ThrowsMessage<SolverError>(AllOf(HasSubstr("too fast"), EndsWith("[ejected]"))));
  Watched slower([&](const auto&) { return Eigen::Vector2d(2.99 * fall, 0.0); });
  EXPECT_NO_THROW(slower.watch.points(*slower.solver));
}

TEST(Watch, WarnsOfTensionAndOfPressureThatDiffersWithinCells) {
  // where cells have one pressure, the grid feels no other
  Watched block([](const auto&) { return Eigen::Vector2d(0.0, 0.0); }, false);
  auto& points = block.solver->points();
  const double pressure = block.solver->solid_density() * gravity * height;
  for (const std::size_t p : points.occupied())
    points.sigma[p].head<3>().setConstant((1.0 + 2.0 * chequer(points.x[p])) * pressure);
  block.watch.points(*block.solver);
  const auto warnings = block.watch.warnings(block.solver->ledger(), block.solver->ledger());
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_THAT(warnings[0], HasSubstr("locking: "));
  EXPECT_THAT(warnings[1], HasSubstr("tension: "));
}

/// Of 8 x 8 cells that claim `more` than they have, 6 x 6 are surrounded by others.
std::vector<std::string> warnings_of_crowding(double more) {
  Watched block([](const auto&) { return Eigen::Vector2d(0.0, 0.0); });
  auto& points = block.solver->points();
  for (const std::size_t p : points.occupied())
    points.void_ratio[p] = (1.0 + void_ratio) * (1.0 + more) - 1.0;
  block.watch.points(*block.solver);
  return block.watch.warnings(block.solver->ledger(), block.solver->ledger());
}

TEST(Watch, WarnsOfVolumeThatHasNoRoom) {
  const double inner = 36.0 / 64.0, bound = 0.1 / (inner - 0.1);  // more/(1 + more) inner = 0.1
  EXPECT_TRUE(warnings_of_crowding(0.99 * bound).empty());
  const auto warnings = warnings_of_crowding(1.01 * bound);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("crowding: for 10 % of the volume"));
}

// Collisions resist expansion: lam tr D may exceed p_c. That is their law, not a cone left behind.
TEST(Watch, LetsCollisionsPull) {
  Cuboid<PlaneStrain> block{.box = {20, 20}, .low = {4, 4}, .high = {12, 12}};
  block.velocity = [](const auto& x) { return Eigen::Vector2d(20.0 * (x.array() - 0.8)); };
  block.granular_temperature = [](const auto&) { return 0.01; };
  block.body = material_registry().at("solid_fluid")(
      any_case({"material.law=solid_fluid", "grains.diameter=0.05", "geometry.length=1",
                "geometry.height=1", "geometry.thickness=0.2", "geometry.floor_length=5",
                "mpm.cell_size=0.1", "mpm.viscous_stiffness=0"}));
  const auto solver = block.build<BSpline<2>>();
  Watch watch(*solver, {height, gravity, floor_length}, cell);
  solver->step(1e-6);
  const std::size_t p = *solver->points().occupied().begin();
  const double pressure = solver->points().sigma[p].head<3>().sum() / 3.0;
  EXPECT_LT(pressure, -0.02 * solver->solid_density() * gravity * height);
  EXPECT_NEAR(solver->collisional_pressure(p), pressure, 1e-9 * std::abs(pressure));
  watch.points(*solver);
  EXPECT_TRUE(watch.warnings(solver->ledger(), solver->ledger()).empty());
}

/// A vibrating block stepped at `length` of the claimed limit, times what the watch leaves of it or
/// not; throws what the watch throws.
Watch vibrated(double length, bool shortened) {
  const double k = std::numbers::pi / (8 * cell);
  Cuboid<PlaneStrain> block{.box = {60, 20}, .low = {4, 4}, .high = {12, 12}};
  block.velocity = [&](const auto& x) {
    return Eigen::Vector2d(1.0 + 0.02 * std::cos(k * (x[0] - 4 * cell)), 0.0);
  };
  block.numerics.time_step_fraction = 1.0;
  block.numerics.averaging = true;
  block.body = linear_elastic(0.25);
  const auto solver = block.build<BSpline<2>>();
  Watch watch(*solver, {height, gravity, floor_length}, cell);
  for (int step = 1; step <= 300; ++step) {
    solver->step(length * solver->stable_step().dt * (shortened ? watch.step_share() : 1.0));
    watch.step(*solver, step);
  }
  return watch;
}

TEST(Watch, ShortensStepsThatMakeEnergy) {
  EXPECT_EQ(vibrated(1.0, true).step_share(), 1.0);  // within the claimed limit nothing is cut
  EXPECT_THAT([] { vibrated(2.0, false); },
              ThrowsMessage<SolverError>(EndsWith("[energy-growth]")));
  const Watch watch = vibrated(2.0, true);
  EXPECT_LT(watch.step_share(), 1.0);
  const auto warnings = watch.warnings({}, {});
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("halved: "));
}

}  // namespace
}  // namespace grainpair
