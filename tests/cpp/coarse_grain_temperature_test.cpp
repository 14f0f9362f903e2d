// Granular temperature: what is motion and what is fluctuation about it.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/cpp/coarse_grain_scene.hpp"

namespace grainpair {
namespace {

TEST(CoarseGrain, RigidRotationHasNoTemperature) {
  Cloud c = gas(20000, Vec3::Zero(), {0.05, 0.05, 0.02}, 0.0, Vec3::Zero(), 2);
  const Vec3 omega(0.0, 0.0, 40.0), centre(0.02, 0.01, 0.0);
  double v2 = 0.0;
  for (std::size_t p = 0; p < c.size(); ++p) {
    c.v[p] = omega.cross(c.x[p] - centre);
    v2 = std::max(v2, c.v[p].squaredNorm());
  }
  const auto grid = box<2>(Vec3::Zero(), {0.05, 0.05, 0.0}, d, Edge::mirror, 0.02);
  const Fields f = map<2>(c, grid);
  for (std::size_t k = 0; k < grid.size(); ++k) {
    EXPECT_LT(f["granular_temperature"].values[k],
              1e-28 * v2 / 1e-4);  // eps^2 of |v|^2, walls and corners included
    EXPECT_NEAR(f["velocity_gradient"].values[9 * k + 3], 40.0, 1e-9);
    EXPECT_NEAR(f["shear_rate"].values[k], 0.0, 1e-9);
  }
  // Control: without the fit the rotation reads as temperature.
  EXPECT_GT(f["granular_temperature_one_step"].values[12 * 25 + 12], 1e-5);
}

TEST(CoarseGrain, UniformMotionChangesNoTemperatureAndNoStress) {
  const Vec3 upper(0.03, 0.03, 0.02), boost(7.0, -11.0, 3.0);
  Cloud c = gas(4000, Vec3::Zero(), upper, 0.01, Vec3::Zero(), 3);
  const auto grid = box<2>(Vec3::Zero(), upper, d, Edge::mirror, upper.z());
  const Fields rest = map<2>(c, grid);
  for (auto& v : c.v) v += boost;
  const Fields moving = map<2>(c, grid);
  for (const char* name :
       {"granular_temperature", "granular_temperature_two_step", "granular_temperature_one_step",
        "kinetic_stress", "velocity_gradient"}) {
    const auto &a = rest[name].values, &b = moving[name].values;
    double scale = 0.0;
    for (const double x : a) scale = std::max(scale, std::abs(x));
    // Velocities are rounded to eps |boost|; against fluctuations of 0.1 m/s that is 1e-13 of each.
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-12 * scale) << name;
  }
}

/// Shear v_x = rate y on top of fluctuations of temperature T, in a layer of `depth` grains of n
/// = 1.05/d^3.
Cloud shear_flow(double T, double rate, double side, double depth, unsigned seed) {
  const double volume = side * side * depth;
  const auto n = static_cast<std::size_t>(1.05 * volume / (d * d * d));
  Cloud c = gas(n, Vec3::Zero(), {side, side, depth}, T, Vec3::Zero(), seed);
  for (std::size_t p = 0; p < c.size(); ++p) c.v[p].x() += rate * c.x[p].y();
  return c;
}

TEST(CoarseGrain, TemperatureOfShearFlowIsRecovered) {
  // The gradient's artefact w_eff^2 rate^2/3 is three times T here, so the uncorrected value is
  // four times too high.
  const double rate = 50.0, w_eff2 = 0.9494 * w * w, T = w_eff2 * rate * rate / 9.0;
  const double side = 60 * d, depth = 10 * d;
  const Cloud c = shear_flow(T, rate, side, depth, 4);
  double actual = 0.0;  // of this sample, so that its own scatter (0.4 %) does not matter
  for (std::size_t p = 0; p < c.size(); ++p)
    actual += (c.v[p] - Vec3(rate * c.x[p].y(), 0.0, 0.0)).squaredNorm() /
              (3.0 * static_cast<double>(c.size()));
  const auto grid = box<2>(Vec3::Zero(), {side, side, 0.0}, d, Edge::mirror, depth);
  const Fields f = map<2>(c, grid);
  const double margin = 4.5 * w;
  EXPECT_NEAR(interior_mean(grid, f["granular_temperature"], margin) / actual, 1.0, 0.01);
  // Two steps: among randomly placed points the centroid under the kernel scatters about r_i by w
  // sqrt(s2/2) per component, s2 = 1/(4 pi n w^2), which the gradient turns into rate^2 w^2 s2/6 =
  // 3/2 s2 T.
  const double s2 = 1.0 / (4.0 * std::numbers::pi * 10.5 * 0.75 * 0.75);
  EXPECT_NEAR(interior_mean(grid, f["granular_temperature_two_step"], margin) / actual,
              1.0 + 1.5 * s2, 0.01);
  // One step: T (1 - 1/N_eff) + w_eff^2 rate^2 / 3 = 4 T less a few per cent.
  const double one = interior_mean(grid, f["granular_temperature_one_step"], margin) / actual;
  EXPECT_GT(one, 2.0);
  EXPECT_LT(one, 6.0);
}

TEST(CoarseGrain, TemperatureOfSmallSamplesIsRecovered) {
  // 2-D smoothing of a layer five grains deep at w = 0.5 d and 0.75 d: the plain two-step value is
  // 18 % and 8 % low.
  const double T = 0.02, side = 80 * d, depth = 5 * d;
  for (const double width : {0.5 * d, 0.75 * d}) {
    const Cloud c = shear_flow(T, 0.0, side, depth, 5);
    double actual = 0.0;
    for (const auto& v : c.v) actual += v.squaredNorm() / (3.0 * static_cast<double>(c.size()));
    const auto grid = box<2>(Vec3::Zero(), {side, side, 0.0}, d, Edge::mirror, depth);
    const Fields f = map<2>(c, grid, "gauss", width);
    const double margin = 4.5 * width;
    EXPECT_NEAR(interior_mean(grid, f["granular_temperature"], margin) / actual, 1.0, 0.02)
        << width;
    EXPECT_NEAR(interior_mean(grid, f["granular_temperature_two_step"], margin) / actual, 1.0, 0.02)
        << width;

    // The uncorrected two-step value, by its definition.
    const auto phi = make_kernel<2>("gauss", width);
    const auto at = [&](double r2) {
      return std::visit([&](const auto& k) { return k.at(r2); }, phi);
    };
    double plain = 0.0, own = 0.0;
    for (std::size_t i = 0; i < c.size(); i += 7) {
      const auto xi = c.x[i].head<2>();
      if (xi.minCoeff() < margin || xi.maxCoeff() > side - margin) continue;
      double S = 0.0;
      Vec3 V = Vec3::Zero();
      for (std::size_t j = 0; j < c.size(); ++j) {
        const double r2 = (c.x[j].head<2>() - xi).squaredNorm();
        if (r2 < 9.0 * width * width) S += at(r2), V += at(r2) * c.v[j];
      }
      plain += (c.v[i] - V / S).squaredNorm(), own += c.v[i].squaredNorm();
    }
    const double low = 1.0 - plain / own;
    EXPECT_GT(low, width < 0.6 * d ? 0.12 : 0.06);
    EXPECT_LT(low, 0.20);
  }
}

TEST(CoarseGrain, RotationalTemperatureOfKnownSpins) {
  Cloud c = shear_flow(0.01, 0.0, 60 * d, 10 * d, 6);
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal(0.0, 30.0);
  const double I = 0.1 * c.mass[0] * d * d;
  double actual = 0.0;
  for (std::size_t p = 0; p < c.size(); ++p) {
    c.spin.push_back({normal(random), normal(random), 20.0 + normal(random)});
    c.inertia.push_back(I);
    actual += (c.spin[p] - Vec3(0, 0, 20.0)).squaredNorm() * I /
              (3.0 * c.mass[0] * static_cast<double>(c.size()));
  }
  const auto grid = box<2>(Vec3::Zero(), {60 * d, 60 * d, 0.0}, d, Edge::mirror, 10 * d);
  EXPECT_NEAR(interior_mean(grid, map<2>(c, grid)["rotational_temperature"], 4.5 * w) / actual, 1.0,
              0.01);
}

}  // namespace
}  // namespace grainpair
