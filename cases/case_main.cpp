// mpm_case: checks an input file of any kind and prints it complete; or prints what such a file may
// hold, or the codes of failures.
#include <fmt/format.h>

#include <filesystem>

#include "cases/case.hpp"
#include "cases/command_line.hpp"
#include "cases/kinds.hpp"

namespace {

using namespace grainpair;

void print_codes() {
  for (const auto& failure : failure_codes)
    fmt::print("failure {}: {}\n", failure.name, failure.doc);
  for (const auto& warning : warning_codes)
    fmt::print("warning {}: {}\n", warning.name, warning.doc);
}

std::string complete_file(const std::string& path, Kind kind,
                          const std::vector<std::string>& overrides) {
  if (kind == Kind::scene) {
    const Case scene = Case::load(path, overrides);
    for (const std::string& line : scene.contradictions())
      fmt::print(stderr, "warning: {}\n", line);
    return scene.resolved();
  }
  if (!overrides.empty())
    throw CaseError(fmt::format("--set {}: only a scene takes --set", overrides.front()));
  return read_document(path, kind).values.as_toml();
}

void print(const Stiffnesses& of) {
  const auto one = [](const Stiffness& s) {
    return fmt::format(
        "{{\"stiffness_factor\": {:.6g}, \"weight_to_stiffness\": {:.6g}, \"softening_error\": "
        "{:.3g}}}",
        s.factor, s.weight, s.error);
  };
  fmt::print("{{\"mpm\": {}, \"dem\": {}}}\n", one(of.continuum), one(of.grains));
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine line("Checks an input file against its schema and prints it complete, as TOML.");
  std::string path, kind;
  std::vector<std::string> overrides;
  bool describe = false, codes = false, stiffness = false;
  line.option("file", path,
              "input file, or a folder that holds case.toml; with --describe the start of a key")
      .option("--kind", kind,
              "scene, element, point or study (a file called study.toml is a study, any other a "
              "scene)")
      .repeated("--set", overrides, "key=value that overrides a scene's file; may be repeated")
      .flag("--describe", describe, "print the schema instead")
      .flag("--stiffness", stiffness,
            "print as JSON what is made of the stiffness of a scene's continuum and grains")
      .flag("--failures", codes, "print the codes of failures and warnings instead");
  if (const auto done = line.parse(argc, argv)) return *done;
  if (kind.empty())
    kind = std::filesystem::path(path).filename() == "study.toml" ? "study" : "scene";
  try {
    if (codes)
      print_codes();
    else if (stiffness)
      print(Case::load(path, overrides).stiffness());
    else if (describe)
      fmt::print("{}", describe_keys(path, kind_named(kind)));
    else if (path.empty())
      throw CaseError("mpm_case: no case file (name one, or ask for --describe)");
    else
      fmt::print("{}", complete_file(path, kind_named(kind), overrides));
  } catch (const CaseError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  } catch (const std::exception& error) {  // such as a working folder that is gone
    fmt::print(stderr, "{}: {}\n", path, error.what());
    return 3;
  }
}
