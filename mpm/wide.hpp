// Several points at once: a Wide holds one number of each, a lane a point, in one vector register.
//
// A law is written once over Real, which is double or Wide. Where points differ in what applies to
// them, both sides are computed and select() picks; if (any(...)) skips what no lane needs. No lane
// ever sees its neighbours, so that a point's result does not depend on who is updated beside it.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <experimental/simd>

namespace grainpair {

/// Four, whatever the machine: nodes' numbers come by fours, too.
using Wide = std::experimental::simd<double, std::experimental::simd_abi::deduce_t<double, 4>>;

/// What comparing two Reals gives: bool, or one bool per lane.
template <class Real>
using Mask = decltype(Real() < Real());

inline bool any(bool m) { return m; }
inline bool all(bool m) { return m; }
inline bool any(const Mask<Wide>& m) { return std::experimental::any_of(m); }
inline bool all(const Mask<Wide>& m) { return std::experimental::all_of(m); }

/// m ? yes : no, lane by lane.
inline double select(bool m, double yes, double no) { return m ? yes : no; }
inline Wide select(const Mask<Wide>& m, const Wide& yes, Wide no) {
  std::experimental::where(m, no) = yes;
  return no;
}

/// The larger and the smaller, lane by lane; the first where the second is no number.
inline double larger(double a, double b) { return a < b ? b : a; }
inline double smaller(double a, double b) { return b < a ? b : a; }
inline Wide larger(const Wide& a, const Wide& b) { return select(a < b, b, a); }
inline Wide smaller(const Wide& a, const Wide& b) { return select(b < a, b, a); }

inline double clamped(double x, double low, double high) { return smaller(larger(x, low), high); }
inline Wide clamped(const Wide& x, const Wide& low, const Wide& high) { return smaller(larger(x, low), high); }

/// A scalar function of each lane, for what is rare.
template <class F>
double each_lane(F&& f, double x) {
  return f(x);
}
template <class F>
Wide each_lane(F&& f, const Wide& x) {
  return Wide([&](auto lane) { return f(static_cast<double>(x[lane])); });
}

/// x^y for x > 0.
template <class Real>
Real power(const Real& x, double y) {
  return each_lane([y](double base) { return std::pow(base, y); }, x);
}

using std::abs, std::sqrt, std::trunc;  // beside those of Wide, which are found by their argument

template <class Real>
using Single = Real;

/// Doubles in a row, as doubles: a store through the library's own may change any object for all the compiler knows, and
/// sends it back to memory for every pointer it holds.
using Lanes [[gnu::vector_size(8 * Wide::size())]] = double;
using Row [[gnu::vector_size(8 * Wide::size()), gnu::aligned(8)]] = double;
inline Lanes lanes(const Wide& from) { return std::bit_cast<Lanes>(from); }
inline Wide wide(Lanes from) { return std::bit_cast<Wide>(from); }
inline Wide load_row(const double* from) { return wide(*reinterpret_cast<const Row*>(from)); }
inline void store_row(const Wide& from, double* to) { *reinterpret_cast<Row*>(to) = lanes(from); }

/// Rows to columns, and back.
inline void transpose(Wide& a, Wide& b, Wide& c, Wide& d) {
  const Lanes ab_even = __builtin_shufflevector(lanes(a), lanes(b), 0, 4, 2, 6);
  const Lanes ab_odd = __builtin_shufflevector(lanes(a), lanes(b), 1, 5, 3, 7);
  const Lanes cd_even = __builtin_shufflevector(lanes(c), lanes(d), 0, 4, 2, 6);
  const Lanes cd_odd = __builtin_shufflevector(lanes(c), lanes(d), 1, 5, 3, 7);
  a = wide(__builtin_shufflevector(ab_even, cd_even, 0, 1, 4, 5));
  b = wide(__builtin_shufflevector(ab_odd, cd_odd, 0, 1, 4, 5));
  c = wide(__builtin_shufflevector(ab_even, cd_even, 2, 3, 6, 7));
  d = wide(__builtin_shufflevector(ab_odd, cd_odd, 2, 3, 6, 7));
}

/// The sum over the lanes of each.
inline Wide sums(const Wide& a, const Wide& b, const Wide& c, const Wide& d) {
  const auto pairs = [](const Wide& low, const Wide& high) {
    const Lanes x = lanes(low), y = lanes(high);
    return Lanes(__builtin_shufflevector(x, y, 0, 4, 2, 6) + __builtin_shufflevector(x, y, 1, 5, 3, 7));
  };
  const Lanes ab = pairs(a, b), cd = pairs(c, d);
  return wide(__builtin_shufflevector(ab, cd, 0, 1, 4, 5) + __builtin_shufflevector(ab, cd, 2, 3, 6, 7));
}

/// Whether all points have the same.
inline bool alike(const Wide& x) { return all(x == Wide(x[0])); }

/// Where a point's entry of a table is: an int, or one per lane.
template <class Real>
using Index = std::conditional_t<std::is_same_v<Real, double>, int, std::array<int, Wide::size()>>;

/// The integer below x >= 0, as an index.
inline int index_below(double x) { return static_cast<int>(x); }
inline Index<Wide> index_below(const Wide& x) {
  Index<Wide> out;
  for (std::size_t lane = 0; lane < Wide::size(); ++lane) out[lane] = static_cast<int>(x[lane]);
  return out;
}

/// f(first column, std::true_type) for groups of four of a struct's numbers, the last of which may overlap the one
/// before, or f(column, std::false_type) for each; unrolled, so that a Wide is never put together in memory.
template <template <class> class Struct, class F>
void each_column(F&& f) {
  constexpr std::size_t columns = sizeof(Struct<Wide>) / sizeof(Wide);
  static_assert(sizeof(Struct<double>) - columns * sizeof(double) < 16, "doubles, and padding at the end");
  if constexpr (columns >= 4)
    [&]<std::size_t... group>(std::index_sequence<group...>) {
      (f(std::min(4 * group, columns - 4), std::true_type()), ...);
    }(std::make_index_sequence<(columns + 3) / 4>());
  else
    [&]<std::size_t... c>(std::index_sequence<c...>) { (f(c, std::false_type()), ...); }(std::make_index_sequence<columns>());
}

/// The structs of several points as one of Wides; row(lane) is where a point's lies. Structs hold Reals alone.
template <template <class> class Struct, class Row>
Struct<Wide> load_rows(const Row& row) {
  Struct<Wide> result;
  auto* const out = reinterpret_cast<Wide*>(&result);
  each_column<Struct>([&](std::size_t c, auto four) {
    if constexpr (four) {
      const auto part = [&](std::size_t lane) { return load_row(row(lane) + c); };
      Wide w0 = part(0), w1 = part(1), w2 = part(2), w3 = part(3);
      transpose(w0, w1, w2, w3);
      out[c] = w0, out[c + 1] = w1, out[c + 2] = w2, out[c + 3] = w3;
    } else {
      out[c] = Wide([&](auto lane) { return row(lane)[c]; });
    }
  });
  return result;
}

/// The same from an array of structs, in which from[at(lane)] is a point's.
template <template <class> class Struct, class At>
Struct<Wide> load(const Struct<double>* from, const At& at) {
  return load_rows<Struct>([&](std::size_t lane) { return reinterpret_cast<const double*>(from + at(lane)); });
}

template <template <class> class Struct>
Struct<double> look_up(const Struct<double>* table, int i) {
  return table[i];
}
template <template <class> class Struct>
Struct<Wide> look_up(const Struct<double>* table, const Index<Wide>& i) {
  return load<Struct>(table, [&](std::size_t lane) { return i[lane]; });
}

/// Adds each point's struct to the doubles at row(lane), one point after the other: points may share a row. Rows have room
/// for a whole number of fours.
template <template <class> class Struct, class Row>
void add_rows(const Struct<Wide>& from, const Row& row) {
  constexpr std::size_t columns = sizeof(Struct<Wide>) / sizeof(Wide), rest = columns % 4;
  const auto* const in = reinterpret_cast<const Wide*>(&from);
  const auto one_by_one = [&](std::size_t c) {
    for (std::size_t lane = 0; lane < Wide::size(); ++lane) row(lane)[c] += in[c][lane];
  };
  const auto four = [&](std::size_t c) {
    Wide w[4];
    for (std::size_t i = 0; i < 4; ++i) w[i] = c + i < columns ? in[c + i] : Wide(0.0);
    transpose(w[0], w[1], w[2], w[3]);
    for (std::size_t lane = 0; lane < Wide::size(); ++lane) {
      double* const to = row(lane) + c;
      store_row(load_row(to) + w[lane], to);
    }
  };
  [&]<std::size_t... group>(std::index_sequence<group...>) {
    (four(4 * group), ...);
    if constexpr (rest == 1)
      one_by_one(columns - 1);
    else if constexpr (rest > 1)
      four(columns - rest);
  }(std::make_index_sequence<columns / 4>());
}

/// The same where all rows are one: adds the sum over the points.
template <template <class> class Struct>
void add_sum(const Struct<Wide>& from, double* to) {
  constexpr std::size_t columns = sizeof(Struct<Wide>) / sizeof(Wide), fours = columns / 4;
  const auto* const in = reinterpret_cast<const Wide*>(&from);
  for (std::size_t c = 0; c < 4 * fours; c += 4)
    store_row(load_row(to + c) + sums(in[c], in[c + 1], in[c + 2], in[c + 3]), to + c);
  for (std::size_t c = 4 * fours; c < columns; ++c) to[c] += reduce(in[c]);
}

/// The same numbers for every point.
template <template <class> class Struct>
Struct<Wide> broadcast(const double* from) {
  Struct<Wide> result;
  auto* const out = reinterpret_cast<Wide*>(&result);
  [&]<std::size_t... c>(std::index_sequence<c...>) {
    ((out[c] = from[c]), ...);
  }(std::make_index_sequence<sizeof(Struct<Wide>) / sizeof(Wide)>());
  return result;
}

/// The converse of load_rows.
template <template <class> class Struct, class Row>
void store_rows(const Struct<Wide>& from, const Row& row) {
  const auto* const in = reinterpret_cast<const Wide*>(&from);
  each_column<Struct>([&](std::size_t c, auto four) {
    if constexpr (four) {
      const auto put = [&](std::size_t lane, const Wide& w) { store_row(w, row(lane) + c); };
      Wide w0 = in[c], w1 = in[c + 1], w2 = in[c + 2], w3 = in[c + 3];
      transpose(w0, w1, w2, w3);
      put(0, w0), put(1, w1), put(2, w2), put(3, w3);
    } else {
      for (std::size_t lane = 0; lane < Wide::size(); ++lane) row(lane)[c] = in[c][lane];
    }
  });
}

/// The converse of load.
template <template <class> class Struct, class At>
void store(const Struct<Wide>& from, Struct<double>* to, const At& at) {
  store_rows<Struct>(from, [&](std::size_t lane) { return reinterpret_cast<double*>(to + at(lane)); });
}

}  // namespace grainpair

template <>
struct Eigen::NumTraits<grainpair::Wide> : Eigen::GenericNumTraits<grainpair::Wide> {
  using Real = grainpair::Wide;
  using NonInteger = grainpair::Wide;
  using Nested = grainpair::Wide;
  using Literal = double;
  enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 0, ReadCost = 1, AddCost = 1, MulCost = 1 };
};
template <class Op>
struct Eigen::ScalarBinaryOpTraits<double, grainpair::Wide, Op> {
  using ReturnType = grainpair::Wide;
};
