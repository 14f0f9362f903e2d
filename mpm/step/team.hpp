// Threads that share out a sweep. The one that calls takes part, and waits for those alone that
// have taken something: a helper that the machine keeps from running holds nobody up. (A team of
// OpenMP meets at the end of every sweep, all of it; where other programs run, each meeting takes a
// time slice of theirs, and two threads were five times slower than one.)
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>
#include <vector>

namespace grainpair {

/// How far something has come; rises alone.
class Milestone {
 public:
  void set(unsigned stage) { stage_.store(stage, std::memory_order_release); }
  void await(unsigned stage) const;

 private:
  std::atomic<unsigned> stage_{0};
};

/// What the threads of all sweeps are.
class Team {
 public:
  static Team& of_all() {
    static Team team;
    return team;
  }
  Team(const Team&) = delete;
  ~Team();

  /// f(0) ... f(count - 1), begun in this order by up to `threads` threads; returns when all are
  /// done. f must not throw; it may wait for what began before it. A caller who finds others at it
  /// does his by himself.
  template <class F>
  void share(int count, int threads, const F& f) {
    run(
        count, threads, [](const void* job, int i) { (*static_cast<const F*>(job))(i); }, &f);
  }

 private:
  Team() = default;
  using Call = void (*)(const void*, int);

  void run(int count, int threads, Call call, const void* job);
  static void alone(int count, Call call, const void* job);
  void share_out(int count, int threads, Call call, const void* job);
  void help(int helper);
  bool take();

  // Generation of the work, next of it that nobody has taken, and its count: whoever moves the
  // second owns what he took, and the work stays until that is done.
  std::atomic<std::uint64_t> left_{0};
  std::atomic<int> undone_{0};
  std::atomic<std::uint32_t> calls_{0};  // for help; helpers sleep on it
  std::atomic<int> wanted_{0};
  std::atomic<bool> over_{false};
  std::atomic_flag busy_;
  Call call_ = nullptr;
  const void* job_ = nullptr;
  std::vector<std::thread> helpers_;
  std::chrono::steady_clock::time_point alone_until_{};
};

}  // namespace grainpair
