// What a case hands to an external law: any bytes as its library, any text as its file of
// constants, any words for its keys. Taken, or refused in one line.
#include "cases/case.hpp"
#include "cases/check.hpp"
#include "cases/library.hpp"
#include "mpm/external/law.hpp"
#include "mpm/external/shared_library.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

using namespace grainpair;

constexpr const char* scene = R"(
geometry = {height = 0.02, length = 0.02, thickness = 0.006, floor_length = 0.12}
grains = {diameter = 1e-3, density = 2e3, young_modulus = 3e8, restitution = 0.9, friction = 0.5}
initial.void_ratio = 0.71
walls = {base = "glued", left = "smooth", front_back = "periodic"}
material.law = "external"
mpm.cell_size = 0.001
time.maximum = 1.0
)";

/// One of some dozens is loaded: that takes a process.
bool drawn(std::string_view bytes) {
  std::uint32_t hash = 2166136261u;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
  return hash % 256 == 0;
}

void take_library(const fuzz::MemoryFile& file, std::string_view bytes) {
  const std::string fault = fault_of_library(bytes);
  if (fault.find('\n') != std::string::npos) std::abort();
  if (!fault.empty() || !drawn(bytes)) return;
  file.write(bytes);
  fault_of_loading(file.path(), 1);
}

void take_constants(const fuzz::MemoryFile& file, std::string_view text) {
  file.write(text);
  GivenValues given;
  for (const auto& [key, word] : {std::pair{"law", std::string("external")},
                                  {"library", file.path()},
                                  {"interface", "umat"},
                                  {"parameters_file", file.path()}})
    given.insert({std::string("material.") + key, Given{word, "here", {}}});
  find_library(given, "here");
}

void take_keys(const fuzz::MemoryFile& file, std::string_view words) {
  file.write(scene);
  std::vector<std::string> overrides{"material.library=" + file.path()};
  while (!words.empty() && overrides.size() < 9) {
    const auto end = words.find('\n');
    overrides.push_back("material." + std::string(words.substr(0, end)));
    words.remove_prefix(end == std::string_view::npos ? words.size() : end + 1);
  }
  const Case read = Case::load(file.path(), overrides);
  if (read.word("material.law") == "external") ExternalConstants{read};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::MemoryFile file;
  if (size == 0) return 0;
  const std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
  fuzz::refused_in_one_line<CaseError>([&] {
    switch (data[0] % 4) {
      case 0:
      case 1:
        take_library(file, rest);
        break;
      case 2:
        take_constants(file, rest);
        break;
      default:
        take_keys(file, rest);
    }
  });
  return 0;
}
