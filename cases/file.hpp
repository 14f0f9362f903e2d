// Input files as text and as TOML.
#pragma once

#include <toml++/toml.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace grainpair {

/// Where values come from: a file, whose lines are told, or the command line.
struct Source {
  std::string name;
  bool has_lines = true;
  /// "case.toml:12"
  std::string at(const toml::node& node) const;
};

/// The input file that `path` names: itself, or the case.toml of a folder. Whether it can be read
/// is for read_text() to say.
std::string input_file(const std::string& path);

/// The text of an input file. Throws CaseError if it is not there, no text, or empty; `holds`: what
/// such a file holds at least.
std::string read_text(const std::string& path, const std::string& holds);

/// The line of `text`, counted from 1, in which tables or lists first lie deeper in each other than
/// any input file needs: the parser calls itself for each, and the stack has an end.
std::optional<std::size_t> too_deep(const std::string& text);

/// Throws CaseError.
toml::table parse_toml(const std::string& text, const std::string& path);

/// Keys and values of a table in the order in which they are written.
std::vector<std::pair<std::string, const toml::node*>> in_order(const toml::table& table);

/// "the string "tall""
std::string kind_of(const toml::node& node);

}  // namespace grainpair
