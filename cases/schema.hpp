// The schema of case files: one Key per key of cases/schema.toml, in the order of that file.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "cases/case.hpp"

namespace grainpair {

struct Key {
  enum class Type { real, integer, text, boolean, choice };

  std::string name;  // dotted
  Type type;
  std::string unit;
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  std::optional<Case::Value> standard;  // the default; a key without one is required
  std::vector<std::string> choices;
  std::string doc;

  std::string table() const;  // "grains" of grains.friction, "" of title
  std::string leaf() const;   // "friction" of grains.friction
};

const std::vector<Key>& schema();
const Key* find_key(const std::string& name);  // null if the schema lacks it

/// A value as TOML writes it; reals in the fewest digits that read back to the same double.
std::string as_toml(const Case::Value& value);

}  // namespace grainpair
