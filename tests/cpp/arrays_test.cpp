#include "mpm/numbers/arrays.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace grainpair {
namespace {

constexpr std::size_t count = 16;  // two blocks of single precision

template <class Real>
struct Triple {
  Real a, b, c;
};
Arrays<Triple> numbered() {
  Arrays<Triple> numbers(count);
  for (std::size_t p = 0; p < count; ++p)
    numbers.set(p, {1.0 * static_cast<double>(p), 100.0, -1.0 * static_cast<double>(p)});
  return numbers;
}

TEST(Arrays, EveryPointIsLoadedAndStoredOnce) {
  Arrays<Triple> numbers = numbered();
  std::size_t blocks = 0;
  for_each_block(4, count, [&](const Block& block) {
    Triple<Wide> three = numbers.load(block);
    three.b = three.b + three.a;
    numbers.store(three, block);
    ++blocks;
  });
  EXPECT_EQ(blocks, (count - 4) / Wide::size());
  for (std::size_t p = 0; p < count; ++p) {
    const double number = static_cast<double>(p);
    EXPECT_EQ(numbers[p].a, number);
    EXPECT_EQ(numbers[p].b, p < 4 ? 100.0 : 100.0 + number);
    EXPECT_EQ(numbers[p].c, -number);
  }
}

TEST(Arrays, WhatIsLeftOutIsZeroAndStays) {
  Arrays<Triple> numbers = numbered();
  constexpr Range last{2, 3};
  auto three = numbers.load(Block{0}, last);
  EXPECT_EQ(reduce(abs(three.c)), 0.0);
  numbers.store(three, Block{0}, last);
  EXPECT_EQ(numbers[3].c, -3.0);
}

TEST(Arrays, SinglePrecisionRoundsAndComesBack) {
  ExchangedArrays<Triple> numbers(count, true);
  const auto third = [](auto lane) { return static_cast<float>(lane + 1) / 3.0f; };
  for_each_blocks<WideFloat>(0, count, [&](const Blocks<WideFloat>& blocks) {
    numbers.store_blocks<WideFloat>({WideFloat(third), WideFloat(0), WideFloat(1)}, blocks);
  });
  const auto back = numbers.load_blocks<WideFloat>({Block{8}, Block{12}});
  const auto wide = numbers.load(Block{12});
  for (std::size_t lane = 0; lane < Wide::size(); ++lane) {
    EXPECT_EQ(back.a[lane], third(lane));
    EXPECT_EQ(wide.a[lane], static_cast<double>(third(lane + 4)));
  }
  EXPECT_NE(wide.a[0], 5.0 / 3.0);  // it was single precision
}

/// Points come in a new order and in other numbers: beyond the room there was, too.
TEST(Arrays, AnOrderMayRepeatPointsAndNeedMoreRoom) {
  Arrays<Triple> numbers = numbered();
  std::vector<std::uint32_t> order(600);
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i % count);
  numbers.reorder(order);
  ASSERT_EQ(numbers.size(), order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    EXPECT_EQ(numbers[i].a, static_cast<double>(i % count));
    EXPECT_EQ(numbers[i].c, -static_cast<double>(i % count));
  }
}

TEST(Arrays, ScatteredPointsAreFoundAndPutBack) {
  Arrays<Triple> numbers = numbered();
  Scattered at;
  for (std::size_t lane = 0; lane < Wide::size(); ++lane) at.points[lane] = (7 * lane + 3) % count;
  const auto three = numbers.load(at);
  numbers.store({three.c, three.b, three.a}, at);
  for (std::size_t lane = 0; lane < Wide::size(); ++lane) {
    EXPECT_EQ(three.a[lane], static_cast<double>(at(lane)));
    EXPECT_EQ(numbers[at(lane)].a, -static_cast<double>(at(lane)));
  }
}

TEST(Arrays, MatricesAreSeenInPlaceAndReordered) {
  Arrays<Tensor> tensors(count);
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
