#include "cases/memory.hpp"

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

namespace grainpair {
namespace {

constexpr std::uint64_t unlimited = std::numeric_limits<std::uint64_t>::max();

/// The one number of a file of a control group; no limit where there is no file, or a word in it.
std::uint64_t number_in(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t value = unlimited;
  return file >> value ? value : unlimited;
}

std::uint64_t left_of(const std::string& limit, const std::string& used) {
  const std::uint64_t most = number_in(limit), taken = number_in(used);
  if (most == unlimited || taken == unlimited) return unlimited;
  return most > taken ? most - taken : 0;
}

/// What the groups of this process, and those around them, still allow.
std::uint64_t left_of_groups() {
  std::ifstream file("/proc/self/cgroup");
  std::uint64_t least = unlimited;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string number, controllers, path;
    std::getline(words, number, ':');
    std::getline(words, controllers, ':');
    std::getline(words, path);
    const bool second = number == "0" && controllers.empty();
    if (!second && controllers != "memory") continue;
    const std::string root = second ? "/sys/fs/cgroup" : "/sys/fs/cgroup/memory";
    for (path = path == "/" ? "" : path;; path.resize(path.rfind('/'))) {
      const std::string here = root + path;
      least = std::min(least, second ? left_of(here + "/memory.max", here + "/memory.current")
                                     : left_of(here + "/memory.limit_in_bytes",
                                               here + "/memory.usage_in_bytes"));
      if (path.empty() || path.rfind('/') == std::string::npos) break;
    }
  }
  return least;
}

std::uint64_t left_of_machine() {
  std::ifstream file("/proc/meminfo");
  for (std::string name; file >> name;) {
    std::uint64_t kibibytes = 0;
    if (name == "MemAvailable:" && file >> kibibytes) return 1024 * kibibytes;
    file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return unlimited;
}

}  // namespace

std::uint64_t available_memory() { return std::min(left_of_machine(), left_of_groups()); }

}  // namespace grainpair
