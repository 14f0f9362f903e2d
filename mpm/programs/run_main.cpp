// mpm_run: a process alone.
#include "mpm/programs/run.hpp"

int main(int argc, char** argv) { return grainpair::run_program(argc, argv, grainpair::alone()); }
