// The part of the grains' kinetic energy that is not coarse motion.
#pragma once

#include "dem_reference/ledger/moment.hpp"

namespace grainpair::ledger {

/// 1/2 sum m |v - (a + B (x, y))|^2 about the least-squares affine velocity of each cell, weighted
/// by mass [J], of moving grains; `diameter` [m] and `mass` [kg] are those of all, or of a nominal
/// grain where Atoms tells each its radius.
///
/// Cells are squares of 3 d in x and y; where `radial`, in the distance from the y axis and y, with
/// velocities along r, y and theta. A fit of three constants per component leaves n - 3 of n
/// degrees of freedom, so each cell's sum is scaled by n / (n - 3). Grains of cells with fewer than
/// eight are left out: a lone grain has no coarse motion to differ from.
///
/// Ranks: a cell's fit asks for all of its grains, so this alone is for one rank that has them all.
double fluctuation_energy(const Atoms& atoms, double diameter, double mass, bool radial);

}  // namespace grainpair::ledger
