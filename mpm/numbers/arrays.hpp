// Quantities of many points, each of their numbers in an array of its own: as many points as a Wide
// holds, a block, are one load.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "mpm/numbers/archive.hpp"
#include "mpm/numbers/tensor.hpp"

namespace grainpair {

/// As many points as a Wide holds, from `first` on. Whoever keeps points pads them to whole blocks.
struct Block {
  std::size_t first;

  std::size_t operator()(std::size_t lane) const { return first + lane; }
  /// The same, counted from `origin`, and the converse.
  Block from(std::size_t origin) const { return {first - origin}; }
  Block beyond(std::size_t origin) const { return {origin + first}; }

  /// A number of each point.
  Wide load(const double* field) const { return load_row(field + first); }
  void store(const Wide& from, double* field) const { store_row(from, field + first); }
  /// Of a number in single precision.
  Wide load(const float* field) const {
    return std::experimental::static_simd_cast<Wide>(
        std::bit_cast<Float>(*reinterpret_cast<const FloatRow*>(field + first)));
  }
  Wide load(const std::vector<double>& field) const { return load(field.data()); }
  void store(const Wide& from, std::vector<double>& field) const { store(from, field.data()); }
};

/// As many points as a Wide holds, wherever they are.
struct Scattered {
  std::array<std::size_t, Wide::size()> points;

  /// One point, in every lane.
  static Scattered one(std::size_t point) {
    Scattered out;
    out.points.fill(point);
    return out;
  }
  /// Points begin ... end - 1, of which the last is repeated where they do not fill a register.
  static Scattered some(std::size_t begin, std::size_t end) {
    Scattered out;
    for (std::size_t lane = 0; lane < out.points.size(); ++lane)
      out.points[lane] = std::min(begin + lane, end - 1);
    return out;
  }
  std::size_t operator()(std::size_t lane) const { return points[lane]; }
  Scattered beyond(std::size_t origin) const {
    Scattered out;
    for (std::size_t lane = 0; lane < points.size(); ++lane)
      out.points[lane] = origin + points[lane];
    return out;
  }
  template <class Number>
  Wide load(const Number* field) const {
    return Wide([&](auto lane) { return static_cast<double>(field[points[lane]]); });
  }
  Wide load(const std::vector<double>& field) const { return load(field.data()); }
  void store(const Wide& from, double* field) const {
    for (std::size_t lane = 0; lane < points.size(); ++lane) field[points[lane]] = from[lane];
  }
  void store(const Wide& from, std::vector<double>& field) const { store(from, field.data()); }
};

/// The blocks that together hold as many points as a Real.
template <class Real>
using Blocks = std::array<Block, Real::size() / Wide::size()>;

/// Points of which every sweep takes whole blocks, in either precision.
constexpr std::size_t whole(std::size_t points) {
  constexpr std::size_t most = WideFloat::size();
  return (points + most - 1) / most * most;
}

/// f(blocks) over points begin ... end - 1, which fill whole blocks.
template <class Real, class F>
void for_each_blocks(std::size_t begin, std::size_t end, F&& f) {
  for (; begin < end; begin += Real::size()) {
    Blocks<Real> blocks;
    for (std::size_t b = 0; b < blocks.size(); ++b) blocks[b].first = begin + b * Wide::size();
    f(blocks);
  }
}
/// f(block) over points begin ... end - 1, which fill whole blocks.
template <class F>
void for_each_block(std::size_t begin, std::size_t end, F&& f) {
  for (; begin < end; begin += Wide::size()) f(Block{begin});
}

/// Of the numbers of a struct.
struct Range {
  std::size_t begin = 0, end = 0;
  constexpr bool holds(std::size_t c) const { return c >= begin && c < end; }
};

template <class T>
concept EigenMatrix = std::is_base_of_v<Eigen::MatrixBase<T>, T>;

/// A struct of Reals, a vector or a matrix of every point; each of their numbers in an array.
template <template <class> class Struct, class Number = double>
class Arrays {
 public:
  static constexpr std::size_t width = sizeof(Struct<Wide>) / sizeof(Wide);
  static_assert(sizeof(Struct<double>) - width * sizeof(double) < 16,
                "doubles, and padding at the end");

  explicit Arrays(std::size_t points = 0) { resize(points); }

  /// What it held is lost where it outgrows its room; `value` fills new room.
  void resize(std::size_t points, Number value = 0) {
    size_ = points;
    if (stride_ == stride_for(points)) return;
    stride_ = stride_for(points);
    numbers_.assign(width * stride_, value);
  }
  std::size_t size() const { return size_; }

  /// But for the numbers `without.begin` ... `without.end` - 1, which are zero.
  template <class At>
  Struct<Wide> load(const At& at, const Range& without = {}) const {
    Struct<Wide> out;
    auto* const to = reinterpret_cast<Wide*>(&out);
    each([&](std::size_t c) { to[c] = without.holds(c) ? Wide(0.0) : at.load(array(c)); });
    return out;
  }
  template <class At>
  void store(const Struct<Wide>& from, const At& at, const Range& without = {}) {
    const auto* const in = reinterpret_cast<const Wide*>(&from);
    each([&](std::size_t c) {
      if (!without.holds(c)) at.store(in[c], array(c));
    });
  }

