#include "cases/library.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "cases/digest.hpp"
#include "cases/hints.hpp"

namespace grainpair {

extern const char* const laws_folder;  // where the build puts those of cases/laws

namespace {

namespace fs = std::filesystem;

const std::string* word(const GivenValues& given, const std::string& key) {
  const auto found = given.find(key);
  if (found == given.end()) return nullptr;
  const auto& value = std::get<std::string>(found->second.value);
  return value.empty() ? nullptr : &value;
}

/// Beside the file that gives it; of a command line in the folder where that is typed, if it is
/// there.
fs::path beside(const Given& given, const fs::path& file) {
  std::error_code unknown;
  const bool typed = given.where.starts_with("--set ") && fs::is_regular_file(file, unknown);
  const fs::path folder = typed || given.folder.empty() ? fs::path(".") : given.folder;
  return fs::absolute(folder / file).lexically_normal();
}

fs::path find(const Given& given) {
  const fs::path name = std::get<std::string>(given.value);
  const fs::path ours = fs::path(laws_folder) / ("lib" + name.string() + ".so");
  for (const fs::path& place : {beside(given, name), ours})
    if (std::error_code unknown; fs::is_regular_file(place, unknown)) return place;
  refuse(given.where,
         "no library '{}' (neither {} nor {}). A path starts from the file that gives it, or from "
         "the root.",
         name.string(), beside(given, name).string(), ours.string());
}

std::string bytes_of(const fs::path& file, const std::string& where) {
  std::error_code unknown;
  const auto status = fs::status(file, unknown);
  if (!fs::is_regular_file(status))
    refuse(where, "{} cannot be read ({})", file.string(),
           fs::exists(status) ? "not a file" : "it does not exist");
  constexpr std::uintmax_t most = 1 << 28;
  if (fs::file_size(file, unknown) > most)
    refuse(where, "{} cannot be read (longer than 256 MiB)", file.string());
  std::ifstream in(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  if (!in) refuse(where, "{} cannot be read", file.string());
  return bytes;
}

/// Numbers of a file: Abaqus and Anura3D users keep theirs so.
std::vector<Value> read_constants(const fs::path& file, const std::string& where) {
  std::istringstream in(bytes_of(file, where));
  std::vector<Value> constants;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    line = line.substr(0, std::min({line.find('#'), line.find('!'), line.find("**")}));
    for (char& c : line)
      c = c == ',' || c == ';' || c == '\t' || c == '\r' ? ' ' : c == 'd' || c == 'D' ? 'e' : c;
    std::istringstream words(line);
    for (std::string one; words >> one;) {
      std::size_t used = 0;
      double value = 0.0;
      try {
        value = std::stod(one, &used);
      } catch (const std::exception&) {
        used = 0;
      }
      if (used != one.size() || !std::isfinite(value))
        refuse(fmt::format("{}:{}", file.string(), number),
               "'{}' is no number (constants stand between blanks, commas or lines; a comment "
               "begins with #, ! or **)",
               one);
      constants.push_back(value);
    }
  }
  if (constants.empty()) refuse(where, "{} holds no numbers", file.string());
  return constants;
}

}  // namespace

void find_library(GivenValues& given, const std::string& path) {
  const std::string* const law = word(given, "material.law");
  if (!law || *law != "external") return;
  if (!word(given, "material.library"))
    refuse(path,
           "material.law = \"external\" without material.library (the shared library it is "
           "in)");
  if (!word(given, "material.interface"))
    refuse(given.at("material.law").where,
           "material.law = \"external\" without material.interface (umat, esm or grainpair)");
  Given& library = given.at("material.library");
  const fs::path file = find(library);
  library.value = file.string();
  const std::string found = Digest().add(bytes_of(file, library.where)).text();
  const auto [told, is_new] =
      given.insert({"material.library_digest", Given{found, library.where, {}}});
  if (const auto& asked = std::get<std::string>(told->second.value); !is_new && asked != found)
    refuse(told->second.where,
           "{} is another library than the case means (digest {}, not {}). Give the one it was run "
           "with, or leave material.library_digest out.",
           file.string(), found, asked);
  if (const std::string* const constants = word(given, "material.parameters_file")) {
    const Given from = given.at("material.parameters_file");
    if (given.contains("material.constants"))
      refuse(from.where, "material.parameters_file and material.constants (one of them, not both)");
    given.insert({"material.constants",
                  Given{read_constants(beside(from, *constants), from.where), from.where, {}}});
    given.erase("material.parameters_file");
  }
}

}  // namespace grainpair
