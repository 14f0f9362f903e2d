#pragma once

#include "mpm/transfer/scheme.hpp"

namespace grainpair {

/// Fluid implicit particle [Brackbill1986]: a point adds the grid's increment to its own velocity,
/// and relaxes to the grid's velocity over a physical time tau: filter = 1 - exp(-dt/tau), so that
/// halving the step does not double the damping.
struct Flip {
  static constexpr Affine affine = Affine::none;
  template <class Vec>
  static Vec velocity(const Vec& v_p, const Vec& grid_velocity, const Vec& increment,
                      double filter) {
    const Vec flip = v_p + increment;
    return flip + filter * (grid_velocity - flip);
  }
};

}  // namespace grainpair
