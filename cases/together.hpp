// What no single key of a file can tell, but several together.
#pragma once

#include "cases/values.hpp"

namespace grainpair {

/// Walls that contradict one another, sizes that cannot be meant. Throws CaseError.
void check_scene(const Values& scene);

/// Whether a scene's layer flows down a plane, in place of a column that collapses.
bool is_chute(const Values& scene);
/// Whether a scene's column stands in a silo above the floor and leaves by its orifice.
bool is_silo(const Values& scene);

/// Legs of a material point's path that lead nowhere. Throws CaseError.
void check_point(const Values& path);

}  // namespace grainpair
