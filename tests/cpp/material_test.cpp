// What every law of the registry must do, whatever it models.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <set>

#include "mpm/materials/hyperelastic.hpp"
#include "mpm/programs/driven_point.hpp"

namespace grainpair {
namespace {

/// A law, and the keys with which all of it is at work.
std::vector<std::string> keys_of(const std::string& law) {
  std::vector<std::string> keys{"mpm.stiffness=as given", "material.law=" + law};
  if (law == "contact_share")
    keys.insert(keys.end(), {"material.correlation_length=softened", "material.fabric_strain=0.2"});
  return keys;
}

class Point : public DrivenPoint {
 public:
  Point(const std::string& law, std::vector<std::string> keys = {})
      : DrivenPoint(Case::load(GRAINPAIR_SOURCE "/cases/column/case.toml", with(law, keys))) {}

 private:
  static std::vector<std::string> with(const std::string& law,
                                       const std::vector<std::string>& keys) {
    std::vector<std::string> all = keys_of(law);
    all.insert(all.end(), keys.begin(), keys.end());
    return all;
  }
};

std::vector<std::string> laws() {
  std::vector<std::string> names;
  for (const auto& [name, factory] : material_registry())
    if (name != "external") names.push_back(name);  // it needs a library: external_law_test
  return names;
}

class EveryLaw : public testing::TestWithParam<std::string> {};

TEST_P(EveryLaw, StartsAtTheGivenStress) {
  Point point(GetParam());
  const SymTensor stress = 1e3 * SymTensor{0.6, 1.0, 0.6, 0, 0, 0};  // inside every law's cone
  point.start(stress, 0.71);
  // 1e-10 of the stress: above round-off, and above the collisional pressure of T = 1e-15 m2/s2
  EXPECT_LT((point.sigma - stress).norm(), 1e-10 * stress.norm());
  EXPECT_GT(point.stability.modulus, 0.0);
  point.move(SymTensor::Zero(), Vec3::Zero(), 1e-5);
  EXPECT_LT((point.sigma - stress).norm(), 1e-10 * stress.norm());
}

// Random walks of strain from 1e-8 to 1 per step, tension and compression, e from 0.5 to far beyond
// contact. Work balances and nothing is created, but for `created` of the energies at hand.
void follow_random_paths(Point& point, int paths, double largest, double created) {
  Random random{std::mt19937_64(11)};
  for (int path = 0; path < paths; ++path) {
    point.start(at_rest(std::pow(10.0, random.between(1.0, 4.0))), random.between(0.6, 0.8));
    double held = point.held();
    const double size = std::pow(10.0, random.between(-6.0, largest)), dt = 1e-5;
    for (int i = 0; i < 20; ++i) {
      SymTensor strain = size * random.tensor();
      if (path % 3)
        strain -= random.between(0.9, 1.1) * trace(strain) / 3.0 * identity();  // nearly isochoric
      point.move(strain / dt, size * random.vector() / dt, dt);
      ASSERT_TRUE(point.sigma.allFinite() && std::isfinite(point.work) &&
                  std::isfinite(point.stability.modulus));
      const double scale = std::abs(point.work) + held + point.held() + point.dissipated();
      ASSERT_NEAR(point.work, point.held() - held + point.dissipated(), 1e-12 * scale);
      ASSERT_GE(point.energies.plastic, -created * scale);
      ASSERT_GE(point.energies.regime_4, 0.0);
      ASSERT_GE(point.energies.contact, 0.0);
      ASSERT_GE(point.held(), 0.0);
      held = point.held();
    }
  }
}

TEST_P(EveryLaw, RandomPathsBalanceAndDissipate) {
  Point point(GetParam());
  follow_random_paths(point, 10000, -1.0, 1e-14);
}

// Who is updated beside a point changes nothing, to the last bit.
TEST_P(EveryLaw, PointsTogetherEqualPointsAlone) {
  constexpr std::size_t count = 4 * 67 + 3;  // more than one window of sorting, and some left over
  Random random{std::mt19937_64(13)};
  std::vector<InitialState> initial(count);
  for (auto& start : initial)
    start = {at_rest(std::pow(10.0, random.between(1.0, 4.0))), random.between(0.69, 0.73),
             std::pow(10.0, random.between(-15.0, -2.0))};
  Batch together(count), alone(1);
  const auto body = [&] {
    auto made = material_registry().at(GetParam())(
        Case::load(GRAINPAIR_SOURCE "/cases/column/case.toml", keys_of(GetParam())));
    made->resize(count);
    made->initialise(0, initial, together);
    return made;
  };
  const auto flock = body(), loners = body();
  std::vector<Deformation> steps(count);
  for (std::size_t i = 0; i < count; ++i) steps[i].void_ratio = initial[i].void_ratio;
  std::set<int> regimes;
  for (int step = 0; step < 200; ++step) {
    for (std::size_t i = 0; i < count; ++i) {
      Deformation& s = steps[i];
      const double size = std::pow(10.0, random.between(-1.0, 2.0)), dt = 1e-5;
      s.D = size * deviator(random.tensor()) +
            0.02 * size * random.normal(random.engine) * identity();
      s.spin = step % 2 ? Vec3{0.0, 0.0, size * random.normal(random.engine)}
                        : Vec3(size * random.vector());
      s.dt = dt, s.void_ratio_old = s.void_ratio;
      s.void_ratio = (1.0 + s.void_ratio_old) * std::exp(-trace(s.D) * dt) - 1.0;
      together.steps.set(i, s);
    }
    const auto regime = together.regime;  // before
    flock->update(0, together);
    for (std::size_t i = 0; i < count; ++i) {
      alone.steps.set(0, steps[i]);
      alone.regime[0] = regime[i];
      loners->update(i, alone);
      ASSERT_EQ(together.sigma[i], alone.sigma[0]) << i;
      ASSERT_EQ(together.energies[i].stored, alone.energies[0].stored) << i;
      ASSERT_EQ(together.regime[i], alone.regime[0]) << i;
      // a difference of energies, in which the compiler may fuse one multiplication here and
      // another there
      const auto& e = alone.energies[0];
      ASSERT_NEAR(together.work[i], alone.work[0],
                  4e-16 * (2.0 * e.stored + e.plastic + e.fluctuation + e.regime_4 + e.contact +
                           std::abs(alone.work[0])))
          << i;
      regimes.insert(alone.regime[0]);
    }
  }
  EXPECT_GE(regimes.size(), GetParam() == "linear_elastic" ? 1u : 2u);
}

// In a plane, what stays zero is neither read nor written: whatever lies there, points do what they
// do in space.
TEST_P(EveryLaw, PointsInAPlaneDoAsInSpace) {
  constexpr std::size_t count = 4 * 20 + 1;
  Random random{std::mt19937_64(29)};
  std::vector<InitialState> initial(count);
  for (auto& start : initial)
    start = {at_rest(std::pow(10.0, random.between(1.0, 4.0))), random.between(0.69, 0.73),
             std::pow(10.0, random.between(-15.0, -2.0))};
  Batch plane(count, false), space(count);
  plane.in_plane = true;
  const auto body = [&](Batch& batch) {
    auto made = material_registry().at(GetParam())(
        Case::load(GRAINPAIR_SOURCE "/cases/column/case.toml", keys_of(GetParam())));
    made->resize(count);
    made->initialise(0, initial, batch);
    return made;
  };
  const auto in_plane = body(plane), in_space = body(space);
  for (int step = 0; step < 100; ++step) {
    for (std::size_t i = 0; i < count; ++i) {
      Deformation s;
      const double size = std::pow(10.0, random.between(-1.0, 2.0)), e = initial[i].void_ratio,
                   nan = std::nan("");
      s.D = size * deviator(random.tensor());
      s.D.tail<2>().setZero();
      s.spin = {0.0, 0.0, size * random.normal(random.engine)};
      s.dt = 1e-5, s.void_ratio_old = s.void_ratio = e;
      space.steps.set(i, s);
      s.D.tail<2>().setConstant(nan), s.spin.head<2>().setConstant(nan);
      plane.steps.set(i, s);
      plane.sigma[i].tail<2>().setConstant(nan);
    }
    in_plane->update(0, plane), in_space->update(0, space);
    for (std::size_t i = 0; i < count; ++i) {
      const SymTensor expected = space.sigma[i];
      ASSERT_EQ(expected.tail<2>().norm(), 0.0);
      // round-off of each step, carried on by an elastic strain
      ASSERT_LE((plane.sigma[i].head<4>() - expected.head<4>()).norm(),
                1e-13 * (step + 1) * (1.0 + expected.norm()))
          << i;
      ASSERT_EQ(plane.regime[i], space.regime[i]) << i;
    }
  }
}

// The same motion seen from a rotated frame, and from one that turns with the point.
TEST_P(EveryLaw, IsObjective) {
  Random random{std::mt19937_64(12)};
  for (int path = 0; path < 100; ++path) {
    Point still(GetParam()), turned(GetParam());
    const Mat3 R = Eigen::Quaterniond::UnitRandom().toRotationMatrix();
    const Vec3 spin = 50.0 * random.vector();
    Mat3 Q = R;
    still.start(at_rest(1e3), 0.705);
    turned.start(rotated(at_rest(1e3), R), 0.705);
    const double dt = 1e-4;
    for (int i = 0; i < 50; ++i) {
      const SymTensor D =
          3.0 * deviator(random.tensor()) + 0.01 * random.normal(random.engine) * identity();
      Q = Eigen::AngleAxisd(spin.norm() * dt, spin.normalized()).toRotationMatrix() * Q;
      still.move(D, Vec3::Zero(), dt);
      turned.move(rotated(D, Q), spin, dt);
      // one rotation is good to (angle/2)^11, 1e-25 at 0.01 rad; what is left is round-off
      ASSERT_LT((turned.sigma - rotated(still.sigma, Q)).norm(), 1e-9 * (1.0 + still.sigma.norm()));
      ASSERT_NEAR(turned.work, still.work, 1e-9 * (std::abs(still.work) + still.held()));
    }
  }
}

TEST_P(EveryLaw, StressWorkIsTheIntegralOfStressOverStrain) {
  // Work as the law reports it against the trapezoidal rule on its stress: second order in the
  // step.
  const auto difference = [&](int steps) {
    Point point(GetParam());
    point.start(at_rest(1e3), 0.709);
    const double rate = 1.0, duration = 2e-2, dt = duration / steps;
    const SymTensor D{-0.01 * rate, 0.01 * rate, 0.0, rate / std::numbers::sqrt2, 0.0, 0.0};
    double work = 0.0, trapezoid = 0.0;
    for (int i = 0; i < steps; ++i) {
      const SymTensor before = point.sigma;
      point.move(D, Vec3::Zero(), dt);
      work += point.work;
      trapezoid += 0.5 * (before + point.sigma).dot(D) * dt * 1.709 / 2532.0;
    }
    return std::abs(work - trapezoid) / std::abs(trapezoid);
  };
  EXPECT_LT(difference(800), 1e-3);
  EXPECT_LT(difference(800), 0.5 * difference(200) + 1e-13);  // or exact already
}

TEST_P(EveryLaw, SmallClosedLoopsLoseNothing) {
  // Inside the cone every law but a viscous one is elastic; a loop of three strains, all three
  // planes.
  Point point(GetParam(), {"material.collisions=false"});
  point.start(1e3 * identity(), 0.70);
  const double held = point.held();
  const double size = 1e-5 * (GetParam() == "linear_elastic" ? 10.0 : 1.0), dt = 1e-4;
  double work = 0.0, turnover = 0.0;
  const int steps = 400;
  for (int i = 0; i < steps; ++i) {
    const auto at = [&](double turn) {
      const double t = 2.0 * std::numbers::pi * turn;
      return SymTensor{size * std::sin(t), -size * std::sin(2 * t),      size * (1 - std::cos(t)),
                       size * std::sin(t), size * (1 - std::cos(3 * t)), 0.0};
    };
    point.move((at((i + 1.0) / steps) - at(double(i) / steps)) / dt, Vec3::Zero(), dt);
    EXPECT_EQ(point.regime, 1);
    work += point.work;
    turnover += std::abs(point.work);
  }
  EXPECT_GT(turnover, 0.1 * held);
  EXPECT_NEAR(work, 0.0, 1e-10 * turnover);
  EXPECT_NEAR(point.held(), held, 1e-10 * held);
  EXPECT_LT((point.sigma - 1e3 * identity()).norm(), 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Registry, EveryLaw, testing::ValuesIn(laws()),
                         [](const auto& test) { return test.param; });

// The other integrator, whose dissipation is an integral known to its relative tolerance, 1e-6.
// Steps to 1e-3: the error control takes thousands of substeps for larger ones, which the ones that
// follow it do not need.
class LawByRates : public testing::TestWithParam<std::string> {};

TEST_P(LawByRates, RandomPathsBalanceAndDissipate) {
  Point point(GetParam(), {"material.integrator=dormand_prince"});
  follow_random_paths(point, 500, -3.0, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Registry, LawByRates,
                         testing::Values("critical_state", "solid_fluid", "contact_share"),
                         [](const auto& test) { return test.param; });

class LawWithoutCohesion : public testing::TestWithParam<std::string> {};

TEST_P(LawWithoutCohesion, OpensAndClosesWithoutGainingVolume) {
  // Torn open, sheared while open, closed again: stress returns at the void ratio at which it left.
  Point point(GetParam());
  point.start(1e3 * identity(), 0.71);
  double e_open = 0.0, e_closed = 0.0;
  const double dt = 1e-5;
  const SymTensor shear{0, 0, 0, 30.0, 0, 0};
  for (int i = 0; i < 4000; ++i) {
    const bool opening = i < 2000;
    const bool loaded = trace(point.sigma) > 0.0;
    point.move((opening ? -1.0 : 1.0) * identity() + (loaded ? 0.0 : 1.0) * shear, Vec3::Zero(),
               dt);
    const bool now = trace(point.sigma) > 0.0;
    if (loaded && !now) e_open = point.void_ratio;
    if (!loaded && now) e_closed = point.void_ratio;
    if (!now) {
      EXPECT_EQ(point.sigma, SymTensor::Zero());
      EXPECT_EQ(point.held(), 0.0);
    }
  }
  const double step = 3.0 * dt * 1.71;  // void ratio passed in one step
  EXPECT_GT(e_open, 0.71);
  EXPECT_NEAR(e_closed, e_open, 1.01 * step);
}

INSTANTIATE_TEST_SUITE_P(Registry, LawWithoutCohesion,
                         testing::Values("drucker_prager", "lade_duncan"));

// material.dilation d of lade_duncan: plastic expansion d per equivalent plastic shear strain,
// sqrt(2/3) |dev eps_p|. Sheared at constant volume, that expansion is elastic compression, and the
// pressure grows.
class Dilation : public testing::TestWithParam<double> {};

TEST_P(Dilation, ExpandsInProportionToPlasticShear) {
  const double d = GetParam(), e = 0.71, dt = 1e-5;
  const Case material = Case::load(GRAINPAIR_SOURCE "/cases/column/case.toml",
                                   {"mpm.stiffness=as given", "material.law=lade_duncan",
                                    fmt::format("material.dilation={}", d)});
  const Hyperelastic elasticity(material);
  Point point("lade_duncan", {fmt::format("material.dilation={}", d)});
  point.start(at_rest(1e3), e);  // e is the reference void ratio: tau is sigma
  const double p_start = trace(point.sigma) / 3.0;
  int plastic = 0;
  for (int i = 0; i < 400; ++i) {
    const SymTensor increment = 1e-5 * SymTensor{1.0, -1.0, 0.0, 2.0, 0.0, 0.0};
    const SymTensor before = elasticity.strain(point.sigma);
    point.move(increment / dt, Vec3::Zero(), dt);
    ASSERT_GE(point.energies.plastic, 0.0);
    if (point.regime != 2) continue;
    ++plastic;
    const SymTensor flow = increment - (elasticity.strain(point.sigma) - before);
    // strains of 1e-3, rounded to 1e-16 of that, and returned to 1e-13
    ASSERT_NEAR(trace(flow), -d * std::sqrt(2.0 / 3.0) * deviator(flow).norm(), 1e-15);
  }
  EXPECT_GT(plastic, 200);
  const double p = trace(point.sigma) / 3.0;
  if (d > 0.0)
    EXPECT_GT(p, 1.5 * p_start);
  else
    EXPECT_LT(p, 1.5 * p_start);
}

INSTANTIATE_TEST_SUITE_P(Expansions, Dilation, testing::Values(0.0, 0.05, 0.3));

}  // namespace
}  // namespace grainpair
