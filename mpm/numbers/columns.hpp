// Quantities of many points, each of their numbers in an array of its own: as many points as a Wide
// holds are one load.
#pragma once

#include <cstdint>
#include <type_traits>
#include <vector>

#include "mpm/numbers/tensor.hpp"

namespace grainpair {

/// As many points as a Wide holds, from `first` on; lanes that are left over repeat the last; if
/// all are, the one at `first`.
template <bool Full>
struct Consecutive {
  std::size_t first, count;

  std::size_t operator()(std::size_t lane) const {
    return first + (Full ? lane : std::min(lane, std::max<std::size_t>(count, 1) - 1));
  }
  /// The same, counted from `origin`, and the converse.
  Consecutive from(std::size_t origin) const { return {first - origin, count}; }
  Consecutive beyond(std::size_t origin) const { return {origin + first, count}; }

  /// A number of each point.
  Wide load(const double* field) const {
    if constexpr (Full) return load_row(field + first);
    return Wide([&](auto lane) { return field[(*this)(lane)]; });
  }
  void store(const Wide& from, double* field) const {
    if constexpr (Full)
      store_row(from, field + first);
    else
      for (std::size_t lane = 0; lane < count; ++lane) field[first + lane] = from[lane];
  }
  /// Of a number in single precision.
  Wide load(const float* field) const {
    if constexpr (Full)
      return std::experimental::static_simd_cast<Wide>(
          std::bit_cast<Float>(*reinterpret_cast<const FloatRow*>(field + first)));
    return Wide([&](auto lane) { return static_cast<double>(field[(*this)(lane)]); });
  }
  Wide load(const std::vector<double>& field) const { return load(field.data()); }
  void store(const Wide& from, std::vector<double>& field) const { store(from, field.data()); }
  /// The same, and nothing of the repeated: for sums over points.
  Wide load_once(const std::vector<double>& field) const {
    if constexpr (Full) return load(field);
    return Wide([&](auto lane) { return lane < count ? field[first + lane] : 0.0; });
  }
};

/// As many points as a Wide holds, wherever they are.
struct Scattered {
  std::array<std::size_t, Wide::size()> points;

  std::size_t operator()(std::size_t lane) const { return points[lane]; }
  Scattered beyond(std::size_t origin) const {
    Scattered out;
    for (std::size_t lane = 0; lane < points.size(); ++lane)
      out.points[lane] = origin + points[lane];
    return out;
  }
  Wide load(const double* field) const {
    return Wide([&](auto lane) { return field[points[lane]]; });
  }
  void store(const Wide& from, double* field) const {
    for (std::size_t lane = 0; lane < points.size(); ++lane) field[points[lane]] = from[lane];
  }
};

/// f(blocks) over points begin ... end - 1; blocks together hold as many points as a Real.
template <class Real, class F>
void for_each_blocks(std::size_t begin, std::size_t end, F&& f) {
  constexpr std::size_t four = Wide::size(), all = Real::size();
  for (; begin + all <= end; begin += all) {
    if constexpr (all == four)
      f(std::array{Consecutive<true>{begin, four}});
    else
      f(std::array{Consecutive<true>{begin, four}, Consecutive<true>{begin + four, four}});
  }
  if (begin == end) return;
  const std::size_t rest = end - begin, low = std::min(rest, four);
  if constexpr (all == four)
    f(std::array{Consecutive<false>{begin, low}});
  else if (rest > four)
    f(std::array{Consecutive<false>{begin, low}, Consecutive<false>{begin + four, rest - four}});
  else
    f(std::array{Consecutive<false>{begin, low}, Consecutive<false>{begin, 0}});
}
/// f(block) over points begin ... end - 1.
template <class F>
void for_each_block(std::size_t begin, std::size_t end, F&& f) {
  for_each_blocks<Wide>(begin, end, [&](const auto& blocks) { f(blocks[0]); });
}

/// Of columns.
struct Range {
  std::size_t begin = 0, end = 0;
  constexpr bool holds(std::size_t c) const { return c >= begin && c < end; }
};

template <class T>
concept EigenMatrix = std::is_base_of_v<Eigen::MatrixBase<T>, T>;

/// A struct of Reals, a vector or a matrix of every point, by columns.
template <template <class> class Struct, class Number = double>
class Columns {
 public:
  static constexpr std::size_t width = sizeof(Struct<Wide>) / sizeof(Wide);
  static_assert(sizeof(Struct<double>) - width * sizeof(double) < 16,
                "doubles, and padding at the end");

  explicit Columns(std::size_t points = 0) { resize(points); }

  void resize(std::size_t points, Number value = 0) {
    size_ = points;
    // an odd number of cache lines beyond whole pages: the columns of a point share no set of the
    // cache
    stride_ = (points + 511) / 512 * 512 + 40;
    numbers_.assign(width * stride_, value);
  }
  std::size_t size() const { return size_; }

  /// But for the columns `without.begin` ... `without.end` - 1, which are zero.
  template <class At>
  Struct<Wide> load(const At& at, const Range& without = {}) const {
    Struct<Wide> out;
    auto* const to = reinterpret_cast<Wide*>(&out);
    each([&](std::size_t c) { to[c] = without.holds(c) ? Wide(0.0) : at.load(column(c)); });
    return out;
  }
  template <class At>
  void store(const Struct<Wide>& from, const At& at, const Range& without = {}) {
    const auto* const in = reinterpret_cast<const Wide*>(&from);
    each([&](std::size_t c) {
      if (!without.holds(c)) at.store(in[c], column(c));
    });
  }

