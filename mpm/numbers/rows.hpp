// Numbers of several points in vector registers, and the same numbers point by point, in rows: from
// one to the other, from double to single precision, and sums over points that share a row.
#pragma once

#include <array>
#include <bit>

#include "mpm/numbers/wide.hpp"

namespace grainpair {

/// A struct of one number.
template <class Real>
using Scalar = Real;

/// Doubles in a row, as doubles: a store through the library's own may change any object for all
/// the compiler knows, and sends it back to memory for every pointer it holds.
template <class Number, int count>
using LanesOf [[gnu::vector_size(sizeof(Number) * count)]] = Number;
using Row [[gnu::vector_size(32), gnu::aligned(8)]] = double;
using FloatRow [[gnu::vector_size(16), gnu::aligned(4)]] = float;
using WideFloatRow [[gnu::vector_size(32), gnu::aligned(4)]] = float;
inline LanesOf<double, 4> lanes(const Wide& from) {
  return std::bit_cast<LanesOf<double, 4>>(from);
}
inline LanesOf<float, 8> lanes(const WideFloat& from) {
  return std::bit_cast<LanesOf<float, 8>>(from);
}
inline Wide wide(LanesOf<double, 4> from) { return std::bit_cast<Wide>(from); }
inline WideFloat wide(LanesOf<float, 8> from) { return std::bit_cast<WideFloat>(from); }
inline Wide load_row(const double* from) { return wide(*reinterpret_cast<const Row*>(from)); }
inline void store_row(const Wide& from, double* to) { *reinterpret_cast<Row*>(to) = lanes(from); }

/// The lanes of both, in this order. (By pairs: the compiler makes one instruction of that.)
inline WideFloat joined(LanesOf<float, 4> low, LanesOf<float, 4> high) {
  const auto l = std::bit_cast<LanesOf<double, 2>>(low),
             h = std::bit_cast<LanesOf<double, 2>>(high);
  return std::bit_cast<WideFloat>(LanesOf<double, 4>{l[0], l[1], h[0], h[1]});
}

/// To single precision and back.
inline Wide merge(const std::array<Wide, 1>& from) { return from[0]; }
inline WideFloat merge(const std::array<Wide, 2>& from) {
  const auto half = [&](std::size_t h) {
    return std::bit_cast<LanesOf<float, 4>>(std::experimental::static_simd_cast<Float>(from[h]));
  };
  return joined(half(0), half(1));
}
inline std::array<Wide, 1> split(const Wide& from) { return {from}; }
inline std::array<Wide, 2> split(const WideFloat& from) {
  const auto all = lanes(from);
  const auto half = [](LanesOf<float, 4> x) {
    return std::experimental::static_simd_cast<Wide>(std::bit_cast<Float>(x));
  };
  return {half(__builtin_shufflevector(all, all, 0, 1, 2, 3)),
          half(__builtin_shufflevector(all, all, 4, 5, 6, 7))};
}

/// Rows to columns, and back; four lanes by themselves, as they are from a Wide.
inline void transpose(Wide& a, Wide& b, Wide& c, Wide& d) {
  const auto ab_even = __builtin_shufflevector(lanes(a), lanes(b), 0, 4, 2, 6),
             ab_odd = __builtin_shufflevector(lanes(a), lanes(b), 1, 5, 3, 7);
  const auto cd_even = __builtin_shufflevector(lanes(c), lanes(d), 0, 4, 2, 6),
             cd_odd = __builtin_shufflevector(lanes(c), lanes(d), 1, 5, 3, 7);
  a = wide(__builtin_shufflevector(ab_even, cd_even, 0, 1, 4, 5));
  b = wide(__builtin_shufflevector(ab_odd, cd_odd, 0, 1, 4, 5));
  c = wide(__builtin_shufflevector(ab_even, cd_even, 2, 3, 6, 7));
  d = wide(__builtin_shufflevector(ab_odd, cd_odd, 2, 3, 6, 7));
}
inline void transpose(WideFloat& a, WideFloat& b, WideFloat& c, WideFloat& d) {
  const auto low = [](const auto& x, const auto& y) {
    return __builtin_shufflevector(lanes(x), lanes(y), 0, 8, 1, 9, 4, 12, 5, 13);
  };
  const auto high = [](const auto& x, const auto& y) {
    return __builtin_shufflevector(lanes(x), lanes(y), 2, 10, 3, 11, 6, 14, 7, 15);
  };
  const auto ab_low = low(a, b), ab_high = high(a, b), cd_low = low(c, d), cd_high = high(c, d);
  a = wide(__builtin_shufflevector(ab_low, cd_low, 0, 1, 8, 9, 4, 5, 12, 13));
  b = wide(__builtin_shufflevector(ab_low, cd_low, 2, 3, 10, 11, 6, 7, 14, 15));
  c = wide(__builtin_shufflevector(ab_high, cd_high, 0, 1, 8, 9, 4, 5, 12, 13));
  d = wide(__builtin_shufflevector(ab_high, cd_high, 2, 3, 10, 11, 6, 7, 14, 15));
}

/// Of every four lanes the i-th.
template <int i>
Wide spread(const Wide& x) {
  return wide(__builtin_shufflevector(lanes(x), lanes(x), i, i, i, i));
}
template <int i>
WideFloat spread(const WideFloat& x) {
  return wide(__builtin_shufflevector(lanes(x), lanes(x), i, i, i, i, i + 4, i + 4, i + 4, i + 4));
}

/// The sum over the lanes of each, by fours.
inline Wide sums(const Wide& a, const Wide& b, const Wide& c, const Wide& d) {
  const auto pairs = [](const auto& x, const auto& y) {
    return __builtin_shufflevector(lanes(x), lanes(y), 0, 4, 2, 6) +
           __builtin_shufflevector(lanes(x), lanes(y), 1, 5, 3, 7);
  };
  const auto ab = pairs(a, b), cd = pairs(c, d);
  return wide(__builtin_shufflevector(ab, cd, 0, 1, 4, 5) +
              __builtin_shufflevector(ab, cd, 2, 3, 6, 7));
}
inline WideFloat sums(const WideFloat& a, const WideFloat& b, const WideFloat& c,
                      const WideFloat& d) {
  const auto pairs = [](auto x, auto y) {
    return __builtin_shufflevector(x, y, 0, 2, 8, 10, 4, 6, 12, 14) +
           __builtin_shufflevector(x, y, 1, 3, 9, 11, 5, 7, 13, 15);
  };
  return wide(pairs(pairs(lanes(a), lanes(b)), pairs(lanes(c), lanes(d))));
}

/// Whether all points have the same.
inline bool alike(const Wide& x) { return all(x == Wide(x[0])); }
inline bool alike(const Index<Wide>& i) {
  return std::ranges::all_of(i, [&](int one) { return one == i[0]; });
}

/// f(first column, std::true_type) for groups of four of a struct's numbers, the last of which may
/// overlap the one before, or f(column, std::false_type) for each; unrolled, so that a Wide is
/// never put together in memory.
template <template <class> class Struct, class F>
void each_column(F&& f) {
  // NOLINTNEXTLINE(bugprone-sizeof-expression): a struct of Wides, counted
  constexpr std::size_t columns = sizeof(Struct<Wide>) / sizeof(Wide);
  static_assert(sizeof(Struct<double>) - columns * sizeof(double) < 16,
                "doubles, and padding at the end");
  if constexpr (columns >= 4) [&]<std::size_t... group>(std::index_sequence<group...>) {
      (f(std::min(4 * group, columns - 4), std::true_type()), ...);
    }
  (std::make_index_sequence<(columns + 3) / 4>());
  else[&]<std::size_t... c>(std::index_sequence<c...>) {
    (f(c, std::false_type()), ...);
  }
  (std::make_index_sequence<columns>());
}

/// The structs of several points as one of Wides; row(lane) is where a point's lies. Structs hold
/// Reals alone.
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
  return load_rows<Struct>(
      [&](std::size_t lane) { return reinterpret_cast<const double*>(from + at(lane)); });
}

