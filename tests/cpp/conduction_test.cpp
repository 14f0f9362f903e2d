// Conduction of granular temperature against the heat equation, 3/2 rho dT/dt = kappa lap T.
#include <gtest/gtest.h>

#include "tests/cpp/block.hpp"
#include "tests/cpp/inert.hpp"

namespace grainpair {
namespace {

using namespace test;

constexpr double kappa = 30.0;  // [Pa s]

/// No stress and no collisions: temperature that conducts, and nothing else.
struct Warm {
  template <class Real>
  struct State {
    Real temperature = 0.0;
  };
  explicit Warm(const Case&) {}
  Response<double, State> initial(const InitialState& start) const {
    return respond<double>({start.granular_temperature});
  }
  template <class Real>
  Response<Real, State> update(const State<Real>& old, const DeformationOf<Real>&) const {
    return respond<Real>(old);
  }
  template <class Real>
  StabilityOf<Real> stability(const State<Real>&, const Real&) const {
    return {1.0, 0.0};
  }
  template <class Real>
  Real granular_temperature(const State<Real>& state) const {
    return state.temperature;
  }
  double conductivity(const State<double>&, double) const { return kappa; }
  State<double> heated(const State<double>& state, double energy) const {
    return {std::max(0.0, state.temperature + energy / 1.5)};
  }

 private:
  template <class Real>
  static Response<Real, State> respond(const State<Real>& state) {
    Response<Real, State> r;
    r.sigma = Tensor<Real>::Zero();
    r.state = state;
    r.energies.fluctuation = 1.5 * state.temperature;
    return r;
  }
};

Cuboid<PlaneStrain> box(int cells, bool conduction) {
  Cuboid<PlaneStrain> block{
      .h = 1.0 / cells, .box = {cells, cells}, .low = {0, 0}, .high = {cells, cells}};
  block.body = std::make_unique<BodyOf<Warm>>(Warm(any_case()));
  block.numerics.conduction = conduction;
  return block;
}

/// Amplitude of T = 1 + A cos(pi x), from A = 1/2, after a time in which the heat equation halves
/// it.
double amplitude(int cells, bool conduction) {
  const double decay = kappa * std::numbers::pi * std::numbers::pi / (1.5 * density),
               time = std::log(2.0) / decay;
  auto block = box(cells, conduction);
  block.granular_temperature = [](const auto& x) {
    return 1.0 + 0.5 * std::cos(std::numbers::pi * x[0]);
  };
  auto solver = block.build<BSpline<2>>();
  const double held = solver->ledger().fluctuation;
  const int steps = 50;
  for (int i = 0; i < steps; ++i) solver->step(time / steps);
  EXPECT_NEAR(solver->ledger().fluctuation, held, 1e-12 * held);
  EXPECT_NEAR(solver->ledger().conduction, 0.0, 1e-12 * held);
  double sum = 0.0;
  const auto& points = solver->points();
  for (const std::size_t p : points.occupied())
    sum += 2.0 * points.granular_temperature[p] * std::cos(std::numbers::pi * points.x[p][0]);
  return sum / static_cast<double>(points.size());
}

TEST(Conduction, ACosineDecaysAsTheHeatEquationSays) {
  // Each of the four passes between points and nodes spreads what it takes over weights of variance
  // h^2/4, and so takes k^2 h^2/8 off the mode: the rate of decay is short by k^2 h^2/2, to the
  // next order.
  for (const int cells : {8, 16}) {
    const double kh = std::numbers::pi / cells, expected = 0.5 * std::pow(0.5, 1.0 - 0.5 * kh * kh);
    EXPECT_NEAR(amplitude(cells, true), expected, 0.1 * (expected - 0.25));
  }
  EXPECT_NEAR(amplitude(16, false), 0.5, 1e-3);  // and without the stage it does not
}

TEST(Conduction, WhatAPointPassesOnIsWhatOthersGet) {
  auto block = box(8, true);
  block.granular_temperature = [](const auto& x) { return x[0] < 0.5 ? 1.0 : 0.0; };
  auto solver = block.build<BSpline<2>>();
  const double held = solver->ledger().fluctuation, total = solver->ledger().total();
  for (int i = 0; i < 400; ++i) solver->step(0.05);
  const auto& points = solver->points();
  double net = 0.0, gained = 0.0;
  for (const std::size_t p : points.occupied()) {
    EXPECT_GE(points.granular_temperature[p], 0.0);
    net += points.mass[p] * points.conducted[p];
    if (points.x[p][0] > 0.5) gained += points.mass[p] * points.conducted[p];
  }
  // cold points are never asked for more than they have here by more than the overshoot of the
  // first steps
  EXPECT_NEAR(net, -solver->ledger().conduction, 1e-12 * held);
  EXPECT_LT(std::abs(solver->ledger().conduction), 0.01 * held);
  EXPECT_NEAR(gained, 0.5 * held,
              0.05 * held);  // in 20 s, 2.7 decay times of the slowest mode, one half has gone over
  EXPECT_GE(solver->ledger().conducted, gained);
  EXPECT_NEAR(solver->ledger().total(), total, 1e-12 * held);
}

}  // namespace
}  // namespace grainpair
