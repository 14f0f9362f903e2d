// What a schema says of its keys, for a reader.
#include <fmt/format.h>

#include <cmath>

#include "cases/schema.hpp"

namespace grainpair {
namespace {

std::string range(const Key& key) {
  switch (key.type) {
    case Key::Type::text:
      return "text";
    case Key::Type::boolean:
      return "true | false";
    case Key::Type::choice:
      return fmt::format("{}", fmt::join(key.choices, " | "));
    case Key::Type::table:
      return "table";
    case Key::Type::case_key:
      return "a key of a scene";
    case Key::Type::case_value:
      return key.of.empty() ? "values of a scene's keys" : "value of " + key.of;
    case Key::Type::assignment:
      return "\"key=value\" of a scene";
    default:
      break;
  }
  const std::string kind = key.type == Key::Type::integer ? "integer " : "";
  const std::string unit = key.unit.empty() ? "" : fmt::format(" [{}]", key.unit);
  if (key.positive) return fmt::format("{}> 0{}", kind, unit);
  if (!std::isfinite(key.upper - key.lower)) return kind + "number" + unit;
  return fmt::format("{}{:g} .. {:g}{}", kind, key.lower, key.upper, unit);
}

std::string shape(const Key& key) {
  switch (key.shape) {
    case Key::Shape::list:
      return key.least == key.most ? fmt::format("list of {}: ", key.least) : "list: ";
    case Key::Shape::named:
      return key.choices.empty() ? "table: "
                                 : fmt::format("table of {}: ", fmt::join(key.choices, ", "));
    case Key::Shape::named_lists:
      return "table of lists: ";
    default:
      return "";
  }
}

std::string condition(const Key& key) {
  std::string text;
  for (const auto& [other, values] : key.when)
    text += fmt::format(", where {} = {}", other, fmt::join(values, " | "));
  return text;
}

void describe(const std::vector<Key>& keys, const std::string& above, const std::string& prefix,
              std::string& text) {
  for (const Key& key : keys) {
    const std::string name = above + key.name;
    if (name.starts_with(prefix)) {
      const std::string standard = key.standard   ? "default " + as_toml(*key.standard)
                                   : key.optional ? "may lack"
                                                  : "required";
      text += fmt::format("{:<32} {}{} ({}{})\n    {}\n", name, shape(key), range(key), standard,
                          condition(key), key.doc);
    }
    describe(key.keys, name + ".", prefix, text);
  }
}

}  // namespace

std::string describe_keys(const std::string& prefix, Kind kind) {
  std::string text;
  describe(schema(kind), "", prefix, text);
  return text;
}

}  // namespace grainpair
