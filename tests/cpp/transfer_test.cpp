// What becomes of a point's velocity on the way back from the nodes.
#include "mpm/transfer/transfer.hpp"

#include <gtest/gtest.h>

namespace grainpair {
namespace {

constexpr TransferScheme schemes[] = {TransferScheme::pic, TransferScheme::flip,
                                      TransferScheme::apic, TransferScheme::affine_flip,
                                      TransferScheme::xpic};

/// What a point has beside the grid's velocity keeps its direction, and is no faster than `most`.
TEST(Transfer, HoldsWhatAPointHasOfItsOwn) {
  const Eigen::Vector2d grid(1.0, -2.0), own(3.0, 4.0), increment(0.25, 0.5);
  for (const TransferScheme scheme : schemes) {
    const auto v = [&](double most) -> Eigen::Vector2d {
      return transferred(scheme, Eigen::Vector2d(grid + own - increment), grid, increment, 0.0,
                         most);
    };
    const bool keeps = scheme == TransferScheme::flip || scheme == TransferScheme::affine_flip;
    EXPECT_EQ(v(5.5), v(INFINITY));  // to the last bit: there is nothing to hold
    EXPECT_NEAR((v(5.5) - grid).norm(), keeps ? 5.0 : 0.0, 1e-15);
    EXPECT_LT((v(2.5) - grid - (keeps ? 0.5 : 0.0) * own).norm(), 1e-15);
  }
}

/// Of several points at once, each by itself.
TEST(Transfer, HoldsEachOfSeveral) {
  VectorOf<2, Wide> v, grid, none;
  for (std::size_t lane = 0; lane < Wide::size(); ++lane) {
    v[0][lane] = static_cast<double>(lane), v[1][lane] = 0.0;
    grid[0][lane] = grid[1][lane] = none[0][lane] = none[1][lane] = 0.0;
  }
  const auto held = transferred(TransferScheme::flip, v, grid, none, 0.0, 1.5);
  for (std::size_t lane = 0; lane < Wide::size(); ++lane)
    EXPECT_DOUBLE_EQ(held[0][lane], std::min(static_cast<double>(lane), 1.5)) << lane;
}

}  // namespace
}  // namespace grainpair
