// Each account of the energy ledger against a figure that does not come from the ledger.
#include <gtest/gtest.h>

#include "tests/cpp/block.hpp"

namespace grainpair {
namespace {

using namespace test;

double kinetic_energy(const Simulation& s) {
  double sum = 0.0;
  s.visit_points([&](const auto& points) {
    for (const std::size_t p : points.occupied())
      sum += 0.5 * points.mass[p] * points.v[p].squaredNorm();
  });
  return sum;
}

/// Gives a block the full law on grains of the seed's column, at temperature `T` [m2/s2].
void heat(Cuboid<PlaneStrain>& block, double T, std::vector<std::string> keys = {}) {
  keys.emplace_back("material.law=solid_fluid");
  block.body = material_registry().at("solid_fluid")(any_case(keys));
  block.granular_temperature = [T](const auto&) { return T; };
}

// Transfer: without forces whatever kinetic energy the points lose, the transfers took.
TEST(Ledger, TransferIsTheKineticEnergyThePointsLose) {
  for (const auto scheme : {TransferScheme::pic, TransferScheme::flip, TransferScheme::apic,
                            TransferScheme::affine_flip}) {
    Cuboid<PlaneStrain> block{.box = {12, 12}, .low = {4, 4}, .high = {8, 8}};
    block.velocity = [](const auto& x) {
      return Eigen::Vector2d(std::sin(40.0 * x[1]), std::cos(31.0 * x[0]));
    };
    block.numerics.transfer = scheme;
    auto solver = block.build<BSpline<2>>();
    const double before = kinetic_energy(*solver);
    for (int i = 0; i < 20; ++i) solver->step(1e-3);
    const double lost = before - kinetic_energy(*solver);
    EXPECT_NEAR(solver->ledger().transfer, lost, 1e-13 * before);
    if (scheme == TransferScheme::pic) {
      EXPECT_GT(lost, 0.1 * before);  // there was something to lose
    }
  }
}

// Time integration: in a vibrating bar the error of the explicit step falls with the step, that of
// the transfer does not.
TEST(Ledger, TimeIntegrationFallsWithTheStep) {
  const auto vibrate = [](double fraction) {
    const double length = 1.0, c = 10.0, k = 0.5 * std::numbers::pi / length;
    Cuboid<PlaneStrain> block{.h = length / 16, .box = {20, 4}, .low = {0, 0}, .high = {16, 4}};
    block.body = linear_elastic(0.25);
    block.velocity = [&](const auto& x) { return Eigen::Vector2d(1e-3 * std::sin(k * x[0]), 0.0); };
    block.numerics.transfer = TransferScheme::flip;
    block.numerics.averaging = false;
    auto solver = block.build<BSpline<2>>();
    const double end = 0.5 * std::numbers::pi / (k * c);  // a quarter of the period
    const int steps = static_cast<int>(std::ceil(end / (fraction * solver->stable_step().dt)));
    double worst = 0.0;
    for (int i = 0; i < steps; ++i) {
      solver->step(end / steps);
      worst = std::max(worst, std::abs(solver->ledger().time_integration));
    }
    return worst;
  };
  EXPECT_LT(vibrate(0.25), 0.3 * vibrate(1.0));  // first order would give 0.25
}

// Wall: a stiff block that slides on a Coulomb floor until it stands has given its kinetic energy
// to the friction.
TEST(Ledger, WallTakesTheEnergyOfASlidingBlock) {
  const double g = 10.0, mu = 0.1, v0 = 0.3;
  Cuboid<PlaneStrain> block{.h = 0.05, .box = {24, 8}, .low = {4, 0}, .high = {16, 4}};
  block.gravity = {0.0, -g};
  block.walls[1][0] = Wall{Contact::coulomb, mu};
  block.body = linear_elastic(0.0);
  block.velocity = [&](const auto&) { return Eigen::Vector2d(v0, 0.0); };
  block.stress = [&](const auto& x) {
    return SymTensor{0.0, density * g * (0.2 - x[1]), 0.0, 0.0, 0.0, 0.0};
  };
  auto solver = block.build<BSpline<2>>();
  const double kinetic = kinetic_energy(*solver), start = solver->position(0)[0];
  const std::uint32_t id = solver->points().id[0];
  while (solver->time() < 1.5 * v0 / (mu * g)) solver->step(solver->stable_step().dt);
  double end = 0.0;
  for (const std::size_t p : solver->points().occupied())
    if (solver->points().id[p] == id) end = solver->position(p)[0];
  // Rigid: stops after v0^2/(2 mu g) = 45 mm. Friction comes at once and sends a shear wave of mu g
  // H/c_s = 0.03 m/s up the block: a hundredth of v0^2, twice (start and stop).
  EXPECT_NEAR(end - start, v0 * v0 / (2.0 * mu * g), 0.02 * v0 * v0 / (2.0 * mu * g));
  EXPECT_NEAR(solver->ledger().wall, kinetic, 0.02 * kinetic);
}

// Collisional: in a closed box that nothing moves, granular temperature cools as its own equation
// says.
TEST(Ledger, CollisionalIsTheHeatThatCools) {
  const double T = 1e-3, dt = 1e-4;
  Cuboid<PlaneStrain> block{.box = {6, 6}, .low = {0, 0}, .high = {6, 6}};
  heat(block, T);
  auto solver = block.build<BSpline<2>>();
  const double held = solver->ledger().fluctuation, mass = density * 0.36;
  EXPECT_NEAR(held, 1.5 * T * mass, 1e-12 * held);
  for (int i = 0; i < 200; ++i) solver->step(dt);
  // Haff's law at constant coefficients, T = T0/(1 + t/tau)^2, from the first step: -dT = 2 T0
  // dt/tau. The solver's softness and its backward Euler step change it by kap sqrt(T) G and
  // dt/tau, each below one part in a hundred here.
  auto short_run = [&] {
    Cuboid<PlaneStrain> again{.box = {6, 6}, .low = {0, 0}, .high = {6, 6}};
    heat(again, T);
    auto other = again.build<BSpline<2>>();
    other->step(1e-7);
    return 2.0 * held * 1e-7 / other->ledger().regime_4;  // tau
  };
  const double tau = short_run(), left = held / std::pow(1.0 + solver->time() / tau, 2);
  EXPECT_LT(left, 0.9 * held);
  EXPECT_NEAR(solver->ledger().regime_4, held - left, 0.02 * (held - left));
  EXPECT_NEAR(solver->ledger().numerical(), 0.0, 1e-9 * held);
}

// Mixing: void ratios that differ within a cell become one, the cell's volume stays, and the
// elastic energy that this frees is that of the pressures evening out: sum V p^2/2K before, less V
// (mean p)^2/2K after.
TEST(Ledger, MixingFreesTheEnergyOfUnevenPressures) {
  Cuboid<PlaneStrain> block{.box = {4, 4}, .low = {0, 0}, .high = {4, 4}};
  block.body = linear_elastic(0.25);
  const double K = density * 100.0 / 1.8;  // P-wave modulus M = 9/5 K at nu = 1/4
  const auto above = [](const auto& x) { return std::fmod(x[1], 0.1) > 0.05; };
  block.stress = [&](const auto& x) { return SymTensor((above(x) ? 300.0 : 100.0) * identity()); };
  block.numerics.averaging = true;
  block.numerics.void_ratio_relaxation = 1e-3;
  auto solver = block.build<BSpline<2>>();
  // strain 100 Pa/K apart from the mean, one way and the other
  for (const std::size_t p : solver->points().occupied())
    solver->points().void_ratio[p] +=
        (above(solver->points().x[p]) ? -1 : 1) * 100.0 / K * (1.0 + void_ratio);
  const double volume = 0.16, held = solver->ledger().stored;
  for (int i = 0; i < 4000; ++i) solver->step(1e-5);
  double least = 1e9, most = -1e9;
  for (const std::size_t p : solver->points().occupied())
    least = std::min(least, solver->points().void_ratio[p]),
    most = std::max(most, solver->points().void_ratio[p]);
  EXPECT_NEAR(least, void_ratio, 1e-6);
  EXPECT_NEAR(most, void_ratio, 1e-6);
  const double freed = volume * 100.0 * 100.0 / (2.0 * K);
  EXPECT_NEAR(held - solver->ledger().stored, freed,
              0.01 * freed);  // strains of 2e-3: the volume they act on varies by that
  EXPECT_NEAR(solver->ledger().mixing, freed, 0.01 * freed);
  EXPECT_NEAR(solver->ledger().numerical(), freed, 0.01 * freed);
}

// Voids that even out between points are no flow: hot points whose grains collide without a loss
// neither gain nor lose fluctuation by it, however fast it goes.
TEST(Ledger, MixingLeavesFluctuationsAlone) {
  Cuboid<PlaneStrain> block{.box = {6, 6}, .low = {0, 0}, .high = {6, 6}};
  heat(block, 1e-3, {"material.effective_restitution=1"});
  block.numerics.void_ratio_relaxation = 1e-9;
  auto solver = block.build<BSpline<2>>();
  for (const std::size_t p : solver->points().occupied())
    solver->points().void_ratio[p] += std::fmod(solver->points().x[p][1], 0.1) > 0.05 ? 0.1 : -0.1;
  const double held = solver->ledger().fluctuation;
  solver->step(1e-6);
  for (const std::size_t p : solver->points().occupied())
    EXPECT_NEAR(solver->points().void_ratio[p], void_ratio, 2e-3);  // 0.05^2/2 of J is left
  EXPECT_NEAR(solver->ledger().fluctuation, held, 1e-9 * held);
  EXPECT_NEAR(solver->ledger().mixing, 0.0, 1e-9 * held);
}

// Detached: one point alone in its cell, under pressure and flying apart, gives the grid p V tr(L)
// dt and then nothing more.
TEST(Ledger, DetachedIsTheWorkBeyondTheCell) {
  // one step stretches a point to nine times its volume; at four times, twice its size, it is on
  // its own
  const double pressure = 1e-6, rate = 2.0, dt = 1.0;
  Cuboid<PlaneStrain> block{.box = {9, 9}, .low = {4, 4}, .high = {5, 5}, .points_per_cell = 1};
  block.body = linear_elastic(0.25);
  block.stress = [&](const auto&) { return SymTensor(pressure * identity()); };
  block.gradient = rate * Eigen::Matrix2d::Identity();
  block.numerics.averaging = false;
  auto solver = block.build<BSpline<2>>();
  solver->step(dt);
  const double volume = 0.01, beyond = 1.0 - std::log(4.0) / std::log(9.0),
               work = -pressure * volume * 2.0 * rate * dt * beyond;
  // the pressure itself speeds the point up by 4 p dt/(rho h) = 4e-8 m/s across 0.1 m, where it
  // stretches at 0.2 m/s
  EXPECT_NEAR(solver->ledger().detached, work, 1e-6 * std::abs(work));
  EXPECT_NEAR(solver->points().void_ratio[0], 4.0 * (1.0 + void_ratio) - 1.0, 1e-12);
  EXPECT_EQ(solver->points().sigma[0], SymTensor(SymTensor::Zero()));
  const double once = solver->ledger().detached;
  for (int i = 0; i < 100; ++i) solver->step(1e-7);
  EXPECT_EQ(solver->ledger().detached, once);
}

// A hot point alone keeps its heat for its own collisions: it must not turn it into motion again
// and again.
TEST(Ledger, ADetachedHotPointMakesNoEnergy) {
  Cuboid<PlaneStrain> block{.box = {9, 9}, .low = {4, 4}, .high = {5, 5}, .points_per_cell = 1};
  heat(block, 1.0);
  block.gradient = 100.0 * Eigen::Matrix2d::Identity();
  auto solver = block.build<BSpline<2>>();
  const double held = solver->ledger().held();
  for (int i = 0; i < 5000; ++i) solver->step(std::min(1e-5, solver->stable_step().dt));
  EXPECT_GT(solver->ledger().numerical(), -1e-3 * held);
  EXPECT_LE(solver->ledger().held(), held);
}

}  // namespace
}  // namespace grainpair