  /// As many points as a Real of this precision holds, by its blocks.
  template <class Real, class Blocks>
  Struct<Real> load_blocks(const Blocks& blocks) const {
    if constexpr (std::is_same_v<Real, Wide>) {
      return load(blocks[0]);
    } else {
      Struct<Real> out;
      auto* const to = reinterpret_cast<Real*>(&out);
      each([&](std::size_t c) {
        const Number* const from = column(c);
        if (full(blocks))
          to[c] = wide(*reinterpret_cast<const WideFloatRow*>(from + blocks[0].first));
        else
          to[c] = Real(
              [&](auto lane) { return from[blocks[lane / Wide::size()](lane % Wide::size())]; });
      });
      return out;
    }
  }
  template <class Real, class Blocks>
  void store_blocks(const Struct<Real>& from, const Blocks& blocks) {
    if constexpr (std::is_same_v<Real, Wide>) {
      store(from, blocks[0]);
    } else {
      const auto* const in = reinterpret_cast<const Real*>(&from);
      each([&](std::size_t c) {
        Number* const to = column(c);
        if (full(blocks))
          *reinterpret_cast<WideFloatRow*>(to + blocks[0].first) = lanes(in[c]);
        else
          for (std::size_t lane = 0; lane < Real::size(); ++lane)
            if (lane % Wide::size() < blocks[lane / Wide::size()].count)
              to[blocks[lane / Wide::size()](lane % Wide::size())] = in[c][lane];
      });
    }
  }

  /// One point's: a copy of a struct, a view of a vector or matrix.
  auto operator[](std::size_t p) const {
    if constexpr (EigenMatrix<Struct<Number>>) {
      return Eigen::Map<const Struct<Number>, 0, Stride>(column(0) + p, stride());
    } else {
      Struct<Number> out;
      auto* const to = reinterpret_cast<Number*>(&out);
      each([&](std::size_t c) { to[c] = column(c)[p]; });
      return out;
    }
  }
  auto operator[](std::size_t p) requires EigenMatrix<Struct<Number>> {
    return Eigen::Map<Struct<Number>, 0, Stride>(column(0) + p, stride());
  }
  void set(std::size_t p, const Struct<Number>& from) {
    const auto* const in = reinterpret_cast<const Number*>(&from);
    each([&](std::size_t c) { column(c)[p] = in[c]; });
  }

  template <class Other>
  void assign(const Columns<Struct, Other>& from) {
    resize(from.size());
    each([&](std::size_t c) { std::copy_n(from.column(c), size_, column(c)); });
  }

  /// point[i] <- point[order[i]]
  template <class Order>
  void reorder(const Order& order) {
    std::vector<Number> sorted(order.size());
    each([&](std::size_t c) {
      for (std::size_t i = 0; i < order.size(); ++i) sorted[i] = column(c)[order[i]];
      std::copy(sorted.begin(), sorted.end(), column(c));
    });
  }

 private:
  template <template <class> class, class>
  friend class Columns;
  /// Two blocks are one after the other unless points are left over.
  template <class Blocks>
  static bool full(const Blocks& blocks) {
    return blocks[0].count + blocks[1].count == 2 * Wide::size();
  }
  using Stride = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;

  template <class F>
  static void each(F&& f) {
    [&]<std::size_t... c>(std::index_sequence<c...>) { (f(c), ...); }
    (std::make_index_sequence<width>());
  }
  Number* column(std::size_t c) { return numbers_.data() + c * stride_; }
  const Number* column(std::size_t c) const { return numbers_.data() + c * stride_; }
  Stride stride() const {
    const auto inner = static_cast<Eigen::Index>(stride_);
    return {inner * Struct<Number>::RowsAtCompileTime, inner};
  }

  std::size_t size_ = 0, stride_ = 0;
  std::vector<Number, Eigen::aligned_allocator<Number>> numbers_;
};

/// What points exchange with nodes, in the precision in which they do: double, until it is
/// narrowed.
template <template <class> class Struct>
class ExchangedColumns {
 public:
  explicit ExchangedColumns(std::size_t points = 0, bool narrow = false) : narrow_(narrow) {
    resize(points);
  }

  void resize(std::size_t points) { narrow_ ? single_.resize(points) : double_.resize(points); }
  /// In single precision from now on.
  void narrow() {
    single_.assign(double_);
    double_.resize(0);
    narrow_ = true;
  }

  template <class At>
  Struct<Wide> load(const At& at) const {
    return narrow_ ? single_.load(at) : double_.load(at);
  }
  template <class Real, class Blocks>
  Struct<Real> load_blocks(const Blocks& blocks) const {
    return of<Real>().template load_blocks<Real>(blocks);
  }
  template <class Real, class Blocks>
  void store_blocks(const std::type_identity_t<Struct<Real>>& from, const Blocks& blocks) {
    of<Real>().template store_blocks<Real>(from, blocks);
  }

  /// One point's, as long as it is double.
  auto operator[](std::size_t p) const { return double_[p]; }
  auto operator[](std::size_t p) { return double_[p]; }

  template <class Order>
  void reorder(const Order& order) {
    narrow_ ? single_.reorder(order) : double_.reorder(order);
  }

 private:
  template <class Real>
  auto& of() {
    if constexpr (std::is_same_v<Real, WideFloat>)
      return single_;
    else
      return double_;
  }
  template <class Real>
  const auto& of() const {
    return const_cast<ExchangedColumns*>(this)->of<Real>();
  }

  Columns<Struct> double_;
  Columns<Struct, float> single_;
  bool narrow_;
};

}  // namespace grainpair
