#include "cases/case.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <set>

#include "cases/schema.hpp"

namespace grainpair {
namespace {

namespace fs = std::filesystem;

/// Throws the one line; control characters in what the user wrote must not break it into two.
template <class... Args>
[[noreturn]] void refuse(const std::string& where, fmt::format_string<Args...> what,
                         Args&&... args) {
  std::string line = where + ": " + fmt::format(what, std::forward<Args>(args)...);
  std::ranges::replace_if(
      line, [](unsigned char c) { return c < ' ' || c == 0x7f; }, ' ');
  throw CaseError(line);
}

/// A value somebody gave, and where: "case.toml:12" or "--set grains.friction=0.4".
struct Given {
  Case::Value value;
  std::string where;
  fs::path folder;  // that relative paths in it start from
};
using GivenValues = std::map<std::string, Given>;

// --- suggestions
// -----------------------------------------------------------------------------------------------

/// Levenshtein distance: the fewest insertions, deletions and substitutions that turn a into b.
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0u);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({substituted, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

/// " Did you mean 'friction'?" if a known word is near enough for a slip of the keyboard, else "".
std::string suggestion(const std::string& word, const std::vector<std::string>& known) {
  const auto nearest = std::ranges::min_element(
      known, {}, [&](const std::string& candidate) { return distance(word, candidate); });
  if (nearest == known.end() ||
      distance(word, *nearest) > std::max<std::size_t>(2, word.size() / 3))
    return "";
  return fmt::format(" Did you mean '{}'?", *nearest);
}

[[noreturn]] void refuse_key(const std::string& where, const std::string& name) {
  const Key asked{
      .name = name, .type = Key::Type::text, .unit = {}, .standard = {}, .choices = {}, .doc = {}};
  std::vector<std::string> siblings, namesakes;
  std::set<std::string> tables;
  for (const Key& key : schema()) {
    tables.insert(key.table());
    if (key.table() == asked.table()) siblings.push_back(key.leaf());
    if (key.leaf() == asked.leaf()) namesakes.push_back(key.name);
  }
  tables.erase("");
  if (siblings.empty() || asked.table().empty()) {
    const std::string table = asked.table().empty() ? name : asked.table();
    if (tables.contains(table))
      refuse(where, "'{0}' is a table, not a value (its keys stand under [{0}])", table);
    if (table == "element")
      refuse(where,
             "this is an element test, not a scene (no column). Run it with: grainpair element");
    std::vector<std::string> known = siblings;
    known.insert(known.end(), tables.begin(), tables.end());
    refuse(where, "unknown {} '{}' (known: {}).{}", asked.table().empty() ? "key" : "table", table,
           fmt::join(known, ", "), suggestion(table, known));
  }
  std::string hint = suggestion(asked.leaf(), siblings);
  if (hint.empty() && !namesakes.empty())
    hint = fmt::format(" Did you mean '{}'?", namesakes.front());
  refuse(where, "unknown key '{}' (known: {}).{}", name, fmt::join(siblings, ", "), hint);
}

// --- one value
// -------------------------------------------------------------------------------------------------

std::string kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return fmt::format("the string \"{}\"", **node.as_string());
    case toml::node_type::integer:
      return fmt::format("the integer {}", **node.as_integer());
    case toml::node_type::floating_point:
      return fmt::format("the real number {}", **node.as_floating_point());
    case toml::node_type::boolean:
      return **node.as_boolean() ? "true" : "false";
    default:
      return "a date or time";
  }
}

template <class T>
T typed(const Key& key, const toml::node& node, const std::string& where, const char* wanted) {
  const auto value = node.value_exact<T>();
  if (!value) refuse(where, "{} must be {}, not {}", key.name, wanted, kind_of(node));
  return *value;
}

/// " Is it in m? 1000 times less would fit." where a factor of 1000 explains the mistake.
std::string unit_hint(const Key& key, double value) {
  const auto fits = [&](double v) { return key.lower <= v && v <= key.upper; };
  if (key.unit.empty() || key.unit == "-" || key.unit == "steps") return "";
  const char* factor = fits(value / 1000) ? "less" : fits(value * 1000) ? "more" : nullptr;
  return factor ? fmt::format(" Is it in {}? 1000 times {} would fit.", key.unit, factor) : "";
}

void check_bounds(const Key& key, double value, const std::string& where) {
  const std::string unit = key.unit == "-" ? "" : " " + key.unit;
  if (!std::isfinite(value))
    refuse(where, "{} = {} is not a finite number ({})", key.name, value, key.doc);
  if (value < key.lower || value > key.upper)
    refuse(where, "{} = {:g}{} is out of bounds ({:g} to {:g}{}).{}", key.name, value, unit,
           key.lower, key.upper, unit, unit_hint(key, value));
}

Case::Value check(const Key& key, const toml::node& node, const std::string& where) {
  switch (key.type) {
    case Key::Type::real: {
      const auto value = node.is_integer() ? static_cast<double>(**node.as_integer())
                                           : typed<double>(key, node, where, "a number");
      check_bounds(key, value, where);
      return value;
    }
    case Key::Type::integer: {
      const auto value = typed<std::int64_t>(key, node, where, "an integer");
      check_bounds(key, static_cast<double>(value), where);
      return static_cast<long>(value);
    }
    case Key::Type::boolean:
      return typed<bool>(key, node, where, "true or false");
    case Key::Type::choice: {
      const auto value = typed<std::string>(key, node, where, "a string");
      if (std::ranges::find(key.choices, value) == key.choices.end())
        refuse(where, "unknown {} '{}' (known: {}).{}", key.name, value,
               fmt::join(key.choices, ", "), suggestion(value, key.choices));
      return value;
    }
    case Key::Type::text:
      break;
  }
  return typed<std::string>(key, node, where, "a string");
}

// --- files
// -----------------------------------------------------------------------------------------------------

std::string read_text(const std::string& path) {
  constexpr std::size_t limit = 1 << 20;
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string text(limit + 1, '\0');
  if (file) file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad() || !file.is_open() || errno == EISDIR)
    refuse(path, "cannot be read ({})", errno ? std::strerror(errno) : "unknown reason");
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.empty())
    refuse(path, "is empty (a case file holds at least geometry, grains, initial, material, mpm)");
  if (text.find('\0') != std::string::npos)
    refuse(path, "is not a case file (binary data, not text)");
  if (text.size() > limit) refuse(path, "is not a case file (longer than 1 MiB)");
  return text;
}

