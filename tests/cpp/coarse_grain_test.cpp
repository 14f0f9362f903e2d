#include "compare/mapping/coarse_grain.hpp"

#include <gtest/gtest.h>
#include <omp.h>

#include <cstring>

#include "compare/mapping/stencil.hpp"
#include "tests/cpp/coarse_grain_scene.hpp"

namespace grainpair {
namespace {

template <int D>
void expect_conserved(Edge edge) {
  const Vec3 upper(0.05, 0.03, 0.01);
  const Cloud c = gas(3000, Vec3::Zero(), upper, 0.1, {0.3, -0.2, 0.1}, 1);
  double mass = 0.0;
  Vec3 momentum = Vec3::Zero();
  for (std::size_t p = 0; p < c.size(); ++p) mass += c.mass[p], momentum += c.mass[p] * c.v[p];
  const double depth = D == 1 ? upper.x() * upper.z() : D == 2 ? upper.z() : 1.0;
  for (const char* kernel : kernels)
    for (const double h : {0.37 * d, d, 3.0 * d}) {
      const auto grid = box<D>(Vec3::Zero(), upper, h, edge, depth);
      const Fields f = map<D>(c, grid, kernel);
      EXPECT_NEAR(integral(grid, f["density"]) / mass, 1.0, round_off) << kernel << " h " << h;
      for (int i = 0; i < 3; ++i)
        EXPECT_NEAR(integral(grid, f["momentum"], i), momentum[i], round_off * mass)
            << kernel << " h " << h;
    }
}
TEST(CoarseGrain, MassAndMomentumInEqualOutAtWalls) {
  expect_conserved<1>(Edge::mirror), expect_conserved<2>(Edge::mirror),
      expect_conserved<3>(Edge::mirror);
}
TEST(CoarseGrain, MassAndMomentumInEqualOutAcrossPeriodicFaces) {
  expect_conserved<1>(Edge::periodic), expect_conserved<2>(Edge::periodic),
      expect_conserved<3>(Edge::periodic);
}

TEST(CoarseGrain, OpenEdgeLosesWhatPassesIt) {
  // One point on the edge: half of the kernel lies outside. A control: the conservation above is
  // not vacuous.
  Cloud c = gas(1, Vec3::Zero(), Vec3::Zero(), 0.0, Vec3::Zero(), 1);
  c.x[0] = {0.0, 0.02, 0.0};
  const auto grid = box<2>(Vec3::Zero(), {0.05, 0.04, 0.01}, 0.1 * d, Edge::open);
  EXPECT_NEAR(integral(grid, map<2>(c, grid)["density"]) / c.mass[0], 0.5, 1e-12);
}

TEST(CoarseGrain, UniformPackingStaysUniformUpToAWall) {
  // A lattice with spacing d/4, much finer than w: what is left is the lattice sum of the truncated
  // kernel.
  Cloud c;
  for (double x = d / 8; x < 0.04; x += d / 4)
    for (double y = d / 8; y < 0.04; y += d / 4) {
      c.x.push_back({x, y, 0.0}), c.v.push_back(Vec3::Zero()), c.mass.push_back(1e-6),
          c.solid_volume.push_back(1e-9);
    }
  const auto grid = box<2>(Vec3::Zero(), {0.04, 0.04, 0.0}, d, Edge::mirror, 1.0);
  const Fields f = map<2>(c, grid);
  const double uniform = 1e-6 / (d / 4) / (d / 4);
  for (const double rho : f["density"].values) EXPECT_NEAR(rho / uniform, 1.0, 0.01);
}

Cloud two_grains(const Vec3& first, const Vec3& second, const Vec3& force) {
  Cloud c;
  for (const Vec3& x : {first, second})
    c.x.push_back(x), c.v.push_back(Vec3::Zero()), c.mass.push_back(1e-5),
        c.solid_volume.push_back(4e-9);
  c.has_contacts = true;
  c.contact_number = {1.0, 1.0};
  c.contacts.push_back({first, first - second, 0.5 * (first + second), force, 0.25, false});
  return c;
}

template <int D>
void expect_one_contact(Edge edge) {
  const Vec3 a(0.021, 0.0187, 0.0052), b(0.0198, 0.0201, 0.0043), force(0.3, -0.7, 0.2);
  const Cloud c = two_grains(a, b, force);
  const Mat3 expected = force * (a - b).transpose();
  const auto grid = box<D>(Vec3::Zero(), {0.04, 0.04, 0.01}, 0.9 * d, edge, 0.01);
  for (const char* kernel : kernels) {
    const Fields f = map<D>(c, grid, kernel);
    for (int i = 0; i < 9; ++i)
      EXPECT_NEAR(integral(grid, f["contact_stress"], i), expected(i / 3, i % 3),
                  round_off * expected.norm())
          << kernel;
  }
}
TEST(CoarseGrain, OneContactGivesForceTimesBranchOverVolume) {
  expect_one_contact<1>(Edge::mirror), expect_one_contact<2>(Edge::mirror),
      expect_one_contact<3>(Edge::mirror);
  expect_one_contact<3>(Edge::periodic);
}

TEST(CoarseGrain, LineIntegralAgreesWithQuadratureAlongTheBranch) {
  // psi at a cell against Simpson's rule over s; on a fine grid the lattice normalisation is 1 to
  // 1e-3 (the Gaussian's cut at 3 w is a jump of 1 % of its maximum).
  const Vec3 a(0.021, 0.0187, 0.0), b(0.0198, 0.0201, 0.0), force(1.0, 0.0, 0.0);
  const Cloud c = two_grains(a, b, force);
  const auto grid = box<2>({0.012, 0.012, 0.0}, {0.028, 0.028, 0.0}, 0.05 * d, Edge::mirror, 1.0);
  for (const char* kernel : kernels) {
    if (std::string(kernel) == "heaviside")
      continue;  // a jump at the rim: pointwise comparison means nothing there
    const auto phi = make_kernel<2>(kernel, w);
    const double cutoff = std::visit([](const auto& k) { return k.cutoff(); }, phi);
    const auto at = [&](double r2) {
      return r2 < cutoff * cutoff ? std::visit([&](const auto& k) { return k.at(r2); }, phi) : 0.0;
    };
    const Field sigma = map<2>(c, grid, kernel)["contact_stress"];
    for (std::size_t k = 0; k < grid.size(); k += 97) {
      const Eigen::Vector2d r(
          grid.centre(0, static_cast<int>(k % static_cast<std::size_t>(grid.cells[0]))),
          grid.centre(1, static_cast<int>(k / static_cast<std::size_t>(grid.cells[0]))));
      constexpr int n = 2000;
      double psi = 0.0;
      for (int i = 0; i <= n; ++i) {
        const Eigen::Vector2d on = a.head<2>() - static_cast<double>(i) / n * (a - b).head<2>();
        psi += (i == 0 || i == n ? 1.0
                : i % 2          ? 4.0
                                 : 2.0) /
               (3.0 * n) * at((r - on).squaredNorm());
      }
      EXPECT_NEAR(sigma.values[9 * k], psi * (a - b).x(), 2e-3 * at(0.0) * std::abs((a - b).x()))
          << kernel;
    }
  }
}

TEST(CoarseGrain, DissipationIntegratesToThePower) {
  Cloud c = two_grains({0.02, 0.02, 0.0}, {0.022, 0.02, 0.0}, {-1.0, 0.0, 0.0});
  c.has_dissipation = true;
  const auto grid = box<2>(Vec3::Zero(), {0.04, 0.04, 0.01}, d, Edge::mirror, 0.01);
  EXPECT_NEAR(integral(grid, map<2>(c, grid)["dissipation_density"]), 0.25, 1e-13);
}

TEST(CoarseGrain, FabricOfOneContactIsItsDirection) {
  const Cloud c = two_grains({0.02, 0.02, 0.0}, {0.022, 0.02, 0.0}, {-1.0, 0.0, 0.0});
  const auto grid = box<2>(Vec3::Zero(), {0.04, 0.04, 0.01}, d, Edge::mirror, 0.01);
  const Fields f = map<2>(c, grid);
  const std::size_t k = 10 * 20 + 10;
  EXPECT_NEAR(f["fabric"].values[9 * k], 1.0, 1e-14);
  EXPECT_NEAR(f["fabric"].values[9 * k + 4], 0.0, 1e-14);
  EXPECT_NEAR(f["coordination"].values[k], 1.0, 1e-14);
}

/// A column of grains stacked on a floor at y = 0, each carrying the weight of those above; every
/// contact is known.
Cloud stack(int n, double g) {
  Cloud c;
  const double m = 1e-5;
  for (int i = 0; i < n; ++i)
    c.x.push_back({0.5 * d, (i + 0.5) * d, 0.5 * d}), c.v.push_back(Vec3::Zero()),
        c.mass.push_back(m), c.solid_volume.push_back(4e-9);
  c.has_contacts = true;
  c.contact_number.assign(static_cast<std::size_t>(n), 2.0);
  for (int i = 0; i < n; ++i) {
    const Vec3 r(0.5 * d, (i + 0.5) * d, 0.5 * d);
    const Vec3 up(0.0, m * g * (n - i), 0.0);  // from below, holding grains i .. n-1
    const bool floor = i == 0;
    const Vec3 branch(0.0, floor ? 0.5 * d : d, 0.0);
    c.contacts.push_back({r, branch, r - Vec3(0.0, 0.5 * d, 0.0), up, 0.0, floor});
  }
  return c;
}

TEST(CoarseGrain, HydrostaticStackCarriesItsWeight) {
  const double g = 9.81;
  const int n = 60;
  const Cloud c = stack(n, g);
  const double weight = 1e-5 * g * n, area = d * d;
  const auto grid = box<1>(Vec3::Zero(), {d, n * d + 10 * w, d}, 0.5 * d, Edge::mirror, area);
  const Fields f = map<1>(c, grid);
  // All of the weight enters through the floor.
  EXPECT_NEAR(integral(grid, f["interaction_force_density"], 1) / weight, 1.0, round_off);
  // The stress falls linearly with height; extrapolated from the bulk to y = 0 it is the weight per
  // area.
  double sy = 0, s1 = 0, syy = 0, ss = 0, sys = 0;
  for (int k = 0; k < grid.cells[0]; ++k) {
    const double y = grid.centre(0, k),
                 sigma = f["contact_stress"].values[9 * static_cast<std::size_t>(k) + 4];
    if (y < 5 * w || y > n * d - 5 * w) continue;
    s1 += 1, sy += y, syy += y * y, ss += sigma, sys += y * sigma;
  }
  const double slope = (s1 * sys - sy * ss) / (s1 * syy - sy * sy), base = (ss - slope * sy) / s1;
  EXPECT_NEAR(base / (weight / area), 1.0, 0.01);
  EXPECT_NEAR(slope / (-weight / area / (n * d)), 1.0, 0.01);
}

TEST(CoarseGrain, MomentumBalanceNeedsTheWallTerm) {
  // At rest: 0 = -d(sigma_yy)/dy + t_y - rho g at every height, the smeared floor included; fields
  // open below y = 0. A smooth kernel on a grid of d/64, so that the difference quotient's error,
  // (h/c)^2, is below the 0.5 %.
  const double g = 9.81;
  const int n = 20;
  const Cloud c = stack(n, g);
  const auto grid = box<1>({0.0, -6 * d, 0.0}, {d, (n + 6) * d, d}, d / 64, Edge::open, d * d);
  const Fields f = map<1>(c, grid, "lucy");
  const auto &rho = f["density"].values, &sigma = f["contact_stress"].values,
             &t = f["interaction_force_density"].values;
  double with = 0.0, without = 0.0, force = 0.0;
  for (std::size_t k = 1; k + 1 < grid.size(); ++k) {
    const double div = (sigma[9 * (k + 1) + 4] - sigma[9 * (k - 1) + 4]) / (2.0 * grid.spacing[0]);
    with = std::max(with, std::abs(-div + t[3 * k + 1] - rho[k] * g));
    without = std::max(without, std::abs(-div - rho[k] * g));
    force = std::max(force, rho[k] * g);
  }
  EXPECT_LT(with / force, 0.005);
  EXPECT_GT(without / force, 1.0);
}

TEST(CoarseGrain, KineticEnergySplitsExactly) {
  const Vec3 upper(0.03, 0.03, 0.02);
  const Cloud c = gas(4000, Vec3::Zero(), upper, 0.02, {0.5, 0.0, 0.0}, 8);
  const auto grid = box<2>(Vec3::Zero(), upper, d, Edge::mirror, upper.z());
  const Fields f = map<2>(c, grid);
  double mean = 0.0, energy = 0.0;
  for (std::size_t k = 0; k < grid.size(); ++k)
    for (std::size_t i = 0; i < 3; ++i) {
      const double v = f["velocity"].values[3 * k + i];
      mean += 0.5 * f["density"].values[k] * v * v * grid.cell_volume();
      mean += 0.5 * f["kinetic_stress"].values[9 * k + 4 * i] * grid.cell_volume();
    }
  for (std::size_t p = 0; p < c.size(); ++p) energy += 0.5 * c.mass[p] * c.v[p].squaredNorm();
  EXPECT_NEAR(mean / energy, 1.0, round_off);
}

TEST(CoarseGrain, MaterialPointsKeepTheirOwnState) {
  Cloud c = gas(4000, Vec3::Zero(), {0.04, 0.04, 0.01}, 0.0, Vec3::Zero(), 9);
  c.void_ratio.assign(c.size(), 0.7);
  c.granular_temperature.assign(c.size(), 0.003);
  Mat3 s;
  s << 5.0, 1.0, 0.0, 1.0, 9.0, 0.0, 0.0, 0.0, 5.0;
  c.stress.assign(c.size(), from_matrix(s));
  const auto grid = box<2>(Vec3::Zero(), {0.04, 0.04, 0.0}, d, Edge::mirror, 0.01);
  const Fields f = map<2>(c, grid);
  double volume = 0.0;
  for (const double vs : c.solid_volume) volume += 1.7 * vs;
  for (int i = 0; i < 9; ++i)
    EXPECT_NEAR(integral(grid, f["stress_state"], i), volume * s(i / 3, i % 3),
                1e-12 * volume * 9.0);
  EXPECT_NEAR(f["void_ratio_state"].values[205], 0.7, 1e-14);
  EXPECT_NEAR(f["granular_temperature_state"].values[205], 0.003, 1e-16);
  EXPECT_NEAR(f["stress_ratio"].values[205], von_mises(from_matrix(s)) / (19.0 / 3.0), 1e-12);
}

TEST(CoarseGrain, DerivedFieldsOfAKnownShearUnderAKnownStress) {
  // v = (rate y, -a y, 0): L = [[0, rate], [0, -a]], so D = -sym L, compression positive.
  const double rate = 30.0, a = 4.0;
  Cloud c = gas(6000, Vec3::Zero(), {0.04, 0.04, 0.01}, 0.0, Vec3::Zero(), 12);
  for (std::size_t p = 0; p < c.size(); ++p) c.v[p] = {rate * c.x[p].y(), -a * c.x[p].y(), 0.0};
  Mat3 s;
  s << 300.0, -80.0, 0.0, -80.0, 500.0, 0.0, 0.0, 0.0, 400.0;
  c.void_ratio.assign(c.size(), 0.7), c.granular_temperature.assign(c.size(), 0.0);
  c.stress.assign(c.size(), from_matrix(s));
  const auto grid = box<2>(Vec3::Zero(), {0.04, 0.04, 0.0}, d, Edge::mirror, 0.01);
  const Fields f = map<2>(c, grid);
  const std::size_t k = 10 * 20 + 10;
  // sum V sigma phi is the stress times the share of space that the points' volumes fill.
  const double fill = f["stress_state"].values[9 * k] / 300.0, p = 400.0 * fill;
  Mat3 D;
  D << 0.0, -0.5 * rate, 0.0, -0.5 * rate, a, 0.0, 0.0, 0.0, 0.0;
  const double tolerance = 1e-9 * rate;  // of the fit: round-off of |v|/w, a thousand times over
  for (int i = 0; i < 9; ++i)
    EXPECT_NEAR(f["strain_rate"].values[9 * k + static_cast<std::size_t>(i)], D(i / 3, i % 3),
                tolerance);
  const double dev2 = 0.5 * rate * rate + a * a - a * a / 3.0;  // dev D : dev D
  EXPECT_NEAR(f["shear_rate"].values[k], std::sqrt(2.0 * dev2), tolerance);
  EXPECT_NEAR(f["pressure"].values[k], p, 1e-9 * p);
  const double q = fill * std::sqrt(1.5 * (2.0 * 100.0 * 100.0 + 2.0 * 80.0 * 80.0));
  EXPECT_NEAR(f["deviatoric_stress"].values[k], q, 1e-9 * q);
  EXPECT_NEAR(f["stress_ratio"].values[k], q / p, 1e-9);
  EXPECT_NEAR(f["inertial_number"].values[k], std::sqrt(2.0 * dev2) * d / std::sqrt(p / 2500.0),
              1e-9);
  EXPECT_NEAR(f["stress_power"].values[k], fill * (2.0 * 80.0 * 0.5 * rate + 500.0 * a),
              1e-9 * fill * 5000.0);
}

TEST(CoarseGrain, ThreadsDoNotChangeABit) {
  const Vec3 upper(0.03, 0.03, 0.02);
  const Cloud c = gas(3000, Vec3::Zero(), upper, 0.02, {0.5, 0.0, 0.0}, 10);
  const auto grid = box<2>(Vec3::Zero(), upper, d, Edge::mirror, upper.z());
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const Fields one = map<2>(c, grid);
  // Several times each: what a thread allocates lies elsewhere every time.
  std::string differing;
  for (int i = 0; i < 12; ++i) {
    omp_set_num_threads(1 + i % 4);
    const Fields several = map<2>(c, grid);
    for (const auto& field : one.list)
      if (std::memcmp(field.values.data(), several[field.name].values.data(),
                      field.values.size() * sizeof(double)) != 0)
        differing += " " + field.name;
  }
  omp_set_num_threads(threads);
  EXPECT_EQ(differing, "");
}

TEST(CoarseGrain, CuttingAtAPlaneSplitsMassAndStressExactly) {
  Cloud c = gas(500, Vec3::Zero(), {0.04, 0.04, 0.01}, 0.01, Vec3::Zero(), 11);
  const Cloud pairs = two_grains({0.019, 0.02, 0.0}, {0.0205, 0.021, 0.0}, {-1.0, 0.4, 0.1});
  c.contacts = pairs.contacts, c.has_contacts = true, c.contact_number.assign(c.size(), 0.0);
  const Cloud left = cut(c, {0, 0.0, 0.02}), right = cut(c, {0, 0.02, 0.04});
  EXPECT_EQ(left.size() + right.size(), c.size());
  Mat3 sum = Mat3::Zero();
  for (const Cloud* part : {&left, &right})
    for (const auto& k : part->contacts) sum += k.force * k.branch.transpose();
  EXPECT_LT((sum - c.contacts[0].force * c.contacts[0].branch.transpose()).norm(), 1e-17);
}

}  // namespace
}  // namespace grainpair
