// mpm_case: checks a case file and prints it complete; or prints what a case file may hold.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "cases/case.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Checks a case file against the schema and prints it complete, as TOML."};
  std::string path;
  std::vector<std::string> overrides;
  bool describe = false;
  app.add_option("case", path,
                 "case file, or a folder that holds case.toml; with --describe the start of a key");
  app.add_option("--set", overrides, "key=value that overrides the file; may be repeated")
      ->take_all()
      ->expected(1);
  app.add_flag("--describe", describe, "print the schema instead");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (describe) {
    fmt::print("{}", grainpair::describe_keys(path));
    return 0;
  }
  if (path.empty()) {
    fmt::print(stderr, "mpm_case: no case file (name one, or ask for --describe)\n");
    return 2;
  }
  try {
    fmt::print("{}", grainpair::Case::load(path, overrides).resolved());
  } catch (const grainpair::CaseError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
