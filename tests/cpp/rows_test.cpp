// Numbers of several points, in registers and in rows: from one to the other, and sums.
#include "mpm/numbers/rows.hpp"

#include <gtest/gtest.h>

namespace grainpair {
namespace {

/// 10 lane + number.
template <class Real>
Real numbered(int number) {
  using Value = typename Real::value_type;
  return Real([&](auto lane) { return static_cast<Value>(10 * static_cast<int>(lane) + number); });
}

template <class Real>
class Rows : public testing::Test {};
using Reals = testing::Types<Wide, WideFloat>;
TYPED_TEST_SUITE(Rows, Reals);

// Within every four lanes, lane and number change places.
TYPED_TEST(Rows, TransposeExchangesLanesAndNumbers) {
  using Real = TypeParam;
  Real w[4] = {numbered<Real>(0), numbered<Real>(1), numbered<Real>(2), numbered<Real>(3)};
  transpose(w[0], w[1], w[2], w[3]);
  for (int number = 0; number < 4; ++number)
    for (std::size_t lane = 0; lane < Real::size(); ++lane) {
      const auto in_four = static_cast<int>(lane % 4), four = static_cast<int>(lane) - in_four;
      EXPECT_EQ(w[number][lane], 10 * (four + number) + in_four);
    }
}

TYPED_TEST(Rows, SumsAreOfTheLanesOfEachFour) {
  using Real = TypeParam;
  const Real all = sums(numbered<Real>(0), numbered<Real>(1), numbered<Real>(2), numbered<Real>(3));
  for (std::size_t lane = 0; lane < Real::size(); ++lane) {
    const auto number = static_cast<int>(lane % 4), four = static_cast<int>(lane) - number;
    EXPECT_EQ(all[lane], 10 * (4 * four + 0 + 1 + 2 + 3) + 4 * number);
  }
}

TYPED_TEST(Rows, SplitAndMergeAreConverses) {
  using Real = TypeParam;
  const Real before = numbered<Real>(7);
  const Real after = merge(split(before));
  for (std::size_t lane = 0; lane < Real::size(); ++lane) EXPECT_EQ(after[lane], before[lane]);
}

template <class Real>
struct Quad {
  Real a, b, c, d;
};

// Points that share a row add one after the other, points that do not find their own.
TYPED_TEST(Rows, AddedRowsMeetInSharedMemory) {
  using Real = TypeParam;
  const Quad<Real> given{numbered<Real>(0), numbered<Real>(1), numbered<Real>(2),
                         numbered<Real>(3)};
  alignas(64) double own[Real::size()][4] = {}, shared[4] = {};
  add_rows<Quad, Real>(given, [&](std::size_t point) { return own[point]; });
  add_rows<Quad, Real>(given, [&](std::size_t) { return shared; });
  double sum[4] = {};
  for (std::size_t point = 0; point < Real::size(); ++point)
    for (int n = 0; n < 4; ++n) {
      EXPECT_EQ(own[point][n], 10 * static_cast<int>(point) + n);
      sum[n] += own[point][n];
    }
  for (int n = 0; n < 4; ++n) EXPECT_EQ(shared[n], sum[n]);
  double together[4] = {};
  add_sums<Quad, Real>(given, [&](std::size_t) { return together; });
  for (int n = 0; n < 4; ++n) EXPECT_EQ(together[n], sum[n]);
}

TEST(Wide, SelectionNeverMixesLanes) {
  const Wide x = numbered<Wide>(0), y(15.0);
  const Wide larger_one = larger(x, y);
  for (std::size_t lane = 0; lane < Wide::size(); ++lane)
    EXPECT_EQ(larger_one[lane], std::max(10.0 * static_cast<double>(lane), 15.0));
  EXPECT_TRUE(any(x > y));
  EXPECT_FALSE(all(x > y));
  EXPECT_TRUE(alike(y));
  EXPECT_FALSE(alike(x));
}

}  // namespace
}  // namespace grainpair
