// The column of a case: points, walls and law, in a solver of the case's dimension and functions.
#pragma once

#include <memory>

#include "mpm/step/cost.hpp"
#include "mpm/step/simulation.hpp"

namespace grainpair {

/// Throws CaseError where the case's grid or packing does not fit.
template <int dim>
std::unique_ptr<Simulation> make_column(const Case& scene, const Numerics& numerics,
                                        const Start& start, const Ranks& ranks);

/// Points, nodes, memory and first step; of steps and seconds nothing (cost.hpp).
template <int dim>
Cost cost_of_column(const Case& scene, const Numerics& numerics);

}  // namespace grainpair
