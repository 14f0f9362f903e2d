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

/// All that a function calls becomes part of it. Not under sanitizers: their checks would multiply.
#ifdef __SANITIZE_ADDRESS__
#define GRAINPAIR_FLATTEN
#else
#define GRAINPAIR_FLATTEN [[gnu::flatten]]
#endif

namespace grainpair {

/// Four, whatever the machine: nodes' numbers come by fours, too.
using Wide = std::experimental::simd<double, std::experimental::simd_abi::deduce_t<double, 4>>;

/// Eight points in single precision, as many as fill the same registers: the points of two Wides.
using WideFloat =
    std::experimental::simd<float, std::experimental::simd_abi::deduce_t<float, 2 * Wide::size()>>;
using Float = std::experimental::simd<
    float, std::experimental::simd_abi::deduce_t<float, Wide::size()>>;  // half of it
/// The Wides that hold a Real's points in double precision.
template <class Real>
using Halves = std::array<Wide, std::is_same_v<Real, WideFloat> ? 2 : 1>;

/// The same number for every point, rounded to the precision they have.
template <class Real>
Real constant(double x) {
  if constexpr (std::is_same_v<Real, WideFloat>)
    return static_cast<float>(x);
  else
    return x;
}

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
inline WideFloat select(const Mask<WideFloat>& m, const WideFloat& yes, WideFloat no) {
  std::experimental::where(m, no) = yes;
  return no;
}

/// The larger and the smaller, lane by lane; the first where the second is no number.
inline double larger(double a, double b) { return a < b ? b : a; }
inline double smaller(double a, double b) { return b < a ? b : a; }
inline Wide larger(const Wide& a, const Wide& b) { return select(a < b, b, a); }
inline Wide smaller(const Wide& a, const Wide& b) { return select(b < a, b, a); }
inline WideFloat larger(const WideFloat& a, const WideFloat& b) { return select(a < b, b, a); }
inline WideFloat smaller(const WideFloat& a, const WideFloat& b) { return select(b < a, b, a); }

inline double clamped(double x, double low, double high) { return smaller(larger(x, low), high); }
inline Wide clamped(const Wide& x, const Wide& low, const Wide& high) {
  return smaller(larger(x, low), high);
}

/// A scalar function of each lane, for what is rare.
template <class F>
double each_lane(F&& f, double x) {
  return f(x);
}
template <class F>
Wide each_lane(F&& f, const Wide& x) {
  return Wide([&](auto lane) { return f(static_cast<double>(x[lane])); });
}

/// The C library's own of four numbers (libmvec), to 4 units in the last place.
using FourDoubles [[gnu::vector_size(32)]] = double;
FourDoubles four_powers(FourDoubles, FourDoubles) asm("_ZGVdN4vv_pow");
FourDoubles four_cube_roots(FourDoubles) asm("_ZGVdN4v_cbrt");

/// x^y for x > 0.
inline double power(double x, double y) { return std::pow(x, y); }
inline Wide power(const Wide& x, double y) {
  return std::bit_cast<Wide>(four_powers(std::bit_cast<FourDoubles>(x), FourDoubles{y, y, y, y}));
}

/// x^(1/3)
inline double cube_root(double x) { return std::cbrt(x); }
inline Wide cube_root(const Wide& x) {
  return std::bit_cast<Wide>(four_cube_roots(std::bit_cast<FourDoubles>(x)));
}

using std::abs, std::sqrt, std::trunc;  // beside those of Wide, which are found by their argument

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

}  // namespace grainpair

namespace grainpair {

template <class Several>
struct NumTraitsOf : Eigen::GenericNumTraits<Several> {
  using Real = Several;
  using NonInteger = Several;
  using Nested = Several;
  using Literal = typename Several::value_type;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 0,
    ReadCost = 1,
    AddCost = 1,
    MulCost = 1
  };
};

}  // namespace grainpair

template <>
struct Eigen::NumTraits<grainpair::Wide> : grainpair::NumTraitsOf<grainpair::Wide> {};
template <>
struct Eigen::NumTraits<grainpair::WideFloat> : grainpair::NumTraitsOf<grainpair::WideFloat> {};
template <class Op>
struct Eigen::ScalarBinaryOpTraits<double, grainpair::Wide, Op> {
  using ReturnType = grainpair::Wide;
};
