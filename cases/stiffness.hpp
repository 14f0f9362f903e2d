// The stiffness that a scene needs: that of continuum and grains is lowered until the column's own
// weight strains its base by a stated amount, and by no more.
//
// The measure is rho g H/K, weight over bulk modulus at the base [-], where rho = rho_s/(1+e0).
// Bulk modulus of a packing of spheres: K = c E_p^(2/3) p^(1/3) [Hertz; c measured in the element
// test `isotropic`]. So a factor s of it is s^(3/2) of the grains' E_p. Of the continuum the
// skeleton is softened, and the critical-state locus a_L E_p with it; the E_p of its collisions
// stays, whose granular temperature would else be another.
#pragma once

#include "cases/values.hpp"

namespace grainpair {

/// What was made of one engine's stiffness.
struct Stiffness {
  double factor = 1.0;  // of the bulk modulus, 1: that of card and case; of grains, by whoever
  double weight = 0.0;  // rho g H/K reached
  double error = 0.0;   // largest relative error of a headline figure to be expected of `factor`
};

struct Stiffnesses {
  Stiffness continuum, grains;
};

/// Softens the law's elastic constants where mpm.stiffness is `needed`: material.young_modulus of
/// laws linear in strain; of the others bulk_stiffness, shear_stiffness and, of those that have a
/// critical-state locus, critical_state_slope. Nothing is made stiffer, and nothing changes where
/// mpm.young_modulus is given.
Stiffness soften_continuum(Values& scene);

/// The same of dem.young_modulus, where dem.stiffness is `needed` and it is not given.
Stiffness soften_grains(Values& scene);

}  // namespace grainpair