toml::table parse(const std::string& text, const std::string& path) {
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    refuse(fmt::format("{}:{}", path, error.source().begin.line), "not valid TOML ({})",
           error.description());
  }
}

/// Puts every value of `table` that is not given yet into `given`; all are checked, also those that
/// lose.
void take(const toml::table& table, const std::string& prefix, const std::string& path,
          GivenValues& given) {
  for (const auto& [name, node] : table) {
    const std::string dotted = prefix + std::string(name.str());
    const std::string where = fmt::format("{}:{}", path, node.source().begin.line);
    if (const Key* key = find_key(dotted)) {
      given.insert({dotted, {check(*key, node, where), where, fs::path(path).parent_path()}});
      continue;
    }
    const bool table_of_keys =
        std::ranges::any_of(schema(), [&](const Key& key) { return key.table() == dotted; });
    if (const auto* inner = node.as_table(); inner && table_of_keys)
      take(*inner, dotted + ".", path, given);
    else if (node.is_table())
      refuse_key(where, dotted + ".");
    else
      refuse_key(where, dotted);
  }
}

void take_override(const std::string& assignment, GivenValues& given) {
  const std::string where = "--set " + assignment;
  const auto equals = assignment.find('=');
  if (equals == std::string::npos) refuse(where, "no value (write --set key=value)");
  const std::string name = assignment.substr(0, equals), text = assignment.substr(equals + 1);
  const Key* key = find_key(name);
  if (!key) refuse_key(where, name);
  if (name == "extends")
    refuse(where, "only a file can extend another (name the other file as the case)");

  // What is no TOML value, or stands where text belongs, is a string without its quotes.
  toml::table parsed;
  try {
    parsed = toml::parse("value = " + text);
  } catch (const toml::parse_error&) {
    parsed.insert("value", text);
  }
  const bool textual = key->type == Key::Type::text || key->type == Key::Type::choice;
  if (textual && !parsed.get("value")->is_string()) parsed.insert_or_assign("value", text);
  given.insert_or_assign(name, Given{check(*key, *parsed.get("value"), where), where, fs::path()});
}

