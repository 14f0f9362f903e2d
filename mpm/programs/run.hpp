// One run of the continuum, by one process or by ranks of several.
#pragma once

#include "mpm/step/ranks.hpp"

namespace grainpair {

/// What mpm_run does with its command line; its exit code. Rank 0 says what there is to say.
int run_program(int argc, char** argv, const Ranks& ranks);

}  // namespace grainpair
