// Processes that share a scene: each is the rank of some columns of cells along x, one beside the
// other, and has the points in them. The last and the first are neighbours, too, which have
// something to say to each other where the scene repeats. What a solver asks the others is here; a
// process alone, which this class is, asks nobody. mpm/ranks has those of MPI.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "cases/failure.hpp"

namespace grainpair {

using Bytes = std::vector<std::byte>;

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& values) {
  static_assert(std::is_trivially_copyable_v<T>);
  return std::as_bytes(std::span(values));
}

/// Another rank has said why nothing begins.
struct NotBegun {};

class Ranks {
 public:
  virtual ~Ranks() = default;
  /// From the left to the right.
  virtual int here() const { return 0; }
  virtual int count() const { return 1; }
  /// Of them on this machine.
  virtual int on_this_machine() const { return 1; }
  bool many() const { return count() > 1; }
  int left() const { return (here() + count() - 1) % count(); }
  int right() const { return (here() + 1) % count(); }
  /// Whether columns of cells change hands when ranks have come to have unequal shares of points.
  virtual bool balance() const { return false; }

  /// What this one has sent to its neighbours so far [bytes].
  virtual double sent() const { return 0.0; }

  /// What every rank says here, as long as this, one behind the other.
  template <class T>
  std::vector<T> all(const T& mine) const {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<T> out(static_cast<std::size_t>(count()), mine);
    if (many()) gather_all(&mine, out.data(), sizeof(T));
    return out;
  }
  /// Sums over the ranks, in their order: alike to the last bit on each.
  template <class T>
  void sum(std::span<T> mine) const {
    reduce(mine, [](T& to, const T& other) { to += other; });
  }
  template <class T>
  void largest(std::span<T> mine) const {
    reduce(mine, [](T& to, const T& other) { to = std::max(to, other); });
  }
  template <class T>
  T largest(T mine) const {
    largest(std::span(&mine, 1));
    return mine;
  }
  /// On rank 0 what all of them have, one behind the other; elsewhere nothing.
  template <class T>
  std::vector<T> gathered(std::vector<T> mine) const {
    static_assert(std::is_trivially_copyable_v<T>);
    if (!many()) return mine;
    const Bytes found = gather(std::as_bytes(std::span(mine)));
    std::vector<T> out(found.size() / sizeof(T));
    if (!found.empty()) std::memcpy(out.data(), found.data(), found.size());
    return out;
  }
  /// Calls `prepare` on rank 0, which may throw; then the others throw NotBegun.
  template <class F>
  void begin(F&& prepare) const {
    char ready = 1;
    if (here() != 0) {
      if (!all(ready)[0]) throw NotBegun();
      return;
    }
    try {
      prepare();
    } catch (...) {
      ready = 0;
      all(ready);
      throw;
    }
    all(ready);
  }
  /// Ends all of them, some of which may wait for this one.
  virtual void abandon() const {}
  /// Throws what the first of them has to throw, on all of them.
  void refuse(const std::optional<SolverError>& mine) const {
    if (!many() && mine) throw *mine;
    if (!many()) return;
    const auto failed = all(static_cast<char>(mine.has_value()));
    const auto first = std::ranges::find(failed, 1) - failed.begin();
    if (first == count()) return;
    struct Line {
      std::array<char, 1000> text;
      Failure code;
    } line{};
    if (mine) {
      const std::string_view text = mine->what();
      text.copy(line.text.data(), line.text.size() - 1);
      line.code = mine->code;
    }
    line = all(line)[static_cast<std::size_t>(first)];
    throw SolverError(line.code, std::string(line.text.data()));
  }
  /// Sends to either neighbour, and receives from it what there is room for.
  virtual void swap(std::span<const std::byte> /*to_left*/, std::span<const std::byte> /*to_right*/,
                    std::span<std::byte> /*from_left*/, std::span<std::byte> /*from_right*/) const {
  }
  /// The same of whatever length: what the two have sent.
  std::pair<Bytes, Bytes> swap(const Bytes& to_left, const Bytes& to_right) const {
    std::size_t size[] = {to_left.size(), to_right.size()}, theirs[] = {0, 0};
    const auto each = std::as_bytes(std::span(size));
    const auto room = std::as_writable_bytes(std::span(theirs));
    constexpr std::size_t n = sizeof(std::size_t);
    swap(each.first(n), each.last(n), room.first(n), room.last(n));
    Bytes from_left(theirs[0]), from_right(theirs[1]);
    swap(to_left, to_right, from_left, from_right);
    return {std::move(from_left), std::move(from_right)};
  }

 protected:
  virtual void gather_all(const void* mine, void* all, std::size_t size) const {
    std::memcpy(all, mine, size);
  }
  virtual Bytes gather(std::span<const std::byte> mine) const { return {mine.begin(), mine.end()}; }

 private:
  template <class T, class F>
  void reduce(std::span<T> mine, F&& add) const {
    if (!many()) return;
    const std::size_t n = mine.size();
    std::vector<T> every(n * static_cast<std::size_t>(count()));
    gather_all(mine.data(), every.data(), mine.size_bytes());
    std::copy_n(every.begin(), n, mine.begin());
    for (std::size_t k = n; k < every.size(); ++k) add(mine[k % n], every[k]);
  }
};

/// A process alone.
inline const Ranks& alone() {
  static const Ranks one;
  return one;
}

}  // namespace grainpair
