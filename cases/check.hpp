// Input against a schema: each value's type and bounds, keys nobody knows, keys that lack. The same
// for every kind of input file.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "cases/file.hpp"
#include "cases/schema.hpp"
#include "cases/values.hpp"

namespace grainpair {

/// A value somebody gave, and where: "case.toml:12" or "--set grains.friction=0.4".
struct Given {
  Value value;
  std::string where;
  std::filesystem::path folder;  // that relative paths in it start from
};
using GivenValues = std::map<std::string, Given>;

/// Puts every value of `table` that is not given yet into `given`; all are checked, also those that
/// lose. `prefix`: what the table is called, as "frontier.series.". Throws CaseError.
void take(const std::vector<Key>& keys, const toml::table& table, const Source& source,
          const std::string& prefix, GivenValues& given);

/// The given values with the defaults of the others, in the order of the schema; `where` the table
/// stands. Throws CaseError where a key lacks.
Values complete(const std::vector<Key>& keys, const GivenValues& given, const std::string& where,
                const std::string& prefix);

/// Key and value of "key=value", of a scene's keys. What is no TOML value, or stands where text
/// belongs, is a string without its quotes. Throws CaseError.
std::pair<std::string, Value> check_assignment(const std::string& text, const std::string& where);

}  // namespace grainpair
