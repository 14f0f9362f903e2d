// Processor time is told finer than a step takes, also where it is limited, as studies limit it.
#include "mpm/step/timed.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>

namespace grainpair {
namespace {

/// Does nothing, without rest, for so long [s]; asks for no clock of processors.
void spin(double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  while (Clock::now() < end) continue;
}

TEST(ProcessorSeconds, AreToldFinerThanTicksWhereTheyAreLimited) {
  rlimit limit{};
  getrlimit(RLIMIT_CPU, &limit);
  limit.rlim_cur = 10000;  // [s]
  ASSERT_EQ(setrlimit(RLIMIT_CPU, &limit), 0);
  constexpr double piece = 1e-4;  // a tick is 1e-3 s or more: of ten pieces nine would take none
  for (int i = 0; i < 50; ++i) {
    double own = 0.0;
    {
      const Timed timed(&own);
      spin(piece);
    }
    EXPECT_GT(own, 0.0);
  }
}

}  // namespace
}  // namespace grainpair
