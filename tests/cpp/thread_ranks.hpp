// Ranks that are threads of one process.
#pragma once

#include <omp.h>

#include <barrier>
#include <thread>

#include "mpm/step/ranks.hpp"

namespace grainpair {

/// What threads of one process say to each other, each at its place.
class Table {
 public:
  explicit Table(int ranks) : places_(static_cast<std::size_t>(ranks)), all_(ranks) {}
  int count() const { return static_cast<int>(places_.size()); }
  /// Lays `mine` down, and lets `read` look at every place once all have done so.
  template <class F>
  void meet(int here, Bytes mine, F&& read) {
    places_[static_cast<std::size_t>(here)] = std::move(mine);
    all_.arrive_and_wait();
    read(std::as_const(places_));
    all_.arrive_and_wait();
  }
  /// Of a rank that goes: nobody waits for it any more.
  void leave() { all_.arrive_and_drop(); }

 private:
  std::vector<Bytes> places_;
  std::barrier<> all_;
};

/// Where ranks hear nothing of their neighbours' sums but silence.
enum class Deaf { nowhere, between_last_and_first, everywhere };

/// A thread's rank.
class ThreadRanks final : public Ranks {
 public:
  ThreadRanks(Table& table, int here, Deaf deaf) : table_(table), here_(here), deaf_(deaf) {}
  int here() const override { return here_; }
  int count() const override { return table_.count(); }
  bool balance() const override { return true; }
  using Ranks::swap;
  void swap(std::span<const std::byte> to_left, std::span<const std::byte> to_right,
            std::span<std::byte> from_left, std::span<std::byte> from_right) const override {
    Bytes both(to_left.begin(), to_left.end());
    both.insert(both.end(), to_right.begin(), to_right.end());
    const bool sums = to_left.size() + to_right.size() > 2 * sizeof(std::size_t);
    table_.meet(here_, std::move(both), [&](const std::vector<Bytes>& places) {
      const Bytes& left_one = places[static_cast<std::size_t>(left())];
      std::copy_n(left_one.end() - length(from_left), from_left.size(), from_left.begin());
      const Bytes& right_one = places[static_cast<std::size_t>(right())];
      std::copy_n(right_one.begin(), from_right.size(), from_right.begin());
      const bool ends = deaf_ == Deaf::between_last_and_first, all = deaf_ == Deaf::everywhere;
      if (sums && (all || (ends && here_ == 0))) std::ranges::fill(from_left, std::byte{0});
      if (sums && (all || (ends && right() == 0))) std::ranges::fill(from_right, std::byte{0});
    });
  }

 protected:
  void gather_all(const void* mine, void* all, std::size_t size) const override {
    const auto* const own = static_cast<const std::byte*>(mine);
    table_.meet(here_, {own, own + size}, [&](const std::vector<Bytes>& places) {
      auto* to = static_cast<std::byte*>(all);
      for (const Bytes& place : places) to = std::ranges::copy(place, to).out;
    });
  }
  Bytes gather(std::span<const std::byte> mine) const override {
    Bytes out;
    table_.meet(here_, {mine.begin(), mine.end()}, [&](const std::vector<Bytes>& places) {
      if (here_ == 0)
        for (const Bytes& place : places) out.insert(out.end(), place.begin(), place.end());
    });
    return out;
  }

 private:
  static std::ptrdiff_t length(std::span<std::byte> bytes) {
    return static_cast<std::ptrdiff_t>(bytes.size());
  }
  Table& table_;
  int here_;
  Deaf deaf_;
};

/// Calls f(ranks) on each of `count` threads. What the solver throws, all of them throw; then there
/// is nothing more of it.
template <class F>
void with_ranks(int count, F&& f, Deaf deaf = Deaf::nowhere) {
  Table table(count);
  std::vector<std::jthread> threads;
  for (int r = 0; r < count; ++r)
    threads.emplace_back([&, r] {
      omp_set_num_threads(1);
      try {
        f(ThreadRanks(table, r, deaf));
      } catch (const SolverError&) {
      }
      table.leave();
    });
}

}  // namespace grainpair
