// The command line of a program, by CLI11. What CLI11 instantiates is compiled here once and not in
// every program.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace grainpair {

// The same bounds as in Python (cases/command_line.py).
inline constexpr int most_threads = 1024;
inline constexpr unsigned most_seed = 4294967295u;

class CommandLine {
 public:
  /// `does`: what the program does, the first line of its help.
  explicit CommandLine(const std::string& does);
  ~CommandLine();

  /// What is bound to the last option beside its type.
  CommandLine& required();
  CommandLine& one_of(const std::vector<std::string>& words);
  CommandLine& within(double low, double high);
  CommandLine& positive();
  CommandLine& count(int values);
  CommandLine& threads();  // a number of threads
  CommandLine& seed();     // a random number's

  /// "name" is a positional argument, "-n,--name" an option; `value` keeps what it holds where none
  /// is given. Value: std::string, int, unsigned, double, or a vector of strings, doubles or sizes.
  template <class Value>
  CommandLine& option(const std::string& names, Value& value, const std::string& doc);
  /// May be given many times, one value each.
  CommandLine& repeated(const std::string& names, std::vector<std::string>& values,
                        const std::string& doc);
  CommandLine& flag(const std::string& names, bool& value, const std::string& doc);

  /// The exit code of a program that has nothing more to do: 0 after --help, 2 after a mistake,
  /// which has been named on standard error.
  std::optional<int> parse(int argc, char** argv);

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;
};

}  // namespace grainpair
