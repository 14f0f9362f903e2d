// Averages over frames, grids in parts, and grains of different sizes.
#include <gtest/gtest.h>

#include "compare/mapping/frame_sums.hpp"
#include "compare/mapping/layout.hpp"
#include "compare/mapping/parts.hpp"
#include "tests/cpp/coarse_grain_scene.hpp"

namespace grainpair {
namespace {

const Vec3 upper(0.04, 0.04, 0.02);

template <int D>
Fields average(const std::vector<Cloud>& frames, const SampleGrid<D>& grid) {
  const auto kernel = make_kernel<D>("gauss", w);
  FrameSums<D> sums(grid);
  for (const Cloud& c : frames) average_frame(sums, c, kernel, fluctuations(c, grid, kernel));
  return average_fields(sums, grain);
}

/// Frames of a gas of temperature T about a flow (shear y, 0, 0) + a mean that is `swing` in even
/// frames and -swing in odd ones.
std::vector<Cloud> swinging(double T, double shear, double swing) {
  std::vector<Cloud> frames;
  for (unsigned f = 0; f < 20; ++f) {
    frames.push_back(gas(4000, Vec3::Zero(), upper, T, Vec3::Zero(), 100 + f));
    Cloud& c = frames.back();
    for (std::size_t p = 0; p < c.size(); ++p)
      c.v[p] += Vec3(shear * c.x[p].y(), 0.0, f % 2 ? -swing : swing);
  }
  return frames;
}

TEST(Average, OfOneFrameIsThatFrame) {
  const Cloud c = gas(4000, Vec3::Zero(), upper, 0.02, {0.5, 0.1, 0.0}, 1);
  const auto grid = box<2>(Vec3::Zero(), upper, d, Edge::mirror, upper.z());
  const Fields one = map<2>(c, grid), mean = average<2>({c}, grid);
  for (const auto& field : one.list) {
    const auto& values = mean[field.name].values;
    double largest = 0.0;
    for (const double x : field.values) largest = std::max(largest, std::abs(x));
    for (std::size_t i = 0; i < values.size(); ++i)  // moments lose a few digits to (v/sqrt(T))^2
      ASSERT_NEAR(values[i], field.values[i], 1e-9 * largest) << field.name;
  }
  EXPECT_EQ(mean["mean_fluctuation_stress"].values[0], 0.0);
}

TEST(Average, ASwingingMeanIsNoHeat) {
  const double T = 0.02, shear = 10.0, swing = 0.5;
  const auto grid = box<2>(Vec3::Zero(), upper, d, Edge::periodic, upper.z());
  const Fields f = average<2>(swinging(T, shear, swing), grid);
  // 2 * 4000 * 20 squares per component over the box: a scatter of 0.2 %; margin for the y edges.
  EXPECT_NEAR(interior_mean(grid, f["granular_temperature"], 4 * d) / T, 1.0, 0.02);
  // The swing is in the stress of the mean's fluctuation, with what thermal motion leaves in the
  // mean of one frame, and in nothing else.
  const std::size_t k = 10 * 20 + 10;
  const double rho = f["density"].values[k], n = f["effective_number"].values[k] / 20.0;
  EXPECT_NEAR(f["mean_fluctuation_stress"].values[9 * k + 8] / (rho * swing * swing), 1.0,
              3.0 * T / n / (swing * swing) + 0.05);
  EXPECT_LT(f["kinetic_stress"].values[9 * k + 8], 1.5 * rho * T);
  // dvx/dy of a cell scatters by sqrt(T/800)/w = 3 1/s over 800 grains, its mean over 144 by a
  // twelfth at most; dvz/dy by nothing more, though the swing is 50 times as large.
  const auto component = [&](std::size_t i) {
    Field one{"", "", "", 1, {}};
    for (std::size_t c = 0; c < grid.size(); ++c)
      one.values.push_back(f["velocity_gradient"].values[9 * c + i]);
    return interior_mean(grid, one, 4 * d);
  };
  EXPECT_NEAR(component(1), shear, 1.0);
  EXPECT_NEAR(component(7), 0.0, 1.0);
  // Control: about the mean of all frames the swing would be heat.
  EXPECT_GT(swing * swing / 3.0, 2.0 * T);
}

TEST(Average, KeepsMassAndMomentumOfTheFrames) {
  const auto frames = swinging(0.02, 10.0, 0.5);
  const auto grid = box<3>(Vec3::Zero(), upper, d, Edge::periodic);
  const Fields f = average<3>(frames, grid);
  double mass = 0.0, momentum = 0.0;
  for (const Cloud& c : frames)
    for (std::size_t p = 0; p < c.size(); ++p)
      mass += c.mass[p] / 20.0, momentum += c.mass[p] * c.v[p].x() / 20.0;
  EXPECT_NEAR(integral(grid, f["density"]) / mass, 1.0, round_off);
  EXPECT_NEAR(integral(grid, f["momentum"], 0) / momentum, 1.0, round_off);
}

TEST(Sizes, TemperatureByMassAndPerGrain) {
  // Two sorts, 8 times heavier one than the other, of equal energy: T by mass is sum m v^2 / 3 sum
  // m, per grain their mean square.
  const double T = 0.08;
  std::vector<double> by_mass, per_grain;
  const auto grid = box<2>(Vec3::Zero(), upper, d, Edge::periodic, upper.z());
  for (unsigned seed = 0; seed < 20; ++seed) {
    Cloud c = gas(4000, Vec3::Zero(), upper, T, {0.3, 0.0, 0.0}, seed);
    for (std::size_t p = 0; p < c.size(); p += 2)
      c.mass[p] *= 8.0, c.v[p] = Vec3(0.3, 0.0, 0.0) + (c.v[p] - Vec3(0.3, 0, 0)) / std::sqrt(8.0);
    const Fields f = map<2>(c, grid);
    by_mass.push_back(interior_mean(grid, f["granular_temperature"], 0.0));
    per_grain.push_back(interior_mean(grid, f["granular_temperature_per_grain"], 0.0));
  }
  const auto mean = [](const std::vector<double>& x) {
    double sum = 0.0;
    for (const double one : x) sum += one;
    return sum / static_cast<double>(x.size());
  };
  // Exact: (m T + 8 m T/8)/(9 m) and (T + T/8)/2. What is left is that the correction takes all
  // grains to fluctuate alike: 1/N of the difference, at 40 grains 3 %.
  EXPECT_NEAR(mean(by_mass) / (2.0 * T / 9.0), 1.0, 0.03);
  EXPECT_NEAR(mean(per_grain) / (9.0 * T / 16.0), 1.0, 0.03);
}

TEST(Sizes, OfOneMassThereIsOneTemperature) {
  const Cloud c = gas(500, Vec3::Zero(), upper, 0.02, Vec3::Zero(), 3);
  const auto grid = box<2>(Vec3::Zero(), upper, d, Edge::mirror, upper.z());
  EXPECT_THROW(map<2>(c, grid)["granular_temperature_per_grain"], std::out_of_range);
}

template <int D>
void expect_parts_make_the_whole(Edge edge) {
  Cloud c = gas(2000, Vec3::Zero(), upper, 0.02, {0.5, 0.0, 0.0}, 10);
  c.has_contacts = true, c.contact_number.assign(c.size(), 1.0);
  for (std::size_t p = 0; p + 1 < 200; ++p)
    c.contacts.push_back({c.x[p], Vec3(1.1 * d, 0.7 * d, -0.3 * d), c.x[p], Vec3(1.0, 2.0, 3.0)});
  const auto grid = box<D>(Vec3::Zero(), upper, 0.8 * d, edge, D == 3 ? 1.0 : 0.01);
  const Fields whole = map<D>(c, grid);
  for (int axis = 0; axis < D; ++axis)
    for (int first = 0; first < grid.cells[static_cast<std::size_t>(axis)]; first += 7) {
      auto part = grid;
      const int cells = grid.cells[static_cast<std::size_t>(axis)];
      part.part = {axis, first, std::min(7, cells - first)};
      const Fields some = map<D>(c, part);
      for (const auto& field : some.list) {
        const auto& all = whole[field.name].values;
        const auto n = static_cast<std::size_t>(field.components);
        double largest = 0.0;
        for (const double x : all)
          if (std::isfinite(x)) largest = std::max(largest, std::abs(x));
        for (std::size_t k = 0; k < part.size(); ++k) {
          std::size_t rest = k, at = 0, stride = 1;
          for (int a = 0; a < D; ++a) {
            const auto m = static_cast<std::size_t>(part.count(a));
            at += (rest % m + static_cast<std::size_t>(part.first(a))) * stride;
            rest /= m, stride *= static_cast<std::size_t>(grid.cells[static_cast<std::size_t>(a)]);
          }
          for (std::size_t i = 0; i < n; ++i) {
            const double one = field.values[n * k + i], other = all[n * at + i];
            // Sums over contacts are shared out anew: round-off.
            ASSERT_TRUE((std::isnan(one) && std::isnan(other)) ||
                        std::abs(one - other) <= 1e-13 * largest)
                << field.name << " axis " << axis << " from " << first;
          }
        }
      }
    }
}
TEST(Parts, MakeTheWhole) {
  expect_parts_make_the_whole<1>(Edge::mirror);
  expect_parts_make_the_whole<2>(Edge::mirror), expect_parts_make_the_whole<2>(Edge::periodic);
  expect_parts_make_the_whole<3>(Edge::periodic);
}

TEST(Parts, FitIntoTheRoomAndCoverTheGrid) {
  const Cloud c = gas(400000, Vec3::Zero(), upper, 0.0, Vec3::Zero(), 5);
  const auto grid = box<3>(Vec3::Zero(), upper, 0.4 * d, Edge::mirror);
  const auto pieces = parts(grid, c, 3.0 * w);
  ASSERT_GT(pieces.size(), 1u);
  int next = 0;
  for (const auto& one : pieces) {
    EXPECT_EQ(one.part.first, next);
    next += one.part.count;
  }
  EXPECT_EQ(next, grid.cells[static_cast<std::size_t>(pieces.front().part.axis)]);
  EXPECT_EQ(parts(box<3>(Vec3::Zero(), upper, d, Edge::mirror), gas(100, {}, upper, 0.0, {}, 5), w)
                .size(),
            1u);
}

TEST(Cutting, ABranchAcrossAPeriodCountsOnBothSides) {
  // From x = 0.0005 back over the face at 0, of a period of 0.04: one half lies below 0.02, one
  // above.
  Cloud c = gas(500, Vec3::Zero(), upper, 0.0, Vec3::Zero(), 7);
  c.has_contacts = true, c.contact_number.assign(c.size(), 0.0);
  const Vec3 branch(0.002, 0.0005, 0.0), force(-1.0, 0.4, 0.1), start(0.0005, 0.02, 0.01);
  c.contacts.push_back({start, branch, start - 0.5 * branch, force});
  const Cloud left = cut(c, {0, 0.0, 0.02, 0.04}), right = cut(c, {0, 0.02, 0.04, 0.04});
  EXPECT_EQ(left.size() + right.size(), c.size());
  ASSERT_EQ(left.contacts.size(), 1u);
  ASSERT_EQ(right.contacts.size(), 1u);
  EXPECT_NEAR(left.contacts[0].branch.x(), 0.0005, 1e-17);
  EXPECT_NEAR(right.contacts[0].branch.x(), 0.0015, 1e-17);
}

TEST(Layout, CellsMeetWallsAndFillTheSpaceBetween) {
  const double none = std::numeric_limits<double>::quiet_NaN(), h = 0.3;
  const auto far = [](const Cells& c) { return c.lower + c.count * c.spacing; };
  const Cells between = cells_between(1.0, 2.0, true, 1.2, 1.9, h, 0.5);
  EXPECT_DOUBLE_EQ(between.lower, 1.0);
  EXPECT_DOUBLE_EQ(far(between), 2.0);
  EXPECT_EQ(between.count, 3.0);
  EXPECT_EQ(between.high_edge, Edge::mirror);
  const Cells floor = cells_between(-1.0, none, true, -0.9, 2.0, h, 0.5);
  EXPECT_DOUBLE_EQ(floor.lower, -1.0);
  EXPECT_GE(far(floor), 2.5);
  EXPECT_EQ(floor.high_edge, Edge::open);
  const Cells roof = cells_between(none, 2.0, true, -0.9, 1.8, h, 0.5);
  EXPECT_DOUBLE_EQ(far(roof), 2.0);
  EXPECT_LE(roof.lower, -1.4);
  const Cells nothing = cells_between(none, none, true, -0.9, 1.8, h, 0.5);
  EXPECT_LE(nothing.lower, -1.4);
  EXPECT_GE(far(nothing), 2.3);
  const Cells open = cells_between(-1.0, none, false, -0.9, 2.0, h, 0.5);
  EXPECT_LE(open.lower, -1.5);
  EXPECT_NEAR(std::remainder(open.lower + 1.0, h), 0.0, 1e-12);  // the wall is a face of cells
}

TEST(Profiles, ALargeCloudIsLumpedForTheTwoStepTemperature) {
  // 60 000 points in one dimension, each with 13 500 neighbours, are lumped.
  const double T = 0.02, shear = 20.0;
  Cloud c = gas(60000, Vec3::Zero(), upper, T, Vec3::Zero(), 4);
  for (std::size_t p = 0; p < c.size(); ++p) c.v[p].x() += shear * c.x[p].y();
  const auto grid = box<1>(Vec3::Zero(), upper, d, Edge::mirror, upper.x() * upper.z());
  const Fields f = map<1>(c, grid);
  // Scatter: sqrt(2/3/13500) = 0.7 %, over 12 cells less; the lumps' (1/16)^2/24 is nothing.
  EXPECT_NEAR(interior_mean(grid, f["granular_temperature_two_step"], 4 * d) / T, 1.0, 0.02);
  EXPECT_NEAR(interior_mean(grid, f["granular_temperature"], 4 * d) / T, 1.0, 0.02);
}

TEST(Profiles, AlongAnyAxis) {
  const Cloud c = gas(3000, Vec3::Zero(), upper, 0.0, Vec3::Zero(), 2);
  for (int along = 0; along < 3; ++along) {
    SampleGrid<1> grid;
    grid.along = along;
    grid.cells = {20}, grid.lower[0] = 0.0, grid.spacing[0] = upper[along] / 20;
    grid.low_edge = grid.high_edge = {Edge::periodic};
    grid.depth = upper.prod() / upper[along];
    const Fields f = map<1>(c, grid);
    double mass = 0.0;
    for (const double m : c.mass) mass += m;
    EXPECT_NEAR(integral(grid, f["density"]) / mass, 1.0, round_off);
  }
}

}  // namespace
}  // namespace grainpair
