#include "cases/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cases/hints.hpp"

namespace grainpair {
namespace {

/// Where a value stands, and what is beside it.
struct Context {
  const Source& source;
  const std::string& prefix;
  const std::function<std::string(const std::string&)>& beside;
};

template <class T>
T typed(const std::string& name, const toml::node& node, const std::string& where,
        const char* wanted) {
  const auto value = node.value_exact<T>();
  if (!value) refuse(where, "{} must be {}, not {}", name, wanted, kind_of(node));
  return *value;
}

/// " Is it in m? 1000 times less would fit." where a factor of 1000 explains the mistake.
std::string unit_hint(const Key& key, double value) {
  const auto fits = [&](double v) { return key.lower <= v && v <= key.upper; };
  if (key.unit.empty() || key.unit == "-" || key.unit == "steps") return "";
  const char* factor = fits(value / 1000) ? "less" : fits(value * 1000) ? "more" : nullptr;
  return factor ? fmt::format(" Is it in {}? 1000 times {} would fit.", key.unit, factor) : "";
}

void check_bounds(const Key& key, const std::string& name, double value, const std::string& where) {
  const std::string unit = key.unit.empty() || key.unit == "-" ? "" : " " + key.unit;
  if (!std::isfinite(value))
    refuse(where, "{} = {} is not a finite number ({})", name, value, key.doc);
  if (key.positive && value <= 0.0)
    refuse(where, "{} = {:g}{} must be positive ({})", name, value, unit, key.doc);
  if (value < key.lower || value > key.upper)
    refuse(where, "{} = {:g}{} is out of bounds (outside {:g} .. {:g}{}).{}", name, value, unit,
           key.lower, key.upper, unit, unit_hint(key, value));
}

/// A scene's key that may be set from outside its file.
const Key& scene_key(const std::string& name, const std::string& where) {
  const Key* key = find_key(schema(), name);
  if (!key) refuse_key(schema(), where, "", name);
  if (name == "extends")
    refuse(where, "only a file can extend another (name the other file as the case)");
  return *key;
}

Value check(const Key& key, const toml::node& node, const Context& context);

/// A value of a scene's key, as its author wrote it: a whole number stays one.
Value check_case_value(const std::string& name, const toml::node& node, const Context& context) {
  const std::string none;
  const std::string where = context.source.at(node);
  Value value = check(scene_key(name, where), node, Context{context.source, none, context.beside});
  if (node.is_integer()) return static_cast<long>(**node.as_integer());
  return value;
}

/// `name`: what the value is called in a complaint of its type.
Value check_one(const Key& key, const toml::node& node, const Context& context,
                const std::string& name) {
  const std::string where = context.source.at(node), full = context.prefix + key.name;
  switch (key.type) {
    case Key::Type::real: {
      const auto value = node.is_integer() ? static_cast<double>(**node.as_integer())
                                           : typed<double>(name, node, where, "a number");
      check_bounds(key, full, value, where);
      return value;
    }
    case Key::Type::integer: {
      const auto value = typed<std::int64_t>(name, node, where, "an integer");
      check_bounds(key, full, static_cast<double>(value), where);
      return static_cast<long>(value);
    }
    case Key::Type::boolean:
      return typed<bool>(name, node, where, "true or false");
    case Key::Type::choice: {
      const auto value = typed<std::string>(name, node, where, "a string");
      if (std::ranges::find(key.choices, value) == key.choices.end())
        refuse(where, "unknown {} '{}' (known: {}).{}", full, value, fmt::join(key.choices, ", "),
               suggestion(value, key.choices));
      return value;
    }
    case Key::Type::table: {
      if (!node.is_table()) refuse(where, "{} must be a table, not {}", name, kind_of(node));
      const std::string inner = full + ".";
      GivenValues given;
      take(key.keys, *node.as_table(), context.source, inner, given);
      return complete(key.keys, given, where, inner);
    }
    case Key::Type::case_key: {
      const auto value = typed<std::string>(name, node, where, "a string");
      scene_key(value, where);
      return value;
    }
    case Key::Type::case_value:
      return check_case_value(context.beside(key.of), node, context);
    case Key::Type::assignment: {
      const auto value = typed<std::string>(name, node, where, "a string");
      check_assignment(value, where);
      return value;
    }
    case Key::Type::text:
      break;
  }
  return typed<std::string>(name, node, where, "a string");
}

std::vector<Value> check_list(const Key& key, const toml::node& node, const Context& context,
                              const std::string& name,
                              const std::function<Value(const toml::node&)>& check_item) {
  const auto* array = node.as_array();
  if (!array || array->size() < key.least || array->size() > key.most) {
    const bool tables = key.type == Key::Type::table;
    const std::string wanted = tables ? fmt::format("tables, [[{}]]", name)
                               : key.least == key.most
                                   ? fmt::format("a list of {} values", key.least)
                               : key.least == 0 ? "a list"
                                                : "a list of at least one value";
    refuse(context.source.at(node), "{} must be {}, not {}", name, wanted,
           array && !array->empty() ? fmt::format("one of {}", array->size()) : kind_of(node));
  }
  std::vector<Value> values;
  for (const toml::node& item : *array) values.push_back(check_item(item));
  return values;
}

/// A table whose keys are the author's, among those that the schema lets him choose from.
Values check_named(const Key& key, const toml::node& node, const Context& context) {
  const std::string full = context.prefix + key.name;
  if (!node.is_table())
    refuse(context.source.at(node), "{} must be a table, not {}", full, kind_of(node));
  Values values;
  values.free = true;
  for (const auto& entry : in_order(*node.as_table())) {
    const std::string &name = entry.first, inner = fmt::format("{}.{}", full, name);
    const toml::node& value = *entry.second;
    const std::string where = context.source.at(value);
    const bool of_case = key.type == Key::Type::case_value;
    if (of_case)
      scene_key(name, where);
    else if (std::ranges::find(key.choices, name) == key.choices.end())
      refuse(where, "unknown key '{}' (known: {}).{}", inner, fmt::join(key.choices, ", "),
             suggestion(name, key.choices));
    const auto check_item = [&](const toml::node& item) {
      return of_case ? check_case_value(name, item, context) : check_one(key, item, context, inner);
    };
    values.set(name,
               key.shape == Key::Shape::named
                   ? check_item(value)
                   : Value(check_list(key, value, context, inner, check_item)),
               where);
  }
  return values;
}

Value check(const Key& key, const toml::node& node, const Context& context) {
  const std::string full = context.prefix + key.name;
  switch (key.shape) {
    case Key::Shape::one:
      return check_one(key, node, context, full);
    case Key::Shape::list:
      return check_list(key, node, context, full, [&](const toml::node& item) {
        return check_one(key, item, context,
                         key.type == Key::Type::table ? full : "each of " + full);
      });
    default:
      return check_named(key, node, context);
  }
}

/// Takes one level of the tables in which the file's keys stand.
void take_level(const std::vector<Key>& keys, const toml::table& table, const std::string& level,
                const Context& context, GivenValues& given) {
  for (const auto& [name, node] : in_order(table)) {
    const std::string dotted = level + name, where = context.source.at(*node);
    const auto key = std::ranges::find_if(
        keys, [&](const Key& one) { return one.name == dotted && one.exists(context.beside); });
    if (key != keys.end()) {
      given.insert({dotted,
                    {check(*key, *node, context), where,
                     std::filesystem::path(context.source.name).parent_path()}});
      continue;
    }
    const bool table_of_keys =
        std::ranges::any_of(keys, [&](const Key& one) { return one.table() == dotted; });
    if (const auto* inner = node->as_table(); inner && table_of_keys)
      take_level(keys, *inner, dotted + ".", context, given);
    else
      refuse_key(keys, where, context.prefix, node->is_table() ? dotted + "." : dotted);
  }
}

[[noreturn]] void refuse_lack(const Key& key, const std::string& where, const std::string& prefix) {
  const std::string name = prefix + key.name;
  if (key.type == Key::Type::table && key.shape == Key::Shape::list)
    refuse(where, "missing key '{0}' (at least one [[{0}]]: {1})", name, key.doc);
  refuse(where, "missing key '{}' ({})", name, key.doc);
}

}  // namespace

void take(const std::vector<Key>& keys, const toml::table& table, const Source& source,
          const std::string& prefix, GivenValues& given) {
  std::function<std::string(const std::string&)> beside;
  const Context context{source, prefix, beside};
  // Which keys there are may hang on the value of one of them; that one is checked first.
  beside = [&](const std::string& other) {
    const Key& key = *find_key(keys, other);
    const auto node = table.at_path(other);
    if (node) return std::get<std::string>(check(key, *node.node(), context));
    if (!key.standard) refuse_lack(key, prefix.empty() ? source.name : source.at(table), prefix);
    return std::get<std::string>(*key.standard);
  };
  take_level(keys, table, "", context, given);
}

Values complete(const std::vector<Key>& keys, const GivenValues& given, const std::string& where,
                const std::string& prefix) {
  const auto beside = [&](const std::string& other) {
    if (const auto found = given.find(other); found != given.end())
      return std::get<std::string>(found->second.value);
    const Key& key = *find_key(keys, other);
    if (!key.standard) refuse_lack(key, where, prefix);
    return std::get<std::string>(*key.standard);
  };
  Values values;
  values.source = where;
  for (const Key& key : keys) {
    if (!key.exists(beside)) continue;
    if (const auto found = given.find(key.name); found != given.end())
      values.set(key.name, found->second.value, found->second.where);
    else if (key.standard)
      values.set(key.name, *key.standard, "");
    else if (!key.optional)
      refuse_lack(key, where, prefix);
  }
  return values;
}

std::pair<std::string, Value> check_assignment(const std::string& text, const std::string& where) {
  const auto equals = text.find('=');
  if (equals == std::string::npos) refuse(where, "no value (write key=value)");
  const std::string name = text.substr(0, equals), given = text.substr(equals + 1);
  const Key& key = scene_key(name, where);
  toml::table parsed;
  try {
    if (!too_deep(given)) parsed = toml::parse("value = " + given);
  } catch (const toml::parse_error&) {
    parsed.clear();
  }
  if (!parsed.contains("value")) parsed.insert("value", given);
  const bool textual = key.type == Key::Type::text || key.type == Key::Type::choice;
  if (textual && !parsed.get("value")->is_string()) parsed.insert_or_assign("value", given);
  const Source source{where, false};
  const std::string none;
  return {name, check(key, *parsed.get("value"), Context{source, none, {}})};
}

}  // namespace grainpair
