// Exact and analytic answers of the solver, with every set of shape functions.
#include <gtest/gtest.h>

#include "tests/cpp/block.hpp"

namespace grainpair {
namespace {

using namespace test;

constexpr TransferScheme schemes[] = {TransferScheme::pic, TransferScheme::flip,
                                      TransferScheme::apic, TransferScheme::affine_flip,
                                      TransferScheme::xpic};

template <class Shape>
class SolverOf : public testing::Test {};
using Shapes = testing::Types<BSpline<1>, BSpline<2>, BSpline<3>, Gimp>;
TYPED_TEST_SUITE(SolverOf, Shapes);

TYPED_TEST(SolverOf, FreeFallIsExact) {
  for (const auto scheme : schemes) {
    Cuboid<PlaneStrain> block{.box = {12, 30}, .low = {4, 20}, .high = {8, 24}};
    block.gravity = {0.0, -9.81};
    block.numerics.transfer = scheme;
    auto solver = block.build<TypeParam>();
    const double top = solver->position(0)[1], dt = 2e-3;
    const int steps = 100;  // crosses a cell
    for (int i = 0; i < steps; ++i) solver->step(dt);
    // symplectic Euler: v = g t, y = y0 - g dt^2 n (n + 1)/2. Round-off: each step makes a dozen
    // operations on numbers of order v, and xpic's series doubles that; it grows at most linearly
    // with the steps.
    const double v = -9.81 * steps * dt, round_off = 24 * 2.2e-16 * steps;
    for (const std::size_t p : solver->points().occupied())
      EXPECT_NEAR(solver->velocity(p)[1], v, round_off * std::abs(v));
    double highest = 0.0, lowest = 1e9;
    for (const std::size_t p : solver->points().occupied()) {
      lowest = std::min(lowest, solver->position(p)[1]);
      highest = std::max(highest, solver->position(p)[1]);
    }
    EXPECT_NEAR(lowest, top - 9.81 * dt * dt * steps * (steps + 1) / 2.0, 1e-12);
    EXPECT_NEAR(highest - lowest, 0.35, 1e-12);  // not deformed
    EXPECT_NEAR(solver->ledger().transfer, 0.0, round_off * solver->ledger().kinetic);
    EXPECT_NEAR(solver->ledger().wall, 0.0, 0.0);
  }
}

/// Largest relative change of angular momentum in one of 50 steps of a rigidly rotating block.
template <class Shape>
double angular_momentum_drift(TransferScheme scheme, double omega, double dt) {
  Cuboid<PlaneStrain> block{.box = {20, 20}, .low = {7, 7}, .high = {13, 13}};
  block.velocity = [&](const auto& x) {
    return Eigen::Vector2d(-omega * (x[1] - 1.0), omega * (x[0] - 1.0));
  };
  block.gradient << 0.0, -omega, omega, 0.0;
  block.numerics.transfer = scheme;
  auto solver = block.build<Shape>();
  const bool moments = scheme == TransferScheme::apic;
  double before = angular_momentum(*solver, moments), worst = 0.0;
  for (int i = 0; i < 50; ++i) {
    solver->step(dt);
    const double after = angular_momentum(*solver, moments);
    worst = std::max(worst, std::abs(after / before - 1.0));
    before = after;
  }
  return worst;
}

TYPED_TEST(SolverOf, RigidRotationKeepsAngularMomentum) {
  const double omega = 2.0, dt = 1e-3;
  EXPECT_LT(angular_momentum_drift<TypeParam>(TransferScheme::apic, omega, dt), 1e-12);
  // Affine FLIP moves a point with the grid and keeps its own velocity: dt v_grid x v_p is not
  // zero, and what the two differ by grows with the turned angle, 50 omega dt. Per step that is at
  // most (omega dt) (50 omega dt).
  EXPECT_LT(angular_momentum_drift<TypeParam>(TransferScheme::affine_flip, omega, dt),
            50 * std::pow(omega * dt, 2) * 2);
  // PIC is the negative control
  EXPECT_GT(angular_momentum_drift<TypeParam>(TransferScheme::pic, omega, dt), 1e-3);
}

/// Any linear velocity field reaches the law as the same rate of deformation at every point, up to
/// the free surface.
TYPED_TEST(SolverOf, UniformStrainRatePassesThePatchTest) {
  Eigen::Matrix2d L;
  L << 0.3, -0.7, 0.2, -0.4;
  Cuboid<PlaneStrain> block{.box = {20, 20}, .low = {7, 7}, .high = {13, 13}};
  block.velocity = [&](const auto& x) { return Eigen::Vector2d(L * x); };
  block.gradient = L;
  block.numerics.transfer = TransferScheme::apic;
  block.numerics.averaging = false;
  auto solver = block.build<TypeParam>();
  const double dt = 1e-3;
  solver->step(dt);
  // 1 + e = (1 + e0) det(I + dt L)
  const double expected =
      (1.0 + void_ratio) * (Eigen::Matrix2d::Identity() + dt * L).determinant() - 1.0;
  SymTensor D = SymTensor::Zero();
  D[0] = -L(0, 0), D[1] = -L(1, 1), D[3] = -(L(0, 1) + L(1, 0)) / std::numbers::sqrt2;
  for (const std::size_t p : solver->points().occupied()) {
    EXPECT_NEAR(solver->points().void_ratio[p], expected, 1e-14);
    EXPECT_NEAR(solver->points().deviatoric_strain[p],
                dt * std::sqrt(2.0 / 3.0) * deviator(D).norm(), 1e-15);
  }
}

/// A box filled with uniform pressure stays at rest: the internal forces of the points cancel at
/// every inner node.
TYPED_TEST(SolverOf, UniformPressureIsInEquilibrium) {
  for (const bool averaging : {false, true}) {
    Cuboid<PlaneStrain> block{.box = {8, 6}, .low = {0, 0}, .high = {8, 6}};
    block.body = linear_elastic(0.25);
    block.stress = [](const auto&) { return SymTensor(1000.0 * identity()); };
    block.numerics.averaging = averaging;
    auto solver = block.build<TypeParam>();
    for (int i = 0; i < 20; ++i) solver->step(solver->stable_step().dt);
    double speed = 0.0;
    for (const std::size_t p : solver->points().occupied())
      speed = std::max(speed, solver->velocity(p).norm());
    // The midpoint rule of two points per cell integrates linear slopes exactly; the cubic's wall
    // function (1-t)^3 it misses by 1/16 of the pressure, which moves the wall cell by twice that
    // over rho c. p/(rho c) = 0.1 m/s.
    const bool cubic = std::is_same_v<TypeParam, BSpline<3>>;
    EXPECT_LT(speed, cubic ? 2.0 / 16.0 * 0.1 : 1e-12) << "averaging " << averaging;
  }
}

/// A column in its own K0 stress stays there, and carries its weight.
TYPED_TEST(SolverOf, HydrostaticColumnDoesNotDrift) {
  const double g = 9.81, height = 1.0;
  Cuboid<PlaneStrain> block{
      .h = 0.1, .box = {2, 14}, .low = {0, 0}, .high = {2, 10}, .points_per_cell = 4};
  block.gravity = {0.0, -g};
  block.walls[1][0].contact = Contact::fixed;
  block.numerics.averaging = true;         // points' own pressures tell the wall cell's quadrature
  block.body = linear_elastic(1.0 / 3.0);  // K0 = nu/(1 - nu) = 1/2
  block.stress = [&](const auto& x) {
    const double s = density * g * (height - x[1]);
    return SymTensor{0.5 * s, s, 0.5 * s, 0.0, 0.0, 0.0};
  };
  auto solver = block.build<TypeParam>();
  const double end = 10.0 * std::sqrt(height / g);
  double base = 0.0;
  int samples = 0;
  while (solver->time() < end) {
    solver->step(solver->stable_step().dt);
    if (solver->time() < 0.5 * end) continue;
    for (const std::size_t p : solver->points().occupied())
      if (solver->position(p)[1] < 0.1)
        base += solver->points().sigma[p][1] / (density * g * (height - solver->position(p)[1])),
            ++samples;
  }
  // four points per cell: with two, the midpoint rule's error in the wall cell alone is about 1 %
  EXPECT_NEAR(base / samples, 1.0, 0.01);
  // Roughness: root mean square of p minus its linear fit in depth, over the mean. The wall cell's
  // quadrature is what is left.
  const auto rows = static_cast<Eigen::Index>(solver->size());
  Eigen::ArrayXd place(rows);
  Eigen::ArrayXd pressure(rows);
  Eigen::Index row = -1;
  for (const std::size_t p : solver->points().occupied()) {
    EXPECT_LT(solver->velocity(p).norm(), 0.01 * std::sqrt(g * height));
    ++row;
    place[row] = solver->position(p)[1];
    pressure[row] = trace(solver->points().sigma[p]) / 3.0;
  }
  const Eigen::ArrayXd y = place - place.mean(), q = pressure - pressure.mean();
  const Eigen::ArrayXd rest = q - (y * q).sum() / y.square().sum() * y;
  EXPECT_LT(std::sqrt(rest.square().sum() / static_cast<double>(rest.size())) / pressure.mean(),
            0.01);
}

}  // namespace
}  // namespace grainpair
