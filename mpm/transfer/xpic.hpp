#pragma once

#include "mpm/transfer/affine.hpp"

namespace grainpair {

/// PIC from grid velocities sharpened by the truncated series v + (I - S+ S) v + ... of `order`
/// terms, in which S takes the grid to the points and S+ the points to the grid: XPIC(m)/FMPM(k)
/// [Hammerquist2017, Nairn2021]. Order 1 is PIC; each further term lets shorter waves through
/// undamped. The series itself is in step().
struct Xpic {
  static constexpr Affine affine = Affine::none;
  template <class Vec>
  static Vec velocity(const Vec& /*v_p*/, const Vec& grid_velocity, const Vec& /*increment*/,
                      double /*filter*/) {
    return grid_velocity;
  }
};

}  // namespace grainpair
