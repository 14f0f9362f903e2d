// Standing waves in an elastic body, with every set of shape functions.
#include <gtest/gtest.h>

#include "tests/cpp/block.hpp"

namespace grainpair {
namespace {

using namespace test;

template <class Shape>
class WavesOf : public testing::Test {};
using Shapes = testing::Types<BSpline<1>, BSpline<2>, BSpline<3>, Gimp>;
TYPED_TEST_SUITE(WavesOf, Shapes);

/// Longitudinal standing wave of a bar, fixed at x = 0 and free at x = L: v = v0 sin(pi x/2L) cos(w
/// t), w = pi c/2L.
struct StandingWave {
  double error, loss;  // relative L2 error of the velocity after half a period; numerical loss over
                       // initial energy
};

template <class Shape>
StandingWave standing_wave(int cells, TransferScheme scheme, StressUpdate update) {
  const double length = 1.0, v0 = 1e-3, c = 10.0;
  Cuboid<PlaneStrain> block{
      .h = length / cells, .box = {cells + 4, 4}, .low = {0, 0}, .high = {cells, 4}};
  block.body = linear_elastic(0.25);  // confined between rollers: the P-wave speed, 10 m/s
  const double k = 0.5 * std::numbers::pi / length;
  block.velocity = [&](const auto& x) { return Eigen::Vector2d(v0 * std::sin(k * x[0]), 0.0); };
  block.numerics.transfer = scheme;
  block.numerics.stress_update = update;
  block.numerics.averaging = false;
  block.numerics.velocity_relaxation = 0.0;
  block.numerics.time_step_fraction = 0.2;
  auto solver = block.build<Shape>();
  const double energy = solver->ledger().kinetic, half_period = std::numbers::pi / (k * c);
  const int steps = static_cast<int>(std::ceil(half_period / solver->stable_step().dt));
  for (int i = 0; i < steps; ++i) solver->step(half_period / steps);
  double error = 0.0, norm = 0.0;  // after half a period every velocity has changed sign
  for (const std::size_t p : solver->points().occupied()) {
    const double exact = -v0 * std::sin(k * solver->position(p)[0]);
    error += std::pow(solver->velocity(p)[0] - exact, 2);
    norm += exact * exact;
  }
  return {std::sqrt(error / norm), solver->ledger().numerical() / energy};
}

TYPED_TEST(WavesOf, StandingWaveConverges) {
  const auto coarse = standing_wave<TypeParam>(8, TransferScheme::flip, StressUpdate::last);
  const auto fine = standing_wave<TypeParam>(32, TransferScheme::flip, StressUpdate::last);
  const double order = std::log2(coarse.error / fine.error) / 2.0;
  this->RecordProperty("order", std::to_string(order));
  this->RecordProperty("error", std::to_string(fine.error));
  EXPECT_LT(fine.error, 0.015);
  EXPECT_GT(coarse.error / fine.error,
            3.0);  // 4 at first order, which the free end's smeared node imposes
}

TYPED_TEST(WavesOf, StandingWaveKeepsItsEnergy) {
  EXPECT_LT(std::abs(standing_wave<TypeParam>(20, TransferScheme::flip, StressUpdate::last).loss),
            0.01);
  // PIC's loss is the negative control
  EXPECT_GT(standing_wave<TypeParam>(20, TransferScheme::pic, StressUpdate::last).loss, 0.05);
}

}  // namespace
}  // namespace grainpair