template <template <class> class Struct>
Struct<double> look_up(const Struct<double>* table, int i) {
  return table[i];
}
template <template <class> class Struct>
Struct<Wide> look_up(const Struct<double>* table, const Index<Wide>& i) {
  return load<Struct>(table, [&](std::size_t lane) { return i[lane]; });
}

/// Four numbers of a row for each half.
template <class Real, class Row>
Real load_row_halves(const Row& row) {
  if constexpr (std::is_same_v<Real, Wide>) {
    return load_row(row(0));
  } else {
    return joined(*reinterpret_cast<const FloatRow*>(row(0)),
                  *reinterpret_cast<const FloatRow*>(row(1)));
  }
}

/// Structs of several points as one, of whole fours of numbers in the precision of Real: row(point)
/// is where a point's lie.
template <class Struct, class Real, class Row>
Struct load_fours(const Row& row) {
  Struct result;
  auto* const out = reinterpret_cast<Real*>(&result);
  for (std::size_t c = 0; c < sizeof(Struct) / sizeof(Real); c += 4) {
    const auto part = [&](std::size_t lane) {
      return load_row_halves<Real>([&](std::size_t h) { return row(Wide::size() * h + lane) + c; });
    };
    Real w0 = part(0), w1 = part(1), w2 = part(2), w3 = part(3);
    transpose(w0, w1, w2, w3);
    out[c] = w0, out[c + 1] = w1, out[c + 2] = w2, out[c + 3] = w3;
  }
  return result;
}
/// The same where the points of each half have one row, row(half).
template <class Struct, class Real, class Row>
Struct load_shared(const Row& row) {
  Struct result;
  auto* const out = reinterpret_cast<Real*>(&result);
  for (std::size_t c = 0; c < sizeof(Struct) / sizeof(Real); c += 4) {
    const Real four = load_row_halves<Real>([&](std::size_t h) { return row(h) + c; });
    out[c] = spread<0>(four), out[c + 1] = spread<1>(four), out[c + 2] = spread<2>(four),
    out[c + 3] = spread<3>(four);
  }
  return result;
}

