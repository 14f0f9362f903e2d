// Any text as an input file: it is read, or refused in one line.
#include "cases/case.hpp"
#include "cases/kinds.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

constexpr const char* scene = R"(
[geometry]
height = 0.02
length = 0.02
thickness = 0.006
floor_length = 0.12
[grains]
diameter = 0.002
density = 2532.0
young_modulus = 3e8
restitution = 0.879
friction = 0.5
[initial]
void_ratio = 0.71
[walls]
base = "glued"
left = "smooth"
front_back = "periodic"
[material]
law = "solid_fluid"
card = "seed_table1"
[mpm]
cell_size = 0.001
[time]
maximum = 1.0
)";

std::vector<std::string> lines(std::string_view text) {
  std::vector<std::string> out;
  while (!text.empty() && out.size() < 8) {
    const auto end = text.find('\n');
    out.emplace_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return out;
}

}  // namespace

/// The first byte: as which kind of file, or as words of --set, a line each.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace grainpair;
  static const fuzz::MemoryFile file;
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const unsigned kind = data[0] % 8;
  file.write(kind >= 5 ? scene : text);
  fuzz::refused_in_one_line<CaseError>([&] {
    switch (kind) {
      case 1:
        read_document(file.path(), Kind::element);
        break;
      case 2:
        read_document(file.path(), Kind::point);
        break;
      case 3:
        read_document(file.path(), Kind::study);
        break;
      case 5:
      case 6:
      case 7:
        Case::load(file.path(), lines(text));
        break;
      default:
        Case::load(file.path());
    }
  });
  return 0;
}