/// The file of a material card: a path that ends in .toml, or a name looked up in the `materials`
/// folder beside the case file or beside a folder above it.
fs::path find_card(const Given& card) {
  const std::string name = std::get<std::string>(card.value);
  if (name.ends_with(".toml")) return (card.folder / name).lexically_normal();
  const fs::path start = card.folder.empty() ? fs::path(".") : card.folder;
  for (fs::path folder = fs::absolute(start).lexically_normal();; folder = folder.parent_path()) {
    for (const char* place : {"materials", "cases/materials"})
      if (const fs::path file = folder / place / (name + ".toml"); fs::exists(file))
        return file.lexically_proximate(fs::current_path());
    if (folder == folder.root_path()) break;
  }
  refuse(card.where, "no material card '{0}' (no materials/{0}.toml beside {1} or above it). {2}",
         name, start.string(), "A card elsewhere is named by its path, ending in .toml.");
}

void take_card(GivenValues& given) {
  const auto card = given.find("material.card");
  if (card == given.end() || std::get<std::string>(card->second.value).empty()) return;
  const bool silent = std::ranges::any_of(schema(), [&](const Key& key) {
    return key.table() == "material" && !given.contains(key.name);
  });
  if (!silent) return;
  const std::string path = find_card(card->second).string();
  const toml::table table = parse(read_text(path), path);
  for (const auto& [name, node] : table)
    if (name != "material")
      refuse(fmt::format("{}:{}", path, node.source().begin.line),
             "'{}' does not belong in a material card (it holds a [material] table alone)",
             name.str());
  take(table, "", path, given);
}

// --- what no single key can tell
// -------------------------------------------------------------------------------

void check_together(const Case& c, const GivenValues& given, const std::string& path) {
  const auto where = [&](const std::string& key) {
    const auto found = given.find(key);
    return found == given.end() ? path : found->second.where;
  };
  const auto pair = [&](const std::string& choice, const std::string& with,
                        const std::string& value) {
    if (c.word(choice) == with && !given.contains(value))
      refuse(where(choice), "{} = \"{}\" without {} (it needs a value)", choice, with, value);
    if (c.word(choice) != with && c.number(value) > 0)
      refuse(where(value), "{} = {:g} contradicts {} = \"{}\" (only \"{}\" has it)", value,
             c.number(value), choice, c.word(choice), with);
  };
  pair("walls.base", "coulomb", "walls.base_friction");
  pair("walls.left", "coulomb", "walls.left_friction");
  pair("walls.gate", "lifted", "walls.gate_speed");
  if (c.word("walls.gate") == "lifted" && c.number("walls.gate_speed") == 0)
    refuse(where("walls.gate_speed"),
           "walls.gate_speed = 0 contradicts walls.gate = \"lifted\" (it would never open)");
  if (c.word("geometry.dimension") == "axisymmetric" && c.word("walls.front_back") == "periodic")
    refuse(where(given.contains("walls.front_back") ? "walls.front_back" : "geometry.dimension"),
           "walls.front_back = \"periodic\" contradicts geometry.dimension = \"axisymmetric\" (a "
           "wedge has no periodic "
           "image). Set it to \"smooth\".");

  const auto at_most = [&](const std::string& key, double factor, const std::string& of,
                           const char* why) {
    if (c.number(key) > factor * c.number(of))
      refuse(where(key), "{} = {:g} is more than {:g} of {} = {:g} ({})", key, c.number(key),
             factor, of, c.number(of), why);
  };
  const char* few_cells = "a column needs four cells each way";
  const char* few_grains = "a column needs four grains each way. Are both in m?";
  at_most("mpm.cell_size", 0.25, "geometry.length", few_cells);
  at_most("mpm.cell_size", 0.25, "geometry.height", few_cells);
  at_most("grains.diameter", 0.25, "geometry.length", few_grains);
  at_most("grains.diameter", 0.25, "geometry.height", few_grains);
  const char* unit_mistake = "a scene that large never ends. Are both in m?";
  at_most("geometry.height", 1e4, "grains.diameter", unit_mistake);
  at_most("geometry.length", 1e4, "grains.diameter", unit_mistake);
  at_most("geometry.thickness", 1e4, "grains.diameter", unit_mistake);
  at_most("geometry.floor_length", 1e4, "mpm.cell_size", unit_mistake);
  if (c.number("geometry.floor_length") <= c.number("geometry.length"))
    refuse(where("geometry.floor_length"),
           "geometry.floor_length = {:g} is not longer than geometry.length = {:g} (the column has "
           "nowhere to go)",
           c.number("geometry.floor_length"), c.number("geometry.length"));
}

}  // namespace

