// From a case to a simulation ready to step: points, grid, walls, law, initial stress.
#pragma once

#include <memory>
#include <optional>

#include "cases/case.hpp"
#include "mpm/points/packing.hpp"
#include "mpm/step/solver.hpp"

namespace grainpair {

/// What a case leaves open about its start: the seed of mpm.jitter, and the packing if
/// initial.state asks for one.
struct Start {
  unsigned seed = 1;
  std::optional<Packing> packing = std::nullopt;
};

/// Builds the column of a case. Throws CaseError.
std::unique_ptr<Simulation> make_simulation(const Case& scene, const Start& start);

/// sqrt(H/g) [s], the unit of the case's times.
double time_scale(const Case& scene);

}  // namespace grainpair
