// Threads that share out a sweep. The one that calls takes part, and waits for those alone that
// have taken something: a helper that the machine keeps from running holds nobody up. (A team of
// OpenMP meets at the end of every sweep, all of it; where other programs run, each meeting takes a
// time slice of theirs.)
#pragma once

#include <omp.h>
#include <oneapi/tbb/parallel_for.h>

#include <array>
#include <atomic>
#include <span>
#include <thread>
#include <vector>

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

/// Pieces of work, in phases that follow one another, and which thread of a team begins with which:
/// the same in every sweep over the same work, so that it finds in its cache what it left there.
class Shares {
 public:
  /// Phases end before the pieces ends[0], ends[1] ...; `work` tells how much a piece is, of any
  /// unit. Each thread has as much of a phase as the others, as far as whole pieces allow.
  template <class Work>
  Shares(std::span<const int> ends, int threads, const Work& work)
      : team_(static_cast<std::size_t>(threads)), phases_(ends.size()) {
    begin_.reserve(phases_ * team_ + 1);
    int next = 0;
    for (const int end : ends) {
      double all = 0.0, before = 0.0;
      for (int piece = next; piece < end; ++piece) all += work(piece);
      for (std::size_t share = 1; share <= team_; ++share) {
        begin_.push_back(next);
        const double until = all * static_cast<double>(share) / static_cast<double>(team_);
        while (next < end && before + 0.5 * work(next) < until) before += work(next++);
      }
      next = end;
    }
    begin_.push_back(next);
  }
  /// As many pieces for everyone.
  Shares(int count, int threads) : Shares(std::array{count}, threads, [](int) { return 1.0; }) {}

  std::size_t team() const { return team_; }
  std::size_t phases() const { return phases_; }
  /// Of a thread in a phase, at `phase * team() + thread`.
  int begin(std::size_t share) const { return begin_[share]; }
  int end(std::size_t share) const { return begin_[share + 1]; }

 private:
  std::size_t team_, phases_;
  std::vector<int> begin_;
};

/// f(piece) for every one; returns when all are done. A thread that has done its own share of a
/// phase helps the others. All of a phase have begun when one of the next begins: f may wait for
/// them.
template <class F>
void share_out(const Shares& shares, const F& f) {
  struct alignas(64) Next {
    std::atomic<int> piece;
  };
  const std::size_t team = shares.team();
  std::vector<Next> next(shares.phases() * team);
  for (std::size_t share = 0; share < next.size(); ++share) next[share].piece = shares.begin(share);
  const auto work = [&](std::size_t thread) {
    for (std::size_t phase = 0; phase < shares.phases(); ++phase)
      for (std::size_t k = 0; k < team; ++k) {
        const std::size_t share = phase * team + (thread + k) % team;
        const auto take = [&] { return next[share].piece.fetch_add(1, std::memory_order_relaxed); };
        for (int piece = take(); piece < shares.end(share); piece = take()) f(piece);
      }
  };
  tbb::parallel_for(std::size_t{0}, team, work, tbb::static_partitioner());
}

/// f(begin) ... f(end - 1), side by side; eight pieces a thread are enough to be even.
template <class F>
void side_by_side(int begin, int end, const F& f) {
  const int threads = omp_get_max_threads(), pieces = threads == 1 ? 1 : 8 * threads;
  const auto piece = [&](int k) {
    const int first = begin + (end - begin) * k / pieces;
    const int last = begin + (end - begin) * (k + 1) / pieces;
    for (int i = first; i < last; ++i) f(i);
  };
  if (threads == 1) return piece(0);
  share_out({pieces, threads}, piece);
}

}  // namespace grainpair
