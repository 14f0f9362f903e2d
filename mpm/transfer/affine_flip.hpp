#pragma once

#include "mpm/transfer/flip.hpp"

namespace grainpair {

/// FLIP's increment for the velocity, APIC's affine moment for its gradient [Fei2021].
struct AffineFlip : Flip {
  static constexpr bool affine = true;
};

}  // namespace grainpair
