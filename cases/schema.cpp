#include "cases/schema.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "cases/failure.hpp"

namespace grainpair {

// The texts of cases/*schema.toml.
extern const char *const scene_schema, *const element_schema, *const point_schema,
                                                                  *const study_schema;

namespace {

using Conditions = std::map<std::string, std::vector<std::string>>;

Key::Type type_named(std::string_view name) {
  static const std::map<std::string_view, Key::Type> types{
      {"float", Key::Type::real},           {"integer", Key::Type::integer},
      {"string", Key::Type::text},          {"boolean", Key::Type::boolean},
      {"choice", Key::Type::choice},        {"table", Key::Type::table},
      {"case_key", Key::Type::case_key},    {"case_value", Key::Type::case_value},
      {"assignment", Key::Type::assignment}};
  return types.at(name);
}

/// "[float]" is a list of numbers, "{float}" a table of them, "{[float]}" a table of such lists.
void read_type(std::string_view name, Key& key) {
  const auto within = [&](char open, char close) {
    if (!name.starts_with(open) || !name.ends_with(close)) return false;
    name = name.substr(1, name.size() - 2);
    return true;
  };
  if (within('{', '}'))
    key.shape = within('[', ']') ? Key::Shape::named_lists : Key::Shape::named;
  else if (within('[', ']'))
    key.shape = Key::Shape::list;
  key.type = type_named(name);
}

Value default_of(const toml::node& node, Key::Type type) {
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

std::vector<std::string> words_of(const toml::node& node) {
  if (const auto* list = node.as_array()) {
    std::vector<std::string> words;
    for (const auto& word : *list) words.push_back(word.value<std::string>().value());
    return words;
  }
  return {node.value<std::string>().value()};
}

Conditions conditions_of(const toml::table& entry) {
  Conditions conditions;
  if (const auto* when = entry["when"].as_table())
    for (const auto& [other, values] : *when)
      conditions.emplace(std::string(other.str()), words_of(values));
  return conditions;
}

struct Placed {
  toml::source_index line;
  Key key;
  std::string like;  // the table beside it that holds the same keys
};

std::vector<Key> read_keys(const toml::table& table);

Key read_key(const std::string& name, const toml::table& entry) {
  Key key;
  // Two entries may describe one key, for two values of another; `key` is then its name.
  key.name = entry["key"].value_or(name);
  read_type(*entry["type"].value<std::string_view>(), key);
  key.unit = entry["unit"].value_or(std::string());
  key.doc = entry["doc"].value_or(std::string());
  key.lower = entry["lower"].value_or(key.lower);
  key.upper = entry["upper"].value_or(key.upper);
  key.positive = entry["positive"].value_or(false);
  key.optional = entry["optional"].value_or(false);
  key.of = entry["of"].value_or(std::string());
  key.least = static_cast<std::size_t>(entry["least"].value_or(1l));
  if (const auto length = entry["length"].value<long>())
    key.least = key.most = static_cast<std::size_t>(*length);
  if (const auto* standard = entry.get("default")) key.standard = default_of(*standard, key.type);
  if (const auto* choices = entry.get("choices")) key.choices = words_of(*choices);
  if (const auto* keys = entry["keys"].as_table()) key.keys = read_keys(*keys);
  key.when = conditions_of(entry);
  return key;
}

void collect(const toml::table& table, const std::string& prefix, const Conditions& when,
             std::vector<Placed>& keys) {
  for (const auto& [name, node] : table) {
    const std::string dotted = prefix + std::string(name.str());
    if (name.str() == "when" || name.str() == "former") continue;
    const toml::table& entry = *node.as_table();
    if (!entry["type"].is_string()) {  // a table of keys
      Conditions inner = conditions_of(entry);
      inner.insert(when.begin(), when.end());
      collect(entry, dotted + ".", inner, keys);
      continue;
    }
    Key key = read_key(dotted, entry);
    key.when.insert(when.begin(), when.end());
    keys.push_back(
        {entry.source().begin.line, std::move(key), entry["like"].value_or(std::string())});
  }
}

std::vector<Key> read_keys(const toml::table& table) {
  std::vector<Placed> placed;
  collect(table, "", {}, placed);
  std::ranges::sort(placed, {}, &Placed::line);
  std::vector<Key> keys;
  for (auto& entry : placed) {
    if (!entry.like.empty()) entry.key.keys = find_key(keys, entry.like)->keys;
    keys.push_back(std::move(entry.key));
  }
  return keys;
}

constexpr std::array kinds{"scene", "element", "point", "study"};  // in the order of Kind

}  // namespace

Kind kind_named(const std::string& name) {
  const auto found = std::ranges::find(kinds, name);
  if (found == kinds.end())
    throw CaseError(fmt::format("--kind {}: unknown (known: {})", name, fmt::join(kinds, ", ")));
  return static_cast<Kind>(found - kinds.begin());
}

std::string Key::table() const {
  const auto dot = name.rfind('.');
  return dot == std::string::npos ? "" : name.substr(0, dot);
}

std::string Key::leaf() const { return name.substr(name.rfind('.') + 1); }

bool Key::exists(const std::function<std::string(const std::string&)>& value_of) const {
  return std::ranges::all_of(when, [&](const auto& condition) {
    const auto& [other, values] = condition;
    return std::ranges::find(values, value_of(other)) != values.end();
  });
}

const std::vector<Key>& schema(Kind kind) {
  static const auto read = [](const char* text) { return read_keys(toml::parse(text)); };
  static const std::array schemas{read(scene_schema), read(element_schema), read(point_schema),
                                  read(study_schema)};
  return schemas[static_cast<std::size_t>(kind)];
}

const std::string* successor(const std::string& former) {
  static const auto successors = [] {
    std::map<std::string, std::string> read;
    const toml::table text = toml::parse(scene_schema);
    for (const auto& [name, node] : *text["former"].as_table())
      read.emplace(name.str(), node.value<std::string>().value());
    return read;
  }();
  const auto found = successors.find(former);
  return found == successors.end() ? nullptr : &found->second;
}

const Key* find_key(const std::vector<Key>& keys, const std::string& name) {
  const auto key = std::ranges::find(keys, name, &Key::name);
  return key == keys.end() ? nullptr : &*key;
}

}  // namespace grainpair
