// What laws take of the grains.
#pragma once

#include "cases/case.hpp"

namespace grainpair {

/// E_p of the grains that the continuum stands for: the case's own, or softer [Pa].
inline double young_modulus_of_grains(const Case& c) {
  const double softened = c.number("mpm.young_modulus");
  return softened > 0.0 ? softened : c.number("grains.young_modulus");
}

}  // namespace grainpair
