// mpm_law_test CASE: what holds of the case's law; of each thing asked a line, fields between tabs.
#include <fmt/format.h>

#include <cstdio>

#include "cases/command_line.hpp"
#include "mpm/programs/law_alone.hpp"
#include "mpm/programs/law_test.hpp"

int main(int argc, char** argv) {
  using namespace grainpair;
  CommandLine line("Asks of a law what no path of a laboratory shows.");
  std::string path;
  std::vector<std::string> overrides, all = law_alone;
  line.option("case", path, "case file, or the folder of its case.toml, whose law is asked")
      .required()
      .repeated("--set", overrides, "key=value, in place of what the case says");
  if (const auto done = line.parse(argc, argv)) return *done;
  all.insert(all.end(), overrides.begin(), overrides.end());
  try {
    const Case material = Case::load(path, all);
    const auto found = test_law(material, [](const std::string& name) {
      fmt::print("asking\t{}\n", name);
      std::fflush(stdout);
    });
    for (const auto& one : found)
      fmt::print("{}\t{}\t{}\t{}\n", one.holds ? "holds" : "fails", one.name, one.figure, one.doc);
  } catch (const CaseError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", path, error.what());
    return 3;
  }
  return 0;
}
