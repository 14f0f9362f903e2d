#include "mpm/numbers/columns.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace grainpair {
namespace {

constexpr std::size_t count = 11;  // no whole number of registers

template <class Real>
struct Triple {
  Real a, b, c;
};
Columns<Triple> numbered() {
  Columns<Triple> columns(count);
  for (std::size_t p = 0; p < count; ++p)
    columns.set(p, {1.0 * static_cast<double>(p), 100.0, -1.0 * static_cast<double>(p)});
  return columns;
}

TEST(Columns, EveryPointIsLoadedAndStoredOnce) {
  Columns<Triple> columns = numbered();
  std::size_t blocks = 0;
  for_each_block(1, count, [&](const auto& block) {  // from an odd place, the last block not full
    Triple<Wide> three = columns.load(block);
    three.b = three.b + three.a;
    columns.store(three, block);
    ++blocks;
  });
  EXPECT_EQ(blocks, (count - 1 + Wide::size() - 1) / Wide::size());
  for (std::size_t p = 0; p < count; ++p) {
    const double number = static_cast<double>(p);
    EXPECT_EQ(columns[p].a, number);
    EXPECT_EQ(columns[p].b, 100.0 + number);
    EXPECT_EQ(columns[p].c, -number);
  }
}

TEST(Columns, SumsCountLeftOverLanesOnce) {
  std::vector<double> ones(count, 1.0);
  double sum = 0.0;
  for_each_block(0, count, [&](const auto& block) { sum += reduce(block.load_once(ones)); });
  EXPECT_EQ(sum, static_cast<double>(count));
}

TEST(Columns, ScatteredPointsAreFoundAndPutBack) {
  Columns<Triple> columns = numbered();
  Scattered at;
  for (std::size_t lane = 0; lane < Wide::size(); ++lane) at.points[lane] = (7 * lane + 3) % count;
  const auto three = columns.load(at);
  columns.store({three.c, three.b, three.a}, at);
  for (std::size_t lane = 0; lane < Wide::size(); ++lane) {
    EXPECT_EQ(three.a[lane], static_cast<double>(at(lane)));
    EXPECT_EQ(columns[at(lane)].a, -static_cast<double>(at(lane)));
  }
}

TEST(Columns, MatricesAreSeenInPlaceAndReordered) {
  Columns<Tensor> tensors(count);
  for (std::size_t p = 0; p < count; ++p) tensors[p] = static_cast<double>(p) * identity();
  tensors[4][3] = 7.0;
  std::vector<std::uint32_t> order(count);
  std::iota(order.rbegin(), order.rend(), 0u);
  tensors.reorder(order);
  EXPECT_EQ(tensors[count - 1 - 4][3], 7.0);
  for (std::size_t p = 0; p < count; ++p)
    EXPECT_EQ(trace(SymTensor(tensors[p])), 3.0 * static_cast<double>(count - 1 - p));
}

}  // namespace
}  // namespace grainpair
