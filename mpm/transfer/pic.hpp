#pragma once

#include "mpm/transfer/scheme.hpp"

namespace grainpair {

/// Particle in cell: a point takes the grid's velocity. Stable, and loses all that the grid cannot
/// carry.
struct Pic {
  static constexpr Affine affine = Affine::none;
  template <class Vec>
  static Vec velocity(const Vec& /*v_p*/, const Vec& grid_velocity, const Vec& /*increment*/,
                      double /*filter*/) {
    return grid_velocity;
  }
};

}  // namespace grainpair
