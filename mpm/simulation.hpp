// From a case to a simulation ready to step: points, grid, walls, law, initial stress.
#pragma once

#include <memory>

#include "mpm/case.hpp"
#include "mpm/solver.hpp"

namespace grainpair {

/// Builds the column of a case. `seed` matters only where mpm.jitter > 0. Throws CaseError.
std::unique_ptr<Simulation> make_simulation(const Case& scene, unsigned seed);

/// sqrt(H/g) [s], the unit of the case's times.
double time_scale(const Case& scene);

}  // namespace grainpair
