// What "dimension" means: how many axes the grid has, and what the missing ones do.
#pragma once

#include "mpm/tensor.hpp"

namespace grainpair {

/// One slice, no motion across it; stress is 3x3 all the same.
struct PlaneStrain {
  static constexpr int dimension = 2;
  static constexpr bool axisymmetric = false;
};

/// x is the radius; the hoop strain rate is v_r/r [1/s] and its stress pulls on the radial momentum.
struct Axisymmetric {
  static constexpr int dimension = 2;
  static constexpr bool axisymmetric = true;
};

struct ThreeDimensional {
  static constexpr int dimension = 3;
  static constexpr bool axisymmetric = false;
};

}  // namespace grainpair
