// A law driven by itself.
#pragma once

#include <string>
#include <vector>

namespace grainpair {

/// Keys of a case for a law that no column weighs on and no grid has to step.
inline const std::vector<std::string> law_alone{"mpm.stiffness=as given",
                                                "mpm.viscous_stiffness=0"};

}  // namespace grainpair
