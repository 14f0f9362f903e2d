// What a body keeps of points whose law is in a library, and how it reads their stress.
#pragma once

#include "mpm/numbers/arrays.hpp"

namespace grainpair {

/// What is kept of every point, a column each; the law's state variables follow.
struct Kept {
  enum : std::size_t {
    stress = 0,    // six: as the law has it, compression positive [Pa]
    total = 6,     // six: strain since the start, turned [-]
    modulus = 12,  // largest P-wave modulus the law told: what the time step rests on [Pa]
    bulk,          // modulus of what it told last [Pa]
    opening,       // volumetric strain since the point opened, negative; 0: it is closed [-]
    stored,        // elastic energy [J/kg]
    counted,       // two: energies as the law counts them [J/m3]
    clock = 18,    // [s]
    steps,
    id,
    states
  };
};

/// Between Mandel's components and the tensor's, which stand in six arrays.
template <class At>
WideTensor load_tensor(auto&& array, const At& at) {
  WideTensor out;
  for (int c = 0; c < 6; ++c) {
    const Wide own = at.load(array(static_cast<std::size_t>(c)));
    out[c] = c < 3 ? own : std::numbers::sqrt2 * own;
  }
  return out;
}
template <class At>
void store_tensor(const WideTensor& t, auto&& array, const At& at) {
  for (int c = 0; c < 6; ++c)
    at.store(c < 3 ? t[c] : (1.0 / std::numbers::sqrt2) * t[c], array(static_cast<std::size_t>(c)));
}

/// Elastic energy of a stress, where the law does not tell it: of moduli as it told them first.
struct Elastic {
  double bulk = 1.0, shear = 1.0;  // [Pa]
  /// [J/m3]
  Wide energy(const WideTensor& sigma) const {
    const Wide p = trace(sigma) * (1.0 / 3);
    return (0.5 / bulk) * p * p + (0.25 / shear) * deviator(sigma).squaredNorm();
  }
};

}  // namespace grainpair
