// Whether the stiffness that a law tells is the slope of its stress.
#pragma once

#include <optional>

#include "cases/case.hpp"

namespace grainpair {

/// Largest difference of DDSDDE from central differences of the stress, over its largest number,
/// along a path that yields; nothing of a law that tells no tangent. Throws SolverError where the
/// law cannot go on.
std::optional<double> tangent_error(const Case& material);

}  // namespace grainpair
