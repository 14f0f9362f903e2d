// The same program by several processes.
#pragma once

namespace grainpair {

/// Becomes `ranks` processes of mpm_run_ranks, under mpirun, with this command line. Throws
/// CaseError where there is no such program.
int start_ranks(int argc, char** argv, int ranks);

}  // namespace grainpair
