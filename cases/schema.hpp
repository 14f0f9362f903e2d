// The schemas of input files: one Key per key of cases/*schema.toml, in the order of that file.
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cases/values.hpp"

namespace grainpair {

/// What an input file describes; each kind has a schema.
enum class Kind { scene, element, point, study };

/// The kind called so, as --kind takes it. Throws CaseError.
Kind kind_named(const std::string& name);

struct Key {
  enum class Type { real, integer, text, boolean, choice, table, case_key, case_value, assignment };
  /// One of the type, a list of them, or a table of them (of lists of them) whose keys are free.
  enum class Shape { one, list, named, named_lists };

  std::string name;  // dotted, within the table that holds it
  Type type = Type::text;
  Shape shape = Shape::one;
  std::string unit;
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  bool positive = false;
  std::size_t least = 1, most = std::numeric_limits<std::size_t>::max();  // values of a list
  std::optional<Value> standard;                                          // the default
  bool optional = false;  // without a default either: the key may lack
  std::vector<std::string> choices;
  std::string of;         // case_value: the key beside it that names the case's key
  std::vector<Key> keys;  // of a table
  std::map<std::string, std::vector<std::string>> when;  // it exists where another has such a value
  std::string doc;

  std::string table() const;  // "grains" of grains.friction, "" of title
  std::string leaf() const;   // "friction" of grains.friction

  /// Whether the key exists, where value_of(other key) tells the others' values.
  bool exists(const std::function<std::string(const std::string&)>& value_of) const;
};

const std::vector<Key>& schema(Kind kind = Kind::scene);

/// What stands for a scene's key that is no more; null of any other word.
const std::string* successor(const std::string& former);

/// The first key called so; null if there is none.
const Key* find_key(const std::vector<Key>& keys, const std::string& name);

/// The keys of a schema that start with `prefix`, with unit, bounds or choices, default and
/// documentation.
std::string describe_keys(const std::string& prefix = "", Kind kind = Kind::scene);

}  // namespace grainpair
