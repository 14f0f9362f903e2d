#include "mpm/step/team.hpp"

#include <sched.h>

#include <algorithm>
#include <chrono>

namespace grainpair {

namespace {

using Clock = std::chrono::steady_clock;

void pause() { __builtin_ia32_pause(); }

/// Some 0.1 ms, longer than a thread is alone between two sweeps: going to sleep and being called
/// takes a fifth of a sweep.
constexpr int spins = 4000;

/// Of this thread, for what another one holds.
thread_local Clock::duration waited{};

template <class F>
void wait_until(F&& done) {
  if (done()) return;
  const auto start = Clock::now();
  for (int i = 0; !done(); ++i) {
    if (i < spins)
      pause();
    else
      sched_yield();
  }
  waited += Clock::now() - start;
}

/// How long the caller does without help after a sweep that was waiting for the most part, over
/// what he waited: where the machine has no second core to give, asking for it costs a thirtieth.
constexpr int times_alone = 32;

constexpr int bits = 20;  // of a count: strips, or chunks of slices
constexpr std::uint64_t mask = (1u << bits) - 1;

}  // namespace

void Milestone::await(unsigned stage) const {
  wait_until([&] { return stage_.load(std::memory_order_acquire) == stage; });
}

bool Team::take() {
  std::uint64_t left = left_.load(std::memory_order_acquire);
  for (;;) {
    const std::uint64_t next = left >> bits & mask, count = left & mask;
    if (next >= count) return false;
    if (!left_.compare_exchange_weak(left, left + (1ull << bits), std::memory_order_acq_rel))
      continue;
    call_(job_, static_cast<int>(next));
    undone_.fetch_sub(1, std::memory_order_release);
    return true;
  }
}

void Team::run(int count, int threads, Call call, const void* job) {
  if (busy_.test_and_set(std::memory_order_acquire)) return alone(count, call, job);
  if (Clock::now() < alone_until_)
    alone(count, call, job);
  else
    share_out(count, threads, call, job);
  busy_.clear(std::memory_order_release);
}

void Team::alone(int count, Call call, const void* job) {
  for (int i = 0; i < count; ++i) call(job, i);
}

void Team::share_out(int count, int threads, Call call, const void* job) {
  while (static_cast<int>(helpers_.size()) < threads - 1) {
    const int helper = static_cast<int>(helpers_.size());
    helpers_.emplace_back([this, helper] { help(helper); });
  }
  const auto start = Clock::now();
  waited = {};
  wanted_.store(threads - 1, std::memory_order_relaxed);
  call_ = call, job_ = job;
  undone_.store(count, std::memory_order_relaxed);
  const std::uint64_t generation = (left_.load(std::memory_order_relaxed) >> 2 * bits) + 1;
  left_.store(generation << 2 * bits | static_cast<std::uint64_t>(count),
              std::memory_order_release);
  calls_.fetch_add(1, std::memory_order_release);
  calls_.notify_all();
  while (take()) {
  }
  wait_until([&] { return undone_.load(std::memory_order_acquire) == 0; });
  const auto end = Clock::now();
  if (2 * waited > end - start) alone_until_ = end + times_alone * waited;
}

void Team::help(int helper) {
  std::uint32_t seen = 0;
  while (!over_.load(std::memory_order_acquire)) {
    if (helper < wanted_.load(std::memory_order_relaxed))
      while (take()) {
      }
    std::uint32_t calls = calls_.load(std::memory_order_acquire);
    for (int i = 0; calls == seen && i < spins; ++i) {
      pause();
      calls = calls_.load(std::memory_order_acquire);
    }
    if (calls == seen) calls_.wait(seen, std::memory_order_acquire);
    seen = calls_.load(std::memory_order_acquire);
  }
}

Team::~Team() {
  over_.store(true, std::memory_order_release);
  calls_.fetch_add(1, std::memory_order_release);
  calls_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
}

}  // namespace grainpair
