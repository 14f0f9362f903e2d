// A grid that repeats along the flow, and what flows on it.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <map>
#include <numbers>

#include "tests/cpp/block.hpp"

namespace grainpair {
namespace {

using namespace test;

// A block that fills a period of 8 cells and floats: no wall, no base.
constexpr int cells = 8;
constexpr double h = 0.1, length = cells * h;

struct State {
  std::map<std::uint32_t, Vec3> x, v;
  double momentum = 0.0, mass = 0.0;
};

State state_of(const Solver<2>& solver) {
  State out;
  const Points<2>& points = *solver.plane();
  for (const std::size_t p : points.occupied()) {
    out.x[points.id[p]] = solver.position(p);
    out.v[points.id[p]] = solver.velocity(p);
    out.momentum += points.mass[p] * points.v[p][0];
    out.mass += points.mass[p];
  }
  return out;
}

/// Waves that cross the seam many times, begun `shift` further along; `period` 0: between rollers.
std::unique_ptr<Solver<2>> waves(double shift, int period = cells, double speed = 2.0) {
  Cuboid<PlaneStrain> block{.h = h,
                            .box = {period > 0 ? period + 2 * Period::beside : cells, 12},
                            .low = {0, 4},
                            .high = {cells, 8}};
  block.period = {period};
  block.body = linear_elastic(0.25);
  block.numerics.averaging = true;
  block.numerics.void_ratio_relaxation = 0.1;
  block.numerics.velocity_relaxation = 1.0;
  block.velocity = [=](const auto& x) {
    const double phase = 2.0 * std::numbers::pi * (x[0] - shift) / length;
    return Eigen::Vector2d(speed + 0.3 * std::sin(phase), 0.2 * std::cos(2.0 * phase));
  };
  return block.build<BSpline<2>>();
}

void go(Solver<2>& solver, int steps = 400, double dt = 1e-3) {
  for (int i = 0; i < steps; ++i) solver.step(dt);
}

/// Largest difference of velocities from those of the same points half a period further along.
double unlike(const State& a, const State& b) {
  constexpr std::uint32_t down = 8, along = 2 * cells;  // points in a column, columns
  double worst = 0.0;
  for (const auto& [id, v] : a.v) {
    const std::uint32_t column = (id / down + along / 2) % along;
    worst = std::max(worst, (v - b.v.at(column * down + id % down)).norm());
  }
  return worst;
}

// 400 steps at 2 m/s are one period. Sums at the seam are taken in another order than elsewhere:
// round-off of 1e-16 of 2 m/s in each step, kept apart by waves that are damped.
TEST(Chute, WhereThePeriodBeginsDoesNotMatter) {
  auto here = waves(0.0), there = waves(0.5 * length);
  go(*here), go(*there);
  EXPECT_LT(unlike(state_of(*here), state_of(*there)), 1e-11);
}

// Negative control: between rollers the two are different problems.
TEST(Chute, BetweenWallsItDoes) {
  auto here = waves(0.0, 0, 0.0), there = waves(0.5 * length, 0, 0.0);
  go(*here), go(*there);
  EXPECT_GT(unlike(state_of(*here), state_of(*there)), 1e-3);
}

TEST(Chute, MassAndMomentumStay) {
  auto solver = waves(0.0);
  const State before = state_of(*solver);
  go(*solver);
  const State after = state_of(*solver);
  EXPECT_DOUBLE_EQ(after.mass, before.mass);
  EXPECT_NEAR(after.momentum, before.momentum, 1e-12 * before.momentum);
  auto walled = waves(0.0, 0);
  go(*walled, 50);
  EXPECT_GT(std::abs(state_of(*walled).momentum - before.momentum), 0.01 * before.momentum);
}

TEST(Chute, PlacesAreWithinThePeriod) {
  auto solver = waves(0.0);
  go(*solver, 777);
  for (const auto& [id, x] : state_of(*solver).x) {
    EXPECT_GE(x[0], 0.0);
    EXPECT_LT(x[0], length);
  }
}

TEST(Chute, ThreadsDoNotMatter) {
  auto one = waves(0.0), two = waves(0.0);
  go(*one);
  omp_set_num_threads(2);
  go(*two);
  omp_set_num_threads(1);
  EXPECT_EQ(state_of(*one).v, state_of(*two).v);
}

// Gravity along the slope alone: every point falls freely, and its work is what the account of the
// slope has lost, over many periods.
TEST(Chute, TheSlopesAccountIsTheWorkOfGravity) {
  Cuboid<PlaneStrain> block{
      .h = h, .box = {cells + 2 * Period::beside, 12}, .low = {0, 4}, .high = {cells, 8}};
  block.period = {cells};
  block.gravity = {5.0, 0.0};
  auto solver = block.build<BSpline<2>>();
  const EnergyLedger before = solver->ledger();
  const int steps = 4000;
  const double dt = 1e-3, time = steps * dt;  // 40 m, 50 periods
  go(*solver, steps, dt);
  const State after = state_of(*solver);
  EXPECT_NEAR(after.momentum, after.mass * 5.0 * time, 1e-10 * after.momentum);
  // symplectic Euler: x = g dt^2 n (n + 1)/2
  const double way = 0.5 * 5.0 * dt * dt * steps * (steps + 1.0);
  EXPECT_NEAR(before.slope - solver->ledger().slope, after.mass * 5.0 * way,
              1e-9 * after.mass * 5.0 * way);
  EXPECT_NEAR(solver->ledger().total(), before.total(), 1e-9 * after.mass * 5.0 * way);
}

/// The smallest chute, of one law and angle, after `time` sqrt(H/g).
std::unique_ptr<Simulation> flown(double inclination, double time,
                                  const std::vector<std::string>& more = {}) {
  std::vector<std::string> keys{"material.law=mu_i",
                                fmt::format("geometry.inclination={}", inclination)};
  keys.insert(keys.end(), more.begin(), more.end());
  const Case scene = Case::load(GRAINPAIR_SOURCE "/cases/chute_ci", keys);
  auto simulation = make_simulation(scene, {});
  while (simulation->time() < time * time_scale(scene))
    simulation->step(simulation->stable_step().dt);
  return simulation;
}

/// Mean velocity of the points [m/s].
double mean_velocity(const Simulation& simulation) {
  double momentum = 0.0, mass = 0.0;
  simulation.visit_points([&](const auto& points) {
    for (const std::size_t p : points.occupied())
      momentum += points.mass[p] * points.v[p][0], mass += points.mass[p];
  });
  return momentum / mass;
}

// A stiff block on a plane of friction mu slides with g (sin - mu cos).
TEST(Chute, ABlockSlidesDownTheSlope) {
  const double mu = 0.2, angle = 26.0 * std::numbers::pi / 180.0;
  const auto slid = flown(26.0, 8.0,
                          {"material.law=linear_elastic", "mpm.stiffness=as given",
                           "walls.base=coulomb", fmt::format("walls.base_friction={}", mu)});
  const double expected = 9.81 * (std::sin(angle) - mu * std::cos(angle)) * slid->time();
  // The block leaves its K0 stress by waves through its height, which friction feels: of the order
  // of H/c in time, a hundredth of the 8 sqrt(H/g) here.
  EXPECT_NEAR(mean_velocity(*slid), expected, 0.01 * expected);
}

/// Of the mean velocity, and of the velocities of all points at their heights, of a Bagnold flow.
struct Off {
  double mean, worst;
};

/// mu(I) at a slope: I is the same at every depth, so that v = 2/3 I/d sqrt(nu g cos) (h^1.5 - (h -
/// y)^1.5) with nu and h as they come out.
Off off_bagnold(const Simulation& flow, double inclination) {
  const Case scene = Case::load(GRAINPAIR_SOURCE "/cases/chute_ci");
  const double angle = inclination * std::numbers::pi / 180.0, mu = std::tan(angle);
  const double I = 0.279 * (mu - 0.382) / (0.643 - mu), d = scene.number("grains.diameter");
  double solid = 0.0, mass = 0.0, area = scene.number("geometry.length");
  flow.visit_points([&](const auto& points) {
    for (const std::size_t p : points.occupied()) {
      solid += points.mass[p] / scene.number("grains.density");
      mass += points.mass[p] / scene.number("grains.density") * (1.0 + points.void_ratio[p]);
    }
  });
  const double nu = solid / mass, depth = mass / area / scene.number("geometry.thickness");
  const double c = 2.0 / 3.0 * I / d * std::sqrt(nu * 9.81 * std::cos(angle));
  const double mean = 0.6 * c * std::pow(depth, 1.5);
  Off out{mean_velocity(flow) / mean - 1.0, 0.0};
  flow.visit_points([&](const auto& points) {
    for (const std::size_t p : points.occupied()) {
      const double y = std::min(points.x[p][1], depth);
      const double v = c * (std::pow(depth, 1.5) - std::pow(depth - y, 1.5));
      out.worst = std::max(out.worst, std::abs(points.v[p][0] - v) / mean);
    }
  });
  return out;
}

// Twelve cells over the depth, after 80 sqrt(H/g): the mean velocity is 0.9 % low, on 24 cells 0.0
// % (by hand); the profile's slope at the surface goes as the root of the depth below it, which no
// spline follows within its last cell. At single points it is off by what half a cell's rise is at
// the base, a tenth of the mean.
TEST(Chute, MuOfIFlowsAsBagnoldSays) {
  const auto flow = flown(28.0, 80.0);
  const Off found = off_bagnold(*flow, 28.0), wrong = off_bagnold(*flow, 27.0);
  RecordProperty("mean", fmt::format("{:.4f}", found.mean));
  RecordProperty("worst", fmt::format("{:.4f}", found.worst));
  EXPECT_LT(std::abs(found.mean), 0.015);
  EXPECT_LT(found.worst, 0.15);
  EXPECT_GT(std::abs(wrong.mean), 0.2);  // negative control: of another angle
}

// Below the angle whose tangent is mu_s nothing flows.
TEST(Chute, BelowItsAngleOfReposeALayerStands) {
  EXPECT_LT(mean_velocity(*flown(19.0, 15.0)), 1e-3);
  EXPECT_GT(mean_velocity(*flown(24.0, 15.0)), 0.02);
}

}  // namespace
}  // namespace grainpair
