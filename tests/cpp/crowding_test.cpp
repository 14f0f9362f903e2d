// Points that claim more volume than there is room for, and how they give it up.
#include <gtest/gtest.h>

#include <map>
#include <numbers>

#include "tests/cpp/block.hpp"

namespace grainpair {

struct SolverStages {
  template <int D>
  static void count(Solver<D>& solver) {
    solver.find_crowding();
  }
  template <int D>
  static const std::vector<double>& crowding(const Solver<D>& solver) {
    return solver.points_.crowding;
  }
};

namespace {

using namespace test;

constexpr double shear_rate = 2.0, dt = 1e-6;  // [1/s], [s]

/// A block in simple shear whose points claim so much more volume than there is: the rates of
/// volume change in a step, of those four cells and more from its edges, least and largest [1/s].
template <class Kinematics, class Shape>
std::pair<double, double> rates(double relaxation, double claim, int steps = 1) {
  constexpr int dim = Kinematics::dimension, side = dim == 3 ? 9 : 12;
  Cuboid<Kinematics> block{.box = {}, .low = {}, .high = {}};
  block.box.fill(side + 4), block.low.fill(2), block.high.fill(side + 2);
  block.velocity = [](const auto& x) {
    typename Cuboid<Kinematics>::Vec v = Cuboid<Kinematics>::Vec::Zero();
    v[1] = shear_rate * x[0];
    return v;
  };
  block.gradient(1, 0) = shear_rate;
  block.numerics.transfer = TransferScheme::apic;
  block.numerics.averaging = false;
  block.numerics.volume_relaxation = relaxation;
  auto solver = block.template build<Shape>();
  auto& points = solver->points();
  std::map<std::uint32_t, double> before;
  for (const std::size_t p : points.occupied())
    before[points.id[p]] = points.void_ratio[p] = (1.0 + void_ratio) * (1.0 + claim) - 1.0;
  if (Kinematics::axisymmetric)  // of whole rings
    for (const std::size_t p : points.occupied())
      points.mass[p] *= 2.0 * std::numbers::pi * points.x[p][0];
  if (relaxation > 0.0) SolverStages::count(*solver);
  for (int step = 0; step < steps; ++step) solver->step(dt);
  std::pair<double, double> range{1e9, -1e9};
  for (const std::size_t p : points.occupied()) {
    const Vec3 x = solver->position(p) / block.h;
    bool inner = true;
    for (int d = 0; d < dim; ++d) inner = inner && x[d] > 6.0 && x[d] < side - 2.0;
    if (!inner) continue;
    const double rate = std::log((1.0 + points.void_ratio[p]) / (1.0 + before[points.id[p]])) / dt;
    range.first = std::min(range.first, rate), range.second = std::max(range.second, rate);
  }
  return range;
}

template <class Shape>
class Crowding : public testing::Test {};
using Shapes = testing::Types<BSpline<1>, BSpline<2>, BSpline<3>, Gimp>;
TYPED_TEST_SUITE(Crowding, Shapes);

// Functions that add up to one count a lattice exactly. d ln V/dt = - crowding shear rate/strain,
// to the round-off of a volume over dt, 1e-16/1e-6 1/s, some dozen times.
TYPED_TEST(Crowding, IsGivenUpOverAStrain) {
  constexpr double strain = 0.5, claim = 0.05, expected = -claim * shear_rate / strain;
  const auto [low, high] = rates<PlaneStrain, TypeParam>(strain, claim);
  EXPECT_NEAR(low, expected, 1e-6);
  EXPECT_NEAR(high, expected, 1e-6);
  const auto [least, most] = rates<PlaneStrain, TypeParam>(strain, -claim);  // room to spare
  EXPECT_NEAR(least, -expected, 1e-6);
  EXPECT_NEAR(most, -expected, 1e-6);
}

TYPED_TEST(Crowding, IsCountedInRingsAndInSpace) {
  constexpr double strain = 0.5, claim = 0.05, expected = -claim * shear_rate / strain;
  const auto [low, high] = rates<Axisymmetric, TypeParam>(strain, claim);
  EXPECT_NEAR(low, expected, 1e-6);
  EXPECT_NEAR(high, expected, 1e-6);
  const auto [least, most] = rates<ThreeDimensional, TypeParam>(strain, claim);
  EXPECT_NEAR(least, expected, 1e-6);
  EXPECT_NEAR(most, expected, 1e-6);
}

// Beside walls, too, where functions are others, and two points a cell do not integrate them.
// (Those of gimp shrink with the points there, and err by up to 3 %.)
TYPED_TEST(Crowding, IsCountedBesideWalls) {
  constexpr double claim = 0.05, off = std::is_same_v<TypeParam, Gimp> ? 0.03 : 1e-12;
  for (const int width : {1, 2, 9}) {
    Cuboid<PlaneStrain> block{.box = {width, 7}, .low = {0, 0}, .high = {width, 7}};
    block.numerics.volume_relaxation = 1.0;
    auto solver = block.build<TypeParam>();
    auto& points = solver->points();
    for (const std::size_t p : points.occupied())
      points.void_ratio[p] = (1.0 + void_ratio) * (1.0 + claim) - 1.0;
    SolverStages::count(*solver);
    for (const std::size_t p : points.occupied())
      EXPECT_NEAR(SolverStages::crowding(*solver)[p], claim, off)
          << width << " cells, at " << solver->position(p).transpose();
  }
}

// The controls: points that are asked for nothing, and such as claim no more than there is.
TYPED_TEST(Crowding, StaysWhereNothingIsAskedFor) {
  const auto [low, high] = rates<PlaneStrain, TypeParam>(0.0, 0.05);
  EXPECT_NEAR(low, 0.0, 1e-6);
  EXPECT_NEAR(high, 0.0, 1e-6);
  const auto [least, most] = rates<PlaneStrain, TypeParam>(0.5, 0.0);
  EXPECT_NEAR(least, 0.0, 1e-6);
  EXPECT_NEAR(most, 0.0, 1e-6);
}

// So much would throw points about: a quarter at a time.
TYPED_TEST(Crowding, IsGivenUpAQuarterAtATime) {
  const auto [low, high] = rates<PlaneStrain, TypeParam>(1.0, 0.4);
  EXPECT_NEAR(low, -0.25 * shear_rate, 1e-6);
  EXPECT_NEAR(high, -0.25 * shear_rate, 1e-6);
}

// Over two steps of the strain half of the claim goes, and half of the rest, by d ln V = 3 ln(1 -
// what is given/3) each; a claim that were not used up would be met twice. (The bound: steps shear
// the cells by some 1e-6, which changes their volume by less.)
TYPED_TEST(Crowding, IsGivenUpOnce) {
  constexpr double claim = 0.05;
  const auto [low, high] = rates<PlaneStrain, TypeParam>(shear_rate * dt, claim, 2);
  const double expected = 3.0 * std::log(1.0 - claim / 6.0) + 3.0 * std::log(1.0 - claim / 12.0);
  EXPECT_NEAR(low * dt, expected, 1e-4 * claim);
  EXPECT_NEAR(high * dt, expected, 1e-4 * claim);
}

}  // namespace
}  // namespace grainpair
