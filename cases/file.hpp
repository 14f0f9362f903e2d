// Input files as text and as TOML.
#pragma once

#include <toml++/toml.h>

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

/// The text of an input file. Throws CaseError if it is not there, no text, or empty; `holds`: what
/// such a file holds at least.
std::string read_text(const std::string& path, const std::string& holds);

/// Throws CaseError.
toml::table parse_toml(const std::string& text, const std::string& path);

/// Keys and values of a table in the order in which they are written.
std::vector<std::pair<std::string, const toml::node*>> in_order(const toml::table& table);

/// "the string "tall""
std::string kind_of(const toml::node& node);

}  // namespace grainpair
