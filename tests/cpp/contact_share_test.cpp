// The share of the shear stress that enduring contacts carry: its size, its account, and that it
// leaves the fluctuations alone.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <complex>

#include "mpm/materials/kinetic_theory.hpp"
#include "tests/cpp/block.hpp"

namespace grainpair {
namespace {

using namespace test;

constexpr double chi = 0.123, onset = 6.69;

Case material(double share, const std::string& length = "softened") {
  return Case::load(
      GRAINPAIR_SOURCE "/cases/column/case.toml",
      {"mpm.stiffness=as given", "mpm.viscous_stiffness=0", "material.law=contact_share",
       "material.collision_time_factor=4.18", fmt::format("material.correlation_length={}", length),
       fmt::format("material.correlation_onset={}", onset),
       fmt::format("material.contact_share={}", share)});
}

/// What a point in steady simple shear says, its dissipations per second.
struct Steady {
  double temperature, pressure, shear, regime_4, contact, viscosity;
};

Steady sheared(const std::string& law, const Case& constants, double nu, double rate) {
  const auto body = material_registry().at(law)(constants);
  const double e = 1.0 / nu - 1.0, dt = 1e-3 / rate;
  body->resize(1);
  Batch batch(1);
  const InitialState cold{SymTensor::Zero(), e, 1e-15};
  body->initialise(0, {&cold, 1}, batch);
  batch.steps.set(0, {SymTensor{0, 0, 0, rate / std::numbers::sqrt2, 0, 0},
                      Vec3{0.0, 0.0, -0.5 * rate}, dt, e, e});
  for (int i = 0; i < 10000; ++i) body->update(0, batch);
  const Energies energies = batch.energies[0];
  return {batch.granular_temperature[0],
          trace(batch.sigma[0]) / 3.0,
          batch.sigma[0][3] / std::numbers::sqrt2,
          energies.regime_4 / dt,
          energies.contact / dt,
          batch.stability[0].viscosity};
}

class ContactShare : public testing::TestWithParam<double> {};  // solid fraction

TEST_P(ContactShare, IsWhatItsLengthSaysInSteadyShear) {
  const double nu = GetParam();
  for (const double rate : {5.0, 500.0}) {
    const Steady with = sheared("contact_share", material(chi), nu, rate);
    const KineticTheory gas(material(chi));
    const double share =
        chi * (gas.correlation_length(1.0 / nu - 1.0, rate, std::sqrt(with.temperature)) - 1.0);
    const Steady without = sheared("contact_share", material(0.0), nu, rate);
    // it feeds no fluctuation: temperature and pressure do not know of it
    EXPECT_EQ(with.temperature, without.temperature);
    EXPECT_EQ(with.pressure, without.pressure);
    // a lag of the length by one step of 1e-3 strain is what is left once steady
    EXPECT_NEAR(with.shear, (1.0 + share) * without.shear, 1e-6 * with.shear);
    // steady, so the collisions dissipate their own work
    EXPECT_NEAR(with.contact, share * with.regime_4, 1e-6 * with.regime_4);
    EXPECT_NEAR((with.regime_4 + with.contact) * 2532.0 * nu, with.shear * rate,
                1e-6 * with.shear * rate);
    const double shear_viscosity = (with.shear - without.shear) / rate;
    EXPECT_NEAR(with.viscosity - without.viscosity, 4.0 / 3.0 * shear_viscosity,
                1e-6 * with.viscosity);
    // the control: Berzi's length is another one
    const Steady other = sheared("contact_share", material(chi, "berzi"), nu, rate);
    const Steady of_collisions = sheared("contact_share", material(0.0, "berzi"), nu, rate);
    EXPECT_GT(std::abs(other.shear / of_collisions.shear - 1.0 - share), 0.02);
  }
}

TEST_P(ContactShare, OfNothingIsTheSeedsLaw) {
  const Case none = material(0.0);
  const Steady ours = sheared("contact_share", none, GetParam(), 20.0),
               seeds = sheared("solid_fluid", none, GetParam(), 20.0);
  EXPECT_NEAR(ours.shear, seeds.shear, 1e-12 * seeds.shear);
  EXPECT_NEAR(ours.temperature, seeds.temperature, 1e-12 * seeds.temperature);
  EXPECT_EQ(ours.contact, 0.0);
  const Steady more = sheared("contact_share", material(chi), GetParam(), 20.0);
  EXPECT_GT(more.shear, 1.05 * seeds.shear);
}

INSTANTIATE_TEST_SUITE_P(Dense, ContactShare, testing::Values(0.57, 0.58));

/// x of the fabric, told by pressure and temperature: 1/G solves p = 4 F nu rho T/(1/G + kap
/// sqrt(T)), F = (1 + e_n)/2 + 1/(4 G), and lies between its values with structure and without.
double structure(const KineticTheory& gas, double e, double temperature, double pressure) {
  const double s = std::sqrt(temperature), scale = 2532.0 / (1.0 + e) * temperature;
  const double F0 = 0.5 * (1.0 + gas.parameters.restitution);
  const double i = (4.0 * F0 * scale / pressure - gas.kap * s) / (1.0 - scale / pressure);
  const double with = gas.inverse_g(e), without = gas.inverse_g(e, KineticTheory::nu_rcp);
  return (i - without) / (with - without);
}

/// From rest to a strain of 1, and the other way: x at every 1/50 of strain.
std::vector<double> structures(double fabric_strain, double nu) {
  const Case constants = Case::load(GRAINPAIR_SOURCE "/cases/column/case.toml",
                                    {"mpm.stiffness=as given", "material.law=contact_share",
                                     fmt::format("material.fabric_strain={}", fabric_strain)});
  const auto body = material_registry().at("contact_share")(constants);
  const KineticTheory gas(constants);
  const double e = 1.0 / nu - 1.0, rate = 100.0, dt = 1e-4 / rate;
  body->resize(1);
  Batch batch(1);
  const InitialState cold{SymTensor::Zero(), e, 1e-15};
  body->initialise(0, {&cold, 1}, batch);
  std::vector<double> found;
  for (int i = 0; i < 20000; ++i) {
    const double turn = i < 10000 ? rate : -rate;
    batch.steps.set(0, {SymTensor{0, 0, 0, turn / std::numbers::sqrt2, 0, 0},
                        Vec3{0.0, 0.0, -0.5 * turn}, dt, e, e});
    body->update(0, batch);
    if ((i + 1) % 200 == 0)
      found.push_back(
          structure(gas, e, batch.granular_temperature[0], trace(batch.sigma[0]) / 3.0));
  }
  return found;
}

TEST(ContactFabric, FormsAndTurnsWithStrain) {
  // along the flow and beside it, z' = (sqrt(1 + g^2) - z)/g + i z; turned round, z is - conj z
  using Complex = std::complex<double>;
  const double g = 0.2;
  const Complex steady = std::sqrt(1.0 + g * g) / Complex(1.0, -g);
  const auto found = structures(g, 0.57);
  Complex start = 0.0;
  double least = 1.0;
  for (std::size_t leg = 0; leg < 2; ++leg) {
    Complex z;
    for (std::size_t i = 0; i < 50; ++i) {
      const double strain = 0.02 * (static_cast<double>(i) + 1.0);
      z = steady + (start - steady) * std::exp(Complex(-1.0 / g, 1.0) * strain);
      // backward Euler in steps of 1e-4 strain is off by half of one over g, times the change left
      EXPECT_NEAR(found[50 * leg + i], std::min(1.0, std::abs(z)), 1e-3) << leg << ' ' << i;
      if (leg == 1) least = std::min(least, found[50 + i]);
    }
    start = -std::conj(z);
  }
  EXPECT_LT(found[0], 0.2);
  EXPECT_GT(found[49], 0.98);
  EXPECT_LT(least, 0.3);
  for (const double x : structures(0.0, 0.57)) EXPECT_NEAR(x, 1.0, 1e-9);  // the control
}

TEST(ContactShareLoose, LooserThanTheOnsetThereIsNone) {
  EXPECT_EQ(sheared("contact_share", material(chi), 0.45, 100.0).contact, 0.0);
  EXPECT_GT(sheared("contact_share", material(chi), 0.55, 100.0).contact, 0.0);
}

// In the solver: what the account takes in a step is the share's work, from each point's own strain
// rate, and the sum of all accounts stays.
TEST(ContactShareLedger, TakesTheWorkOfTheShare) {
  const double T = 1e-3, dt = 1e-6;
  const auto step = [&](double share) {
    Cuboid<PlaneStrain> block{.box = {6, 6}, .low = {0, 0}, .high = {6, 6}};
    std::vector<std::string> keys{"material.law=contact_share", "mpm.viscous_stiffness=0",
                                  "material.correlation_length=softened",
                                  "material.correlation_onset=0.5",
                                  fmt::format("material.contact_share={}", share)};
    block.body = material_registry().at("contact_share")(any_case(keys));
    block.granular_temperature = [T](const auto&) { return T; };
    block.velocity = [](const auto& x) { return Eigen::Vector2d(0.0, std::sin(8.0 * x[0])); };
    auto solver = block.build<BSpline<2>>();
    const double total = solver->ledger().total();
    solver->step(dt);
    EXPECT_NEAR(solver->ledger().total(), total, 1e-12 * total);
    const KineticTheory gas(any_case(keys));
    double work = 0.0, of_points = 0.0;
    const auto& points = solver->points();
    for (const std::size_t p : points.occupied()) {
      const double gdot = std::sqrt(3.0) * points.deviatoric_strain[p] / dt;
      const auto c = gas.coefficients(points.void_ratio[p], gdot, std::sqrt(T));
      const double eta = c.H * gas.softened(c, std::sqrt(points.granular_temperature[p])) *
                         std::sqrt(points.granular_temperature[p]);
      work += points.mass[p] * share * (c.length - 1.0) * eta * gdot * gdot * dt;
      of_points += points.mass[p] * points.contact[p];
    }
    EXPECT_NEAR(solver->ledger().contact, work, 1e-9 * work);
    EXPECT_NEAR(of_points, work, 1e-9 * work);
    return solver->ledger();
  };
  const EnergyLedger none = step(0.0), some = step(0.2);
  EXPECT_EQ(none.contact, 0.0);
  EXPECT_GT(some.contact, 0.01 * some.regime_4);  // there was something to take
  EXPECT_EQ(some.regime_4, none.regime_4);
}

}  // namespace
}  // namespace grainpair
