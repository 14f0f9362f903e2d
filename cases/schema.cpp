#include "cases/schema.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <sstream>

namespace grainpair {

extern const char* const case_schema;  // the text of cases/schema.toml

namespace {

Key::Type type_named(std::string_view name) {
  if (name == "float") return Key::Type::real;
  if (name == "integer") return Key::Type::integer;
  if (name == "string") return Key::Type::text;
  if (name == "boolean") return Key::Type::boolean;
  if (name == "choice") return Key::Type::choice;
  throw std::logic_error(fmt::format("cases/schema.toml: unknown type '{}'", name));
}

Case::Value default_of(const toml::node& node, Key::Type type) {
  switch (type) {
    case Key::Type::real:
      return node.value<double>().value();
    case Key::Type::integer:
      return static_cast<long>(node.value<std::int64_t>().value());
    case Key::Type::boolean:
      return node.value<bool>().value();
    default:
      return node.value<std::string>().value();
  }
}

struct Placed {
  toml::source_index line;
  Key key;
};

void collect(const toml::table& table, const std::string& prefix, std::vector<Placed>& keys) {
  for (const auto& [name, node] : table) {
    const toml::table& entry = *node.as_table();
    const std::string dotted = prefix + std::string(name.str());
    if (!entry["type"].is_string()) {  // a table of keys
      collect(entry, dotted + ".", keys);
      continue;
    }
    Key key{.name = dotted,
            .type = type_named(*entry["type"].value<std::string_view>()),
            .unit = entry["unit"].value_or(std::string()),
            .standard = {},
            .choices = {},
            .doc = entry["doc"].value_or(std::string())};
    key.lower = entry["lower"].value_or(key.lower);
    key.upper = entry["upper"].value_or(key.upper);
    if (const auto* standard = entry.get("default")) key.standard = default_of(*standard, key.type);
    if (const auto* choices = entry["choices"].as_array())
      for (const auto& choice : *choices)
        key.choices.push_back(choice.value<std::string>().value());
    keys.push_back({entry.source().begin.line, std::move(key)});
  }
}

std::vector<Key> read_schema() {
  std::vector<Placed> placed;
  collect(toml::parse(case_schema), "", placed);
  std::ranges::sort(placed, {}, &Placed::line);
  std::vector<Key> keys;
  for (auto& entry : placed) keys.push_back(std::move(entry.key));
  return keys;
}

std::string range(const Key& key) {
  switch (key.type) {
    case Key::Type::text:
      return "text";
    case Key::Type::boolean:
      return "true | false";
    case Key::Type::choice:
      return fmt::format("{}", fmt::join(key.choices, " | "));
    default: {
      const std::string kind = key.type == Key::Type::integer ? "integer " : "";
      return fmt::format("{}{:g} .. {:g} [{}]", kind, key.lower, key.upper, key.unit);
    }
  }
}

}  // namespace

std::string Key::table() const {
  const auto dot = name.rfind('.');
  return dot == std::string::npos ? "" : name.substr(0, dot);
}

std::string Key::leaf() const { return name.substr(name.rfind('.') + 1); }

const std::vector<Key>& schema() {
  static const std::vector<Key> keys = read_schema();
  return keys;
}

const Key* find_key(const std::string& name) {
  const auto key = std::ranges::find(schema(), name, &Key::name);
  return key == schema().end() ? nullptr : &*key;
}

std::string as_toml(const Case::Value& value) {
  if (const auto* real = std::get_if<double>(&value)) {
    const std::string digits = fmt::format("{}", *real);
    return digits.find_first_of(".e") == std::string::npos ? digits + ".0" : digits;
  }
  if (const auto* text = std::get_if<std::string>(&value)) {
    std::ostringstream quoted;  // a basic string, even where a literal one would do
    quoted << toml::toml_formatter(toml::value<std::string>(*text), toml::format_flags::none);
    return quoted.str();
  }
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  return fmt::format("{}", std::get<long>(value));
}

std::string describe_keys(const std::string& prefix) {
  std::string text;
  for (const Key& key : schema()) {
    if (!key.name.starts_with(prefix)) continue;
    const std::string standard = key.standard ? "default " + as_toml(*key.standard) : "required";
    text += fmt::format("{:<32} {} ({})\n    {}\n", key.name, range(key), standard, key.doc);
  }
  return text;
}

}  // namespace grainpair
