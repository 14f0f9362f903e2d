#include "mpm/programs/start_ranks.hpp"

#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "cases/case.hpp"

namespace grainpair {
namespace {

/// Takes from the environment what MPI tells its ranks there (as in dem_reference/ranks.py): mpirun
/// would ask for a place in the world of the rank that has called us, and end without a word.
void leave_world() {
  if (!getenv("PMIX_RANK")) return;  // settings that the user has made stay
  constexpr std::string_view told[] = {"PMIX_",         "ORTE_",        "OMPI_COMM_",
                                       "OMPI_APP_",     "OMPI_MCA_ess", "OMPI_MCA_pmix",
                                       "OMPI_MCA_orte_"};
  std::vector<std::string> names;
  for (char** word = environ; *word; ++word) {
    const std::string_view name =
        std::string_view(*word).substr(0, std::string_view(*word).find('='));
    if (std::ranges::any_of(told, [&](auto start) { return name.starts_with(start); }))
      names.emplace_back(name);
  }
  for (const std::string& name : names) unsetenv(name.c_str());
}

}  // namespace

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
  leave_world();
  execvp(line.front(), line.data());
  throw CaseError(
      "--ranks: mpirun cannot be started (not installed) install the package "
      "openmpi-bin");
}

}  // namespace grainpair
