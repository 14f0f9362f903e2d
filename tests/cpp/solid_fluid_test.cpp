// The quasi-static half through all its regimes, by both integrators.
#include <gtest/gtest.h>

#include <map>

#include "mpm/materials/dormand_prince.hpp"
#include "mpm/materials/quasi_static.hpp"

namespace grainpair {
namespace {

constexpr double M_c = 0.9, e_c = 0.709;

QuasiStatic model(double n = 0.5, CriticalState::Form form = CriticalState::Form::linear) {
  return {Hyperelastic(380.0, 48.0, n, 1e5), LadeDuncan(M_c),
          CriticalState(3e8, e_c, 0.56, form, M_c / 0.35, M_c), SolidVolume(0.71, 2532.0)};
}

const SymTensor k0 = 1e3 * SymTensor{0.75, 1.5, 0.75, 0, 0, 0};

/// Volumetric strain and shear along a path of parameter x from 0 to 1 that visits every regime:
/// sheared while loose (1, 2), compressed onto the critical-state locus and along it (3), opened
/// (4), compressed again (3); in between the shear turns back (1).
double volume_at(double x) {
  return x < 0.3   ? 0.0
         : x < 0.6 ? 1.2e-3 * (x - 0.3) / 0.3
         : x < 0.8 ? 1.2e-3 - 2.0e-3 * (x - 0.6) / 0.2
                   : -0.8e-3 + 2.2e-3 * (x - 0.8) / 0.2;
}
double shear_at(double x) {
  return x < 0.7 ? 0.1 * x : x < 0.75 ? 0.07 - 0.1 * (x - 0.7) : 0.065 + 0.1 * (x - 0.75);
}

struct End {
  double p, q, dissipated, work;
  int switches;
  std::map<double, int> visits;
};

template <class Integrate>
End follow(const QuasiStatic& law, const Integrate& integrate, int steps) {
  QuasiStaticResponse<double> r = law.initial(k0, 0.71);
  End end{};
  double e = 0.71;
  for (int i = 0; i < steps; ++i) {
    const double x0 = static_cast<double>(i) / steps, x1 = (i + 1.0) / steps;
    const double volume = volume_at(x1) - volume_at(x0), shear = shear_at(x1) - shear_at(x0);
    SymTensor increment = volume / 3.0 * identity() +
                          shear * SymTensor{0.2, -0.2, 0.0, 1.0 / std::numbers::sqrt2, 0.0, 0.0};
    const double next = (1.0 + e) * std::exp(-volume) - 1.0, held = r.stored;
    const QuasiStaticState<double> before = r.state;
    r = integrate(before, increment, e, next);
    EXPECT_GE(r.dissipated, -1e-12 * (held + r.stored));
    EXPECT_NEAR(r.work, r.stored - held + r.dissipated, 1e-12 * (held + r.stored + r.dissipated));
    end.switches += r.state.regime != before.regime;
    ++end.visits[r.state.regime];
    end.dissipated += r.dissipated, end.work += r.work;
    e = next;
  }
  end.p = trace(r.stress) / 3.0, end.q = von_mises(r.stress);
  return end;
}
End closed_form(const QuasiStatic& law, int steps) {
  return follow(
      law, [&](auto&&... a) { return law.implicit(a...); }, steps);
}
End dormand_prince(const QuasiStatic& law, int steps, double tolerance) {
  return follow(law, DormandPrince(law, tolerance), steps);
}

class Exponent : public testing::TestWithParam<double> {};

TEST_P(Exponent, BothIntegratorsConvergeToOnePathThroughAllRegimes) {
  const QuasiStatic law = model(GetParam());
  const End exact = dormand_prince(law, 2560, 1e-10);
  for (const double regime : {visco_elastic, visco_plastic, critical, collisional})
    EXPECT_GT(exact.visits.at(regime), 0);
  const auto error = [&](const End& end) {
    return std::abs(end.dissipated - exact.dissipated) / exact.dissipated;
  };

  // The locus and the cone fix the stress at the end; what remains of the step size is in the
  // dissipation, first order.
  const End coarse = closed_form(law, 160), fine = closed_form(law, 2560);
  EXPECT_NEAR(fine.p, exact.p, 1e-4 * exact.p);
  EXPECT_NEAR(fine.q, exact.q, 1e-4 * exact.q);
  EXPECT_LT(error(fine), 1e-3);
  EXPECT_LT(error(fine),
            error(coarse) / 4.0);  // 16 steps for one; the regimes' ends fall where they may

  // Error control makes Dormand-Prince independent of the step.
  const End few = dormand_prince(law, 20, 1e-8);
  EXPECT_NEAR(few.p, exact.p, 1e-5 * exact.p);
  EXPECT_LT(error(few), 1e-5);
}

TEST_P(Exponent, RegimesSwitchAsOftenAtAnyStep) {
  const QuasiStatic law = model(GetParam());
  const int settled = closed_form(law, 10240).switches;
  EXPECT_LE(settled, 6);  // 1 -> 2 -> 3 -> 4 -> 3, and where the shear turns back
  for (const int steps : {160, 640, 2560})
    EXPECT_EQ(closed_form(law, steps).switches, settled) << steps;
  EXPECT_EQ(dormand_prince(law, 160, 1e-8).switches, dormand_prince(law, 640, 1e-8).switches);
}

INSTANTIATE_TEST_SUITE_P(OfTheStiffness, Exponent, testing::Values(0.0, 1.0 / 3.0, 0.5));

TEST(CriticalRegime, KeepsToTheLocusAndTheCone) {
  // 0.2 % of shear with a little dilation, from a point on the locus.
  for (const double n : {0.0, 0.5}) {
    const QuasiStatic law = model(n);
    double e = 0.7089;
    const double p = law.locus.pressure(e);
    const SymTensor eta =
        SymTensor{1.0, -1.0, 0.0, 0.0, 0.0, 0.0} / std::numbers::sqrt2 * 0.67;  // on the cone
    QuasiStaticResponse<double> r = law.initial(p * (identity() + eta), e);
    r.state.regime = critical;
    const DormandPrince rates(law, 1e-8);
    for (int i = 0; i < 20; ++i) {
      const SymTensor increment =
          1e-4 * SymTensor{1.0, -1.0, 0.0, 0.3, 0.0, 0.0} - 1e-7 * identity();
      const double next = (1.0 + e) * std::exp(-trace(increment)) - 1.0;
      const QuasiStaticResponse<double> direct = law.implicit(r.state, increment, e, next);
      r = rates(r.state, increment, e, next);
      e = next;
      for (const QuasiStaticResponse<double>& end : {r, direct}) {
        ASSERT_EQ(end.state.regime, critical);
        const double p_end = trace(end.stress) / 3.0;
        EXPECT_NEAR(p_end * law.volume.cauchy(e), law.locus.pressure(e), 1e-6 * p);
        EXPECT_NEAR(law.cone.yield(deviator(end.stress) / p_end), 0.0, 1e-8);
      }
    }
  }
}

TEST(CriticalRegime, IsTheEndOfShearAtConstantVolume) {
  // From either side of the locus, state-dependent dilatancy drives p to p_cs(e).
  const QuasiStatic law = model();
  const double e = 0.70895, p_cs = law.locus.pressure(e);
  for (const double factor : {0.2, 5.0}) {
    QuasiStaticResponse<double> r = law.initial(factor * p_cs * identity(), e);
    for (int i = 0; i < 400000; ++i)
      r = law.implicit(r.state, SymTensor{0, 0, 0, 1e-3 / std::numbers::sqrt2, 0, 0}, e, e);
    EXPECT_NEAR(trace(r.stress) / 3.0 * law.volume.cauchy(e), p_cs, 0.01 * p_cs) << factor;
  }
}

TEST(CriticalState, LocusAndItsInverse) {
  for (const auto form : {CriticalState::Form::linear, CriticalState::Form::two_thirds,
                          CriticalState::Form::square_root}) {
    const CriticalState locus(3e8, e_c, 0.56, form, 2.57, M_c);
    for (const double e : {0.60, 0.70, 0.7085}) {
      EXPECT_NEAR(locus.void_ratio(locus.pressure(e)), e, 1e-12);
      const double h = 1e-7;  // K = -(1+e) dp/de
      EXPECT_NEAR(-(1.0 + e) * (locus.pressure(e + h) - locus.pressure(e - h)) / (2.0 * h),
                  locus.modulus(e), 1e-5 * locus.modulus(e));
    }
    EXPECT_EQ(locus.pressure(e_c), 0.0);
    EXPECT_EQ(locus.pressure(0.8), 0.0);
    EXPECT_NEAR(locus.flow_ratio(e_c, 0.0), 0.0, 1e-14);  // round-off of 1/(1+e), times A
  }
}

TEST(CriticalState, NumbersOfTheSeed) {
  const CriticalState locus(3e8, e_c, 0.56, CriticalState::Form::linear, M_c / 0.35, M_c);
  EXPECT_NEAR(locus.modulus(0.7089), 98e6, 0.5e6);
  EXPECT_NEAR(e_c - locus.void_ratio(1e3), 1.74e-5, 0.02e-5);
  EXPECT_NEAR(locus.A, 2.571, 5e-4);
  // D_0 = 2.6e-3 at psi = 1e-3
  EXPECT_NEAR(locus.flow_ratio(0.71, 0.0) / std::sqrt(2.0 / 3.0), 2.57e-3, 0.01e-3);
}

TEST(Opening, ReturnsWhatWasStoredOrDissipatesIt) {
  const QuasiStatic law = model();
  // isotropic expansion past separation: the stress gives all its energy back, but for what one
  // trapezoid cannot see
  QuasiStaticResponse<double> r = law.initial(1e3 * identity(), 0.715);
  const double stored = r.stored;
  double e = 0.715, work = 0.0, dissipated = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const double next = (1.0 + e) * std::exp(1e-6) - 1.0;
    r = law.implicit(r.state, -1e-6 / 3.0 * identity(), e, next);
    work += r.work, dissipated += r.dissipated, e = next;
  }
  EXPECT_EQ(r.state.regime, collisional);
  EXPECT_NEAR(work, -stored, 1e-6 * stored);
  EXPECT_NEAR(dissipated, 0.0, 1e-6 * stored);
}

TEST(InitialStress, InsideTheConeForTheUsualEarthPressures) {
  const LadeDuncan cone(M_c);
  const auto holds = [&](double K0) {
    const SymTensor sigma{K0, 1.0, K0, 0, 0, 0};
    return cone.holds(deviator(sigma) / (trace(sigma) / 3.0));
  };
  EXPECT_TRUE(holds(0.5));
  EXPECT_TRUE(holds(0.45));
  EXPECT_FALSE(holds(0.40));
}

}  // namespace
}  // namespace grainpair
