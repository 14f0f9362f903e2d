// mpm_run_ranks: as mpm_run, by all processes that mpirun has started.
#include <cstdlib>

#include "mpm/programs/run.hpp"
#include "mpm/ranks/mpi_ranks.hpp"

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  int code = 0;
  {
    // for measurements: columns of cells stay with the rank that has them at the start
    const bool balance = std::getenv("GRAINPAIR_KEEP_CUTS") == nullptr;
    code = grainpair::run_program(argc, argv, grainpair::MpiRanks(balance));
  }
  MPI_Finalize();
  return code;
}
