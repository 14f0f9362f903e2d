// Threads that share out a sweep.
#include "mpm/step/team.hpp"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <chrono>
#include <numeric>
#include <set>

namespace grainpair {
namespace {

TEST(Team, DoesEverythingOnce) {
  for (int sweep = 0; sweep < 2000; ++sweep) {
    const int count = sweep % 50;
    std::vector<int> done(static_cast<std::size_t>(count), 0);  // no atomics: each has one owner
    share_out({count, 4}, [&](int i) { ++done[static_cast<std::size_t>(i)]; });
    EXPECT_EQ(done, std::vector<int>(static_cast<std::size_t>(count), 1)) << sweep;
  }
}

/// Each sweep takes what other threads have left in the one before.
TEST(Team, SeesWhatWasDoneBetweenSweeps) {
  std::vector<long> now(1000, 0), next(1000);
  for (long sweep = 0; sweep < 1000; ++sweep) {
    share_out({10, 3}, [&](int i) {
      for (std::size_t j = 0; j < 100; ++j) {
        const std::size_t k = 100 * static_cast<std::size_t>(i) + j;
        next[k] = now[(k + 100) % 1000] + 1;
      }
    });
    std::swap(now, next);
    for (const long number : now) ASSERT_EQ(number, sweep + 1);
  }
}

/// What waits for an earlier phase comes to its end, whoever has it.
TEST(Team, MilestonesKeepAnOrder) {
  std::vector<int> ends(20);
  std::iota(ends.begin(), ends.end(), 1);
  const Shares one_by_one(ends, 3, [](int) { return 1.0; });
  for (unsigned sweep = 1; sweep < 500; ++sweep) {
    static std::vector<Milestone> done(20);
    std::vector<int> order;
    share_out(one_by_one, [&](int i) {
      if (i > 0) done[static_cast<std::size_t>(i - 1)].await(sweep);
      order.push_back(i);
      done[static_cast<std::size_t>(i)].set(sweep);
    });
    std::vector<int> in_order(20);
    std::iota(in_order.begin(), in_order.end(), 0);
    ASSERT_EQ(order, in_order);
  }
}

/// Of six pieces, and of three more, two threads begin with what is about as much work.
TEST(Team, SharesAreOfOneSize) {
  const std::array<double, 9> work{4.0, 1.0, 1.0, 1.0, 0.5, 0.5, 1.0, 1.0, 6.0};
  const Shares shares(std::array{6, 9}, 2,
                      [&](int i) { return work[static_cast<std::size_t>(i)]; });
  const std::array<std::array<int, 2>, 4> expected{{{0, 1}, {1, 6}, {6, 8}, {8, 9}}};
  for (std::size_t share = 0; share < expected.size(); ++share) {
    EXPECT_EQ(shares.begin(share), expected[share][0]) << share;
    EXPECT_EQ(shares.end(share), expected[share][1]) << share;
  }
}

/// A thread that never comes leaves its share to the others, before what waits for it.
TEST(Team, SharesOfTheAbsentAreDone) {
  const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);
  std::vector<Milestone> first(5);
  std::vector<int> done(10, 0);
  share_out({std::array{5, 10}, 4, [](int) { return 1.0; }}, [&](int i) {
    if (i < 5) first[static_cast<std::size_t>(i)].set(1);
    for (const Milestone& one : first)
      if (i >= 5) one.await(1);
    ++done[static_cast<std::size_t>(i)];
  });
  EXPECT_EQ(done, std::vector<int>(10, 1));
}

/// Helpers do help: of sweeps long enough to be woken for, some are not the caller's alone.
TEST(Team, IsMoreThanOne) {
  std::set<std::thread::id> who;
  std::vector<std::thread::id> of(200);
  for (int sweep = 0; sweep < 500 && who.size() < 2; ++sweep) {
    share_out({200, 2}, [&](int i) {
      of[static_cast<std::size_t>(i)] = std::this_thread::get_id();
      const auto end = std::chrono::steady_clock::now() + std::chrono::microseconds(20);
      while (std::chrono::steady_clock::now() < end) {
      }
    });
    who.insert(of.begin(), of.end());
  }
  EXPECT_EQ(who.size(), 2u);
}

/// A sweep within a sweep, or of another thread, is done without help.
TEST(Team, ASweepWithinASweepEnds) {
  std::vector<int> done(100, 0);
  share_out({10, 2}, [&](int i) {
    share_out({10, 2}, [&](int j) { ++done[static_cast<std::size_t>(10 * i + j)]; });
  });
  EXPECT_EQ(done, std::vector<int>(100, 1));
}

}  // namespace
}  // namespace grainpair
