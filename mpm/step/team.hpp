// Threads that share out a sweep. The one that calls takes part, and waits for those alone that
// have taken something: a helper that the machine keeps from running holds nobody up. (A team of
// OpenMP meets at the end of every sweep, all of it; where other programs run, each meeting takes a
// time slice of theirs.)
#pragma once

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <thread>

namespace grainpair {

/// How far something has come; rises alone.
class Milestone {
 public:
  void set(unsigned stage) { stage_.store(stage, std::memory_order_release); }
  void await(unsigned stage) const {
    while (stage_.load(std::memory_order_acquire) != stage) std::this_thread::yield();
  }

 private:
  std::atomic<unsigned> stage_{0};
};

/// f(0) ... f(count - 1), begun in this order by up to `threads` threads; returns when all are
/// done. f may wait for what began before it.
template <class F>
void share_out(int count, int threads, const F& f) {
  std::atomic<int> next{0};
  tbb::parallel_for(0, std::min(threads, count), [&](int) {
    for (int i; (i = next.fetch_add(1, std::memory_order_relaxed)) < count;) f(i);
  });
}

}  // namespace grainpair