  /// As many points as a Real of this precision holds.
  template <class Real>
  Struct<Real> load_blocks(const Blocks<Real>& blocks) const {
    if constexpr (std::is_same_v<Real, Wide>) {
      return load(blocks[0]);
    } else {
      Struct<Real> out;
      auto* const to = reinterpret_cast<Real*>(&out);
      each([&](std::size_t c) {
        to[c] = wide(*reinterpret_cast<const WideFloatRow*>(array(c) + blocks[0].first));
      });
      return out;
    }
  }
  template <class Real>
  void store_blocks(const Struct<Real>& from, const Blocks<Real>& blocks) {
    if constexpr (std::is_same_v<Real, Wide>) {
      store(from, blocks[0]);
    } else {
      const auto* const in = reinterpret_cast<const Real*>(&from);
      each([&](std::size_t c) {
        *reinterpret_cast<WideFloatRow*>(array(c) + blocks[0].first) = lanes(in[c]);
      });
    }
  }

  /// One point's: a copy of a struct, a view of a vector or matrix.
  auto operator[](std::size_t p) const {
    if constexpr (EigenMatrix<Struct<Number>>) {
      return Eigen::Map<const Struct<Number>, 0, Stride>(array(0) + p, stride());
    } else {
      Struct<Number> out;
      auto* const to = reinterpret_cast<Number*>(&out);
      each([&](std::size_t c) { to[c] = array(c)[p]; });
      return out;
    }
  }
  auto operator[](std::size_t p) requires EigenMatrix<Struct<Number>> {
    return Eigen::Map<Struct<Number>, 0, Stride>(array(0) + p, stride());
  }
  void set(std::size_t p, const Struct<Number>& from) {
    const auto* const in = reinterpret_cast<const Number*>(&from);
    each([&](std::size_t c) { array(c)[p] = in[c]; });
  }

  template <class Other>
  void assign(const Arrays<Struct, Other>& from) {
    resize(from.size());
    each([&](std::size_t c) { std::copy_n(from.array(c), size_, array(c)); });
  }

  /// point[i] <- point[order[i]]; of as many as `order` has.
  template <class Order>
  void reorder(const Order& order) {
    const std::size_t stride = stride_for(order.size());
    std::vector<Number, Eigen::aligned_allocator<Number>> sorted(
        stride == stride_ ? order.size() : width * stride);
    each([&](std::size_t c) {
      Number* const to = sorted.data() + (stride == stride_ ? 0 : c * stride);
      for (std::size_t i = 0; i < order.size(); ++i) to[i] = array(c)[order[i]];
      if (stride == stride_) std::copy_n(to, order.size(), array(c));
    });
    if (stride != stride_) numbers_.swap(sorted);
    size_ = order.size(), stride_ = stride;
  }

  void archive(const std::string& name, Archive& to) {
    std::size_t points = size_;
    to.number(name + "/points", points);
    resize(points);
    each([&](std::size_t c) {
      to.numbers(name + "/" + std::to_string(c), std::span(array(c), size_));
    });
  }

 private:
  template <template <class> class, class>
  friend class Arrays;
  /// An odd number of cache lines beyond whole pages: the numbers of a point share no set of the
  /// cache.
  static constexpr std::size_t stride_for(std::size_t points) {
    return (points + 511) / 512 * 512 + 40;
  }
  using Stride = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;

  template <class F>
  static void each(F&& f) {
    [&]<std::size_t... c>(std::index_sequence<c...>) { (f(c), ...); }
    (std::make_index_sequence<width>());
  }
  Number* array(std::size_t c) { return numbers_.data() + c * stride_; }
  const Number* array(std::size_t c) const { return numbers_.data() + c * stride_; }
  Stride stride() const {
    const auto inner = static_cast<Eigen::Index>(stride_);
    return {inner * Struct<Number>::RowsAtCompileTime, inner};
  }

  std::size_t size_ = 0, stride_ = 0;
  std::vector<Number, Eigen::aligned_allocator<Number>> numbers_;
};

/// What points exchange with nodes, in the precision in which they do: double, or single.
template <template <class> class Struct>
class ExchangedArrays {
 public:
  explicit ExchangedArrays(std::size_t points = 0, bool single = false) : is_single_(single) {
    resize(points);
  }

  void resize(std::size_t points) { is_single_ ? single_.resize(points) : double_.resize(points); }
  /// In single precision from now on.
  void keep_single() {
    single_.assign(double_);
    double_ = Arrays<Struct>();
    is_single_ = true;
  }

  template <class At>
  Struct<Wide> load(const At& at) const {
    return is_single_ ? single_.load(at) : double_.load(at);
  }
  template <class Real>
  Struct<Real> load_blocks(const Blocks<Real>& blocks) const {
    if constexpr (std::is_same_v<Real, WideFloat>)
      return single_.template load_blocks<Real>(blocks);
    else
      return double_.template load_blocks<Real>(blocks);
  }
  template <class Real>
  void store_blocks(const std::type_identity_t<Struct<Real>>& from, const Blocks<Real>& blocks) {
    if constexpr (std::is_same_v<Real, WideFloat>)
      single_.template store_blocks<Real>(from, blocks);
    else
      double_.template store_blocks<Real>(from, blocks);
  }

  /// One point's, as long as it is double.
  auto operator[](std::size_t p) const { return double_[p]; }
  auto operator[](std::size_t p) { return double_[p]; }

  template <class Order>
  void reorder(const Order& order) {
    is_single_ ? single_.reorder(order) : double_.reorder(order);
  }
  void archive(const std::string& name, Archive& to) {
    is_single_ ? single_.archive(name, to) : double_.archive(name, to);
  }

 private:
  Arrays<Struct> double_;
  Arrays<Struct, float> single_;
  bool is_single_;
};

}  // namespace grainpair