/// Adds each point's struct, of whole fours of numbers, to the doubles at row(point), one point
/// after the other: points may share a row.
template <template <class> class Struct, class Real, class Row>
void add_rows(const Struct<Real>& from, const Row& row) {
  const auto* const in = reinterpret_cast<const Real*>(&from);
  constexpr std::size_t columns = sizeof(Struct<Real>) / sizeof(Real);
  static_assert(columns % 4 == 0);
#pragma GCC unroll 2
  for (std::size_t c = 0; c < columns; c += 4) {
    Real w[4] = {in[c], in[c + 1], in[c + 2], in[c + 3]};
    transpose(w[0], w[1], w[2], w[3]);
    for (std::size_t lane = 0; lane < Wide::size(); ++lane) {
      const auto halves = split(w[lane]);
      for (std::size_t h = 0; h < halves.size(); ++h) {
        double* const to = row(Wide::size() * h + lane) + c;
        store_row(load_row(to) + halves[h], to);
      }
    }
  }
}

/// The same where the points of each half share a row, row(half): adds the sums over them.
template <template <class> class Struct, class Real, class Row>
void add_sums(const Struct<Real>& from, const Row& row) {
  const auto* const in = reinterpret_cast<const Real*>(&from);
  constexpr std::size_t columns = sizeof(Struct<Real>) / sizeof(Real);
  static_assert(columns % 4 == 0);
#pragma GCC unroll 2
  for (std::size_t c = 0; c < columns; c += 4) {
    const auto halves = split(sums(in[c], in[c + 1], in[c + 2], in[c + 3]));
    for (std::size_t h = 0; h < halves.size(); ++h) {
      double* const to = row(h) + c;
      store_row(load_row(to) + halves[h], to);
    }
  }
}

/// Structs of two Wides as one in the precision of Real, and back.
template <template <class> class Struct, class Real>
Struct<Real> merge(const std::array<Struct<Wide>, Halves<Real>().size()>& from) {
  Struct<Real> result;
  auto* const out = reinterpret_cast<Real*>(&result);
  [&]<std::size_t... c>(std::index_sequence<c...>) {
    const auto column = [&](std::size_t i) {
      Halves<Real> halves;
      for (std::size_t h = 0; h < halves.size(); ++h)
        halves[h] = reinterpret_cast<const Wide*>(&from[h])[i];
      return merge(halves);
    };
    ((out[c] = column(c)), ...);
  }
  (std::make_index_sequence<sizeof(Struct<Real>) / sizeof(Real)>());
  return result;
}
template <template <class> class Struct, class Real>
std::array<Struct<Wide>, Halves<Real>().size()> split(const Struct<Real>& from) {
  std::array<Struct<Wide>, Halves<Real>().size()> result;
  const auto* const in = reinterpret_cast<const Real*>(&from);
  [&]<std::size_t... c>(std::index_sequence<c...>) {
    const auto column = [&](std::size_t i) {
      const auto halves = split(in[i]);
      for (std::size_t h = 0; h < halves.size(); ++h)
        reinterpret_cast<Wide*>(&result[h])[i] = halves[h];
    };
    (column(c), ...);
  }
  (std::make_index_sequence<sizeof(Struct<Real>) / sizeof(Real)>());
  return result;
}

/// The same numbers for every point.
template <template <class> class Struct>
Struct<Wide> broadcast(const double* from) {
  Struct<Wide> result;
  auto* const out = reinterpret_cast<Wide*>(&result);
  [&]<std::size_t... c>(std::index_sequence<c...>) { ((out[c] = from[c]), ...); }
  (std::make_index_sequence<sizeof(Struct<Wide>) / sizeof(Wide)>());
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
  store_rows<Struct>(from,
                     [&](std::size_t lane) { return reinterpret_cast<double*>(to + at(lane)); });
}

}  // namespace grainpair
