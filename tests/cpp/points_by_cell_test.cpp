// Points sorted by the cells that they lie in.
#include "mpm/step/points_by_cell.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <utility>

namespace grainpair {
namespace {

using Found = std::map<std::size_t, std::vector<std::uint32_t>>;

Found cells_of(const PointsByCell& sorted) {
  Found found;
  sorted.for_each([&](std::size_t cell, std::span<const std::uint32_t> points) {
    found[cell].assign(points.begin(), points.end());
  });
  return found;
}

/// Against a map, of points some of which are left out; in the order of cells, and within each in
/// their own.
TEST(PointsByCell, AreThoseOfAMap) {
  std::mt19937 random(1);
  for (const unsigned cells : {1u, 7u, 1000u}) {
    std::vector<std::int32_t> cell(500);
    for (auto& c : cell) c = 40 + static_cast<std::int32_t>(random() % cells);
    std::vector<std::size_t> points;
    Found expected;
    for (std::uint32_t p = 0; p < cell.size(); ++p) {
      if (p % 5 == 0) continue;
      points.push_back(p);
      expected[static_cast<std::size_t>(cell[p])].push_back(p);
    }
    const PointsByCell sorted(points, cell);
    EXPECT_EQ(sorted.size(), points.size());
    EXPECT_EQ(cells_of(sorted), expected) << cells;
    std::size_t last = 0;
    sorted.for_each([&](std::size_t c, const auto&) { EXPECT_LE(std::exchange(last, c), c); });
  }
}

TEST(PointsByCell, MayBeNone) {
  const PointsByCell sorted(std::vector<std::size_t>{}, std::vector<std::int32_t>{});
  EXPECT_EQ(sorted.size(), 0u);
  EXPECT_TRUE(cells_of(sorted).empty());
}

}  // namespace
}  // namespace grainpair