Case Case::load(const std::string& path, const std::vector<std::string>& overrides) {
  Case result;
  result.path_ = fs::is_directory(path) ? (fs::path(path) / "case.toml").string() : path;

  GivenValues given;
  for (const auto& assignment : overrides) take_override(assignment, given);

  std::set<fs::path> seen;
  for (std::string file = result.path_; !file.empty();) {
    const std::string text = read_text(file);
    if (result.text_.empty()) result.text_ = text;
    seen.insert(fs::weakly_canonical(file));
    take(parse(text, file), "", file, given);

    const auto extends = given.extract("extends");
    file.clear();
    if (!extends || std::get<std::string>(extends.mapped().value).empty()) continue;
    const Given& base = extends.mapped();
    file = (base.folder / std::get<std::string>(base.value)).lexically_normal().string();
    if (seen.contains(fs::weakly_canonical(file)))
      refuse(base.where, "extends '{}', which extends this file in turn (a circle has no end)",
             file);
    if (!fs::exists(file)) refuse(base.where, "extends '{}', which does not exist", file);
  }
  take_card(given);

  for (const Key& key : schema()) {
    if (const auto found = given.find(key.name); found != given.end())
      result.values_[key.name] = found->second.value;
    else if (key.standard)
      result.values_[key.name] = *key.standard;
    else
      refuse(result.path_, "missing key '{}' ({})", key.name, key.doc);
  }
  check_together(result, given, result.path_);
  return result;
}

const Case::Value& Case::value(const std::string& key) const {
  const auto found = values_.find(key);
  if (found == values_.end()) throw std::logic_error("the schema has no key '" + key + "'");
  return found->second;
}

double Case::number(const std::string& key) const {
  const Value& v = value(key);
  return std::holds_alternative<long>(v) ? static_cast<double>(std::get<long>(v))
                                         : std::get<double>(v);
}

long Case::integer(const std::string& key) const { return std::get<long>(value(key)); }

bool Case::flag(const std::string& key) const { return std::get<bool>(value(key)); }

const std::string& Case::word(const std::string& key) const {
  return std::get<std::string>(value(key));
}

std::string Case::resolved() const {
  std::string text, table;
  for (const Key& key : schema()) {
    if (key.table() != table) {
      table = key.table();
      text += fmt::format("\n[{}]\n", table);
    }
    text += fmt::format("{} = {}\n", key.leaf(), as_toml(value(key.name)));
  }
  return text;
}

}  // namespace grainpair
