// Points on their way to a library and back: a block of them, numbers side by side.
#pragma once

#include <span>
#include <vector>

#include "mpm/external/law.hpp"
#include "mpm/numbers/arrays.hpp"

namespace grainpair {

/// An array for each number of many points; a block takes a window of each.
class Columns {
 public:
  explicit Columns(std::size_t count = 0) : columns_(count) {}
  std::vector<double>& operator[](std::size_t c) { return columns_[c]; }
  std::size_t count() const { return columns_.size(); }
  void resize(std::size_t points) {
    for (auto& column : columns_) column.resize(points, 0.0);
  }
  void reorder(std::span<const std::uint32_t> order) {
    for (auto& column : columns_) {
      std::vector<double> sorted(order.size());
      for (std::size_t i = 0; i < order.size(); ++i) sorted[i] = column[order[i]];
      column.swap(sorted);
    }
  }
  void archive(Archive& to) {
    for (std::size_t c = 0; c < count(); ++c) to.list("kept/" + std::to_string(c), columns_[c]);
  }

 private:
  std::vector<std::vector<double>> columns_;
};

/// f(points, row of the block) by fours.
inline void by_fours(std::size_t begin, std::size_t end, auto&& f) {
  const std::size_t full = (end - begin) / Wide::size() * Wide::size();
  for (std::size_t k = 0; k < full; k += Wide::size()) f(Block{begin + k}, Block{k});
  if (begin + full < end) f(Scattered::some(begin + full, end), Block{full});
}

/// A number of every point of a block; whole registers may be stored up to its end.
using Numbers = std::array<double, GRAINPAIR_BLOCK + Wide::size()>;

/// What a law is called with for the points of a block, and what it answers.
struct Called {
  std::array<Numbers, 6> stress, strain, total;
  std::array<Numbers, 3> spin;
  Numbers e_old, e, modulus, bulk, stored, dissipated, id, clock, steps;
  std::array<Numbers, 2> counted;
  std::vector<Numbers> states;

  explicit Called(std::size_t state_count) : states(state_count), pointers_(state_count) {}

  /// The arguments of a call for the first `size` points.
  ExternalPoints points(int size, double dt) {
    ExternalPoints out{.id = id.data(), .time = clock.data(), .steps = steps.data()};
    auto& block = out.block;
    block.size = size, block.dt = dt;
    for (std::size_t a = 0; a < 6; ++a) {
      block.strain[a] = strain[a].data(), block.stress[a] = stress[a].data();
      out.total[a] = total[a].data();
    }
    for (std::size_t a = 0; a < 3; ++a) block.spin[a] = spin[a].data();
    block.void_ratio_old = e_old.data(), block.void_ratio = e.data();
    for (std::size_t s = 0; s < states.size(); ++s) pointers_[s] = states[s].data();
    block.state_count = static_cast<int>(states.size()), block.state = pointers_.data();
    block.modulus = modulus.data();
    block.stored = stored.data(), block.dissipated = dissipated.data();
    out.bulk = bulk.data();
    out.counted = {counted[0].data(), counted[1].data()};
    return out;
  }

  void swap(std::size_t i, std::size_t k) {
    each([&](Numbers& numbers) { std::swap(numbers[i], numbers[k]); });
  }
  /// Point i at place k once more.
  void repeat(std::size_t i, std::size_t k) {
    each([&](Numbers& numbers) { numbers[k] = numbers[i]; });
  }

 private:
  void each(auto&& f) {
    for (std::size_t a = 0; a < 6; ++a) f(stress[a]), f(strain[a]), f(total[a]);
    for (auto& numbers : spin) f(numbers);
    for (auto* numbers : {&e_old, &e, &modulus, &bulk, &stored, &dissipated, &id, &clock, &steps})
      f(*numbers);
    for (auto& numbers : counted) f(numbers);
    for (auto& numbers : states) f(numbers);
  }

  std::vector<double*> pointers_;
};

}  // namespace grainpair
