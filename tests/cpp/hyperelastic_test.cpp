#include "mpm/materials/hyperelastic.hpp"

#include <gtest/gtest.h>

#include <random>

namespace grainpair {
namespace {

class HyperelasticOf : public testing::TestWithParam<double> {
 protected:
  Hyperelastic law{380.0, 48.0, GetParam(), 1e5};
  std::mt19937_64 random{7};

  SymTensor tensor() {
    std::normal_distribution<double> normal;
    SymTensor a;
    for (double& x : a) x = normal(random);
    return a;
  }
  SymTensor loaded_stress() {  // p = 0.1 to 100 kPa, q/p up to about 0.9
    std::uniform_real_distribution<double> decades(-1.0, 2.0), ratio(0.0, 0.75);
    const double p = 1e3 * std::pow(10.0, decades(random));
    return p * (identity() + ratio(random) * deviator(tensor()).normalized());
  }
};

TEST_P(HyperelasticOf, StressIsDerivativeOfEnergy) {
  for (int i = 0; i < 100; ++i) {
    const SymTensor strain = law.strain(loaded_stress()), direction = tensor().normalized();
    const double h =
        1e-5 * trace(strain);  // central difference: h^2 ~ 1e-10 relative, rounding 1e-16/1e-5
    const double slope =
        (law.energy(strain + h * direction) - law.energy(strain - h * direction)) / (2.0 * h);
    EXPECT_NEAR(slope, law.stress(strain).dot(direction), 1e-9 * law.stress(strain).norm());
  }
}

TEST_P(HyperelasticOf, TangentIsDerivativeOfStress) {
  for (int i = 0; i < 100; ++i) {
    const SymTensor sigma = loaded_stress(), strain = law.strain(sigma),
                    direction = tensor().normalized();
    const double h = 1e-5 * trace(strain);
    const SymTensor slope =
        (law.stress(strain + h * direction) - law.stress(strain - h * direction)) / (2.0 * h);
    EXPECT_LT((slope - law.rate(sigma, direction)).norm(), 1e-8 * slope.norm());
  }
}

TEST_P(HyperelasticOf, StrainInvertsStress) {
  for (int i = 0; i < 100; ++i) {
    const SymTensor sigma = loaded_stress();
    EXPECT_LT((law.stress(law.strain(sigma)) - sigma).norm(), 1e-13 * sigma.norm());
  }
}

TEST_P(HyperelasticOf, EnergyIsTheClosedFormAndComplementsGibbs) {
  for (int i = 0; i < 100; ++i) {
    const SymTensor sigma = loaded_stress(), strain = law.strain(sigma);
    const double n = GetParam(), p = trace(sigma) / 3.0;
    const double p0 = std::sqrt(p * p + law.kn / (2.0 * law.g) * deviator(sigma).squaredNorm());
    const double psi = std::pow(p0, 2.0 - n) / (std::pow(1e5, 1.0 - n) * 380.0 * (2.0 - n));
    EXPECT_NEAR(law.energy(strain), psi, 1e-13 * psi);
    // Psi + E = sigma : eps in the paper's strain, which is zero at pa
    SymTensor from_pa = strain - identity() / (3.0 * law.kn);
    EXPECT_NEAR(psi + law.gibbs_energy(sigma), sigma.dot(from_pa), 1e-12 * p / law.kn);
  }
}

TEST_P(HyperelasticOf, PWaveModulusBoundsEveryDirection) {
  double tightest = 0.0;
  for (int i = 0; i < 300; ++i) {
    const SymTensor sigma = loaded_stress();
    const double bound = law.p_wave_modulus(law.strain(sigma));
    for (int j = 0; j < 20; ++j) {
      const Vec3 m = Vec3::Random().normalized();
      const SymTensor mm = from_matrix(m * m.transpose());
      const double modulus = law.rate(sigma, mm).dot(mm);
      EXPECT_LE(modulus, bound * (1.0 + 1e-12));
      tightest = std::max(tightest, modulus / bound);
    }
  }
  EXPECT_GT(tightest, 0.98);
}

TEST_P(HyperelasticOf, TangentHasTheDeterminantOfNoLimitingStressRatio) {
  // In (tr eps, |e|): det = 3 k g pa^2 (P0/pa)^(2n) with q = sqrt(3/2)|s|, eps_q = sqrt(2/3)|e|.
  for (int i = 0; i < 50; ++i) {
    const SymTensor sigma = loaded_stress(), s = deviator(sigma);
    const SymTensor volumetric = identity() / 3.0, shear = std::sqrt(1.5) * s.normalized();
    const SymTensor by_volume = law.rate(sigma, volumetric), by_shear = law.rate(sigma, shear);
    const double determinant =
        trace(by_volume) / 3.0 * by_shear.dot(shear) - by_volume.dot(shear) * trace(by_shear) / 3.0;
    const double p = trace(sigma) / 3.0, p0 = std::sqrt(p * p + s.squaredNorm() / law.coupling);
    EXPECT_NEAR(determinant, 3.0 * 380.0 * 48.0 * 1e10 * std::pow(p0 / 1e5, 2.0 * GetParam()),
                1e-10 * determinant);
  }
}

INSTANTIATE_TEST_SUITE_P(Exponents, HyperelasticOf, testing::Values(0.0, 1.0 / 3.0, 0.5, 0.7));

TEST(Hyperelastic, NumbersOfTheSeedsStiffness) {
  // p = 1 kPa: K = 38, 8.2, 3.8 MPa for n = 0, 1/3, 1/2; stored +0.29 J/m3 and Gibbs -4.9 J/m3 at n
  // = 1/2.
  const double expected[] = {38e6, 8.19e6, 3.8e6}, exponent[] = {0.0, 1.0 / 3.0, 0.5};
  for (int i = 0; i < 3; ++i) {
    const Hyperelastic law(380.0, 48.0, exponent[i], 1e5);
    EXPECT_NEAR(trace(law.rate(1e3 * identity(), identity() / 3.0)) / 3.0, expected[i],
                2e-3 * expected[i]);
  }
  const Hyperelastic law(380.0, 48.0, 0.5, 1e5);
  const SymTensor sigma = (1e3 * identity());
  // For K0 = 1 (isotropic): P0 = p, Psi = p^1.5/(sqrt(pa) k 1.5) = 0.175 J/m3.
  EXPECT_NEAR(law.energy(law.strain(sigma)), std::pow(1e3, 1.5) / (std::sqrt(1e5) * 380.0 * 1.5),
              1e-12);
  EXPECT_NEAR(law.gibbs_energy(sigma), 0.3509 * 0.5 / 0.5 - 1e3 / 190.0, 5e-2);
}

TEST(Hyperelastic, OpenStrainCarriesNothing) {
  const Hyperelastic law(380.0, 48.0, 0.5, 1e5);
  EXPECT_EQ(law.stress(-1e-3 * identity()), SymTensor::Zero());
  EXPECT_EQ(law.energy(-1e-3 * identity()), 0.0);
}

}  // namespace
}  // namespace grainpair
