#include "mpm/programs/start_ranks.hpp"

#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "cases/case.hpp"

namespace grainpair {

int start_ranks(int argc, char** argv, int ranks) {
  const auto program =
      std::filesystem::read_symlink("/proc/self/exe").parent_path() / "mpm_run_ranks";
  if (access(program.c_str(), X_OK) != 0)
    throw CaseError(
        "--ranks: mpm_run_ranks is not there (the build found no MPI) install the package "
        "libopenmpi-dev, and build again");
  std::vector<std::string> words{"mpirun",
                                 "--quiet",
                                 "--oversubscribe",
                                 "--bind-to",
                                 "none",
                                 "--mca",
                                 "mpi_yield_when_idle",
                                 "1",
                                 "-np",
                                 std::to_string(ranks)};
  if (geteuid() == 0) words.emplace_back("--allow-run-as-root");
  words.push_back(program);
  for (int i = 1; i < argc; ++i) words.emplace_back(argv[i]);
  std::vector<char*> line;
  line.reserve(words.size() + 1);
  for (std::string& word : words) line.push_back(word.data());
  line.push_back(nullptr);
  execvp(line.front(), line.data());
  throw CaseError(
      "--ranks: mpirun cannot be started (not installed) install the package "
      "openmpi-bin");
}

}  // namespace grainpair
