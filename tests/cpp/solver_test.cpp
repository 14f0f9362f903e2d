// Exact and analytic answers of the solver.
#include <gtest/gtest.h>
#include <omp.h>

#include <map>
#include <set>

#include "mpm/transfer/transfer.hpp"
#include "tests/cpp/block.hpp"
#include "tests/cpp/inert.hpp"

namespace grainpair {
namespace {

using namespace test;

/// In a rigid rotation the grid's increment of the gradient is dt W W (centripetal); carried along,
/// the point's stays W.
TEST(AffineFlip, KeepsTheGradientOfARigidRotation) {
  const double omega = 3.0, dt = 0.01;
  Eigen::Matrix2d W;
  W << 0.0, -omega, omega, 0.0;
  const Eigen::Matrix2d C = AffineFlip::gradient<Eigen::Matrix2d>(W, dt * W * W, W, 0.0, dt);
  EXPECT_LT((C - W).norm(), 1e-14);
  // negative control: an increment that is merely added drifts by dt omega^2 a step
  EXPECT_GT((W + dt * W * W - W).norm(), 0.1);
}

/// A cloud that flies apart ends at the void ratio of one point per cell, (1 + e) = (1 + e0) 2^2,
/// and not beyond. A point whose neighbours close in from all sides must not gain slope: nothing
/// would stop it.
TEST(AffineFlip, ContractionSteepensNoGradient) {
  const double dt = 1e-3, rate = 5.0;
  const Eigen::Matrix2d plane = -rate * Eigen::Matrix2d::Identity();
  EXPECT_NEAR(
      (AffineFlip::gradient<Eigen::Matrix2d>(plane, Eigen::Matrix2d::Zero(), plane, 0.0, dt) -
       plane)
          .norm(),
      0.0, 1e-12 * rate);
  const Eigen::Matrix3d space = -rate * Eigen::Matrix3d::Identity();
  EXPECT_LT((AffineFlip::gradient<Eigen::Matrix3d>(space, Eigen::Matrix3d::Zero(), space, 0.0, dt))
                .norm(),
            space.norm());
}

TEST(Solver, DetachedPointsStopAtTheVolumeOfTheirCell) {
  Cuboid<PlaneStrain> block{.box = {40, 40}, .low = {19, 19}, .high = {21, 21}};
  block.velocity = [](const auto& x) { return Eigen::Vector2d(x[0] - 2.0, x[1] - 2.0); };
  block.gradient << 1.0, 0.0, 0.0, 1.0;
  block.numerics.averaging = false;
  auto solver = block.build<BSpline<2>>();
  for (int i = 0; i < 400; ++i) solver->step(0.005);
  double loosest = 0.0;
  for (const std::size_t p : solver->points().occupied())
    loosest = std::max(loosest, solver->points().void_ratio[p]);
  EXPECT_NEAR(loosest, 4.0 * (1.0 + void_ratio) - 1.0, 1e-9);
}

/// Velocities of the points, by id, and what transfers lost, of a block that falls onto a floor.
template <class Kinematics>
auto fallen(const Cuboid<Kinematics>& start, int threads) {
  omp_set_num_threads(threads);
  Cuboid<Kinematics> block{.box = start.box, .low = start.low, .high = start.high};
  block.gravity[1] = -9.81;
  block.walls[1][0].contact = Contact::fixed;
  block.body = linear_elastic(0.25);
  auto solver = block.template build<BSpline<2>>();
  for (int i = 0; i < 300; ++i) solver->step(solver->stable_step().dt);
  omp_set_num_threads(1);
  std::map<std::uint32_t, Vec3> v;
  for (const std::size_t p : solver->points().occupied())
    v[solver->points().id[p]] = solver->velocity(p);
  return std::pair(v, solver->ledger().transfer);
}

// Strips of one colour share no node, in the plane and in space, whose strips are thinner.
TEST(Solver, ResultsDoNotDependOnThreads) {
  const Cuboid<PlaneStrain> plane{.box = {30, 30}, .low = {0, 2}, .high = {17, 12}};
  EXPECT_EQ(fallen(plane, 1), fallen(plane, 2));
  const Cuboid<ThreeDimensional> space{.box = {16, 16, 4}, .low = {0, 1, 0}, .high = {11, 6, 4}};
  EXPECT_EQ(fallen(space, 1), fallen(space, 2));
}

// Nine points in every cell: two fours of each, and in the end of the strip what the cells have
// left over.
TEST(Solver, PointsThatShareACellStayTogether) {
  Cuboid<PlaneStrain> block{.box = {20, 20}, .low = {5, 5}, .high = {10, 9}, .points_per_cell = 3};
  const auto solver = block.build<BSpline<2>>();
  const auto cell = [&](std::size_t p) {
    return std::pair(std::floor(solver->position(p)[0] / block.h),
                     std::floor(solver->position(p)[1] / block.h));
  };
  constexpr std::size_t cells = 5 * 4, together = Wide::size();
  std::set<std::uint32_t> ids(solver->points().id.begin(), solver->points().id.end());
  ASSERT_EQ(ids.size(), 9 * cells);
  for (std::size_t p = 0; p < 9 / together * together * cells; ++p)
    EXPECT_EQ(cell(p), cell(p / together * together)) << p;
}

/// Stiff at the start, and then without any stress that could limit a step.
struct Vanishing : Inert {
  using Inert::Inert;
  Response<double, State> initial(const InitialState& start) const {
    auto r = Inert::initial(start);
    r.state.none = 1e5;
    return r;
  }
  template <class Real>
  Response<Real, State> update(const State<Real>& old, const DeformationOf<Real>& step) const {
    return Inert::update(old, step);
  }
  template <class Real>
  StabilityOf<Real> stability(const State<Real>& state, const Real&) const {
    return {state.none, 0.0};  // the modulus it was given, and none after an update
  }
};

TEST(Solver, AStepWithoutStressToLimitItStaysNearTheFirst) {
  Cuboid<PlaneStrain> block{.box = {6, 6}, .low = {1, 1}, .high = {4, 4}};
  block.body = std::make_unique<BodyOf<Vanishing>>(Vanishing(any_case()));
  auto solver = block.build<BSpline<2>>();
  const double first = solver->stable_step().dt;
  solver->step(first);
  EXPECT_DOUBLE_EQ(solver->stable_step().dt, 4.0 * first);
}

TEST(Solver, MassAndMomentumAreKeptInThreeDimensions) {
  Cuboid<ThreeDimensional> block{.box = {10, 10, 10}, .low = {3, 3, 3}, .high = {7, 7, 7}};
  block.velocity = [](const auto& x) {
    return Vec3(std::sin(9 * x[1]), std::cos(7 * x[2]), x[0] * x[0]);
  };
  block.body = linear_elastic(0.25);
  auto solver = block.build<BSpline<2>>();
  const auto momentum = [&] {
    Vec3 sum = Vec3::Zero();
    for (const std::size_t p : solver->points().occupied())
      sum += solver->points().mass[p] * solver->velocity(p);
    return sum;
  };
  const Vec3 before = momentum();
  for (int i = 0; i < 50; ++i) solver->step(1e-3);
  EXPECT_LT((momentum() - before).norm(), 1e-12 * before.norm() * 50);
}

/// Steady radial expansion v_r = a r of an axisymmetric body: e grows as in the exact (1 + a dt)^2
/// each step.
TEST(Solver, AxisymmetricExpansionHasHoopStrain) {
  const double a = 0.5, dt = 1e-3;
  Cuboid<Axisymmetric> block{.box = {20, 12}, .low = {4, 3}, .high = {12, 9}};
  block.velocity = [&](const auto& x) { return Eigen::Vector2d(a * x[0], 0.0); };
  block.gradient << a, 0.0, 0.0, 0.0;
  block.numerics.transfer = TransferScheme::apic;
  block.numerics.averaging = false;
  auto solver = block.build<BSpline<2>>();
  solver->step(dt);
  const double expected = (1.0 + void_ratio) * std::pow(1.0 + a * dt, 2) - 1.0;
  for (const std::size_t p : solver->points().occupied())
    EXPECT_NEAR(solver->points().void_ratio[p], expected, 1e-13);
}

}  // namespace
}  // namespace grainpair
