// A case file, checked and complete: every key of cases/schema.toml has a value of its declared
// type, in bounds. This is the only C++ that reads TOML.
#pragma once

#include <map>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

namespace grainpair {

/// Bad input, said in one line: `file:line: problem (why) hint`. Programs print it and exit with
/// code 2.
struct CaseError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Case {
 public:
  using Value = std::variant<double, long, bool, std::string>;

  /// Reads `path` (a file, or a folder that holds case.toml), what it extends and its material
  /// card, applies `overrides` ("mpm.cell_size=0.002"), checks all of it against the schema and
  /// fills in the defaults. A key is taken from the first that gives it: override, file, extended
  /// files, card, default. Throws CaseError.
  static Case load(const std::string& path, const std::vector<std::string>& overrides = {});

  // Values by dotted key, e.g. number("geometry.height"). A key the schema lacks throws
  // std::logic_error.
  double number(const std::string& key) const;  // also reads integers
  long integer(const std::string& key) const;
  bool flag(const std::string& key) const;
  const std::string& word(const std::string& key) const;

  /// The complete case as TOML, defaults and overrides included; itself a case file that resolves
  /// to the same.
  std::string resolved() const;
  /// The file as its author wrote it.
  const std::string& text() const { return text_; }
  const std::string& path() const { return path_; }

 private:
  const Value& value(const std::string& key) const;

  std::string path_, text_;
  std::map<std::string, Value> values_;
};

/// The keys of the schema that start with `prefix`, with unit, bounds or choices, default and
/// documentation.
std::string describe_keys(const std::string& prefix = "");

}  // namespace grainpair
