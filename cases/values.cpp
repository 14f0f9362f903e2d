#include "cases/values.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace grainpair {
namespace {

/// The list's tables; none where it is a list of values.
std::vector<const Values*> tables_of(const Value& value) {
  std::vector<const Values*> tables;
  if (const auto* list = std::get_if<std::vector<Value>>(&value))
    for (const Value& item : *list)
      if (const auto* table = std::get_if<Values>(&item)) tables.push_back(table);
  return tables;
}

}  // namespace

const Entry* Values::find(const std::string& key) const {
  const auto found = std::ranges::find(entries_, key, &Entry::key);
  return found == entries_.end() ? nullptr : &*found;
}

const Entry& Values::at(const std::string& key) const {
  const Entry* found = find(key);
  if (!found) throw std::logic_error("the schema has no key '" + key + "'");
  return *found;
}

template <class T>
const T& Values::get(const std::string& key) const {
  const T* value = std::get_if<T>(&at(key).value);
  if (!value) throw std::logic_error("the schema has another type for '" + key + "'");
  return *value;
}

double Values::number(const std::string& key) const {
  const auto* whole = std::get_if<long>(&at(key).value);
  return whole ? static_cast<double>(*whole) : get<double>(key);
}

long Values::integer(const std::string& key) const { return get<long>(key); }

bool Values::flag(const std::string& key) const { return get<bool>(key); }

const std::string& Values::word(const std::string& key) const { return get<std::string>(key); }

std::vector<double> Values::numbers(const std::string& key) const {
  std::vector<double> numbers;
  for (const Value& item : get<std::vector<Value>>(key)) numbers.push_back(std::get<double>(item));
  return numbers;
}

std::vector<std::string> Values::words(const std::string& key) const {
  std::vector<std::string> words;
  for (const Value& item : get<std::vector<Value>>(key))
    words.push_back(std::get<std::string>(item));
  return words;
}

const Values& Values::table(const std::string& key) const { return get<Values>(key); }

std::vector<Values> Values::tables(const std::string& key) const {
  std::vector<Values> tables;
  for (const Value& item : get<std::vector<Value>>(key)) tables.push_back(std::get<Values>(item));
  return tables;
}

bool Values::given(const std::string& key) const { return has(key) && !at(key).where.empty(); }

const std::string& Values::where(const std::string& key) const {
  return given(key) ? at(key).where : source;
}

void Values::set(const std::string& key, Value value, const std::string& where) {
  const auto found = std::ranges::find(entries_, key, &Entry::key);
  if (found == entries_.end())
    entries_.push_back({key, std::move(value), where});
  else
    *found = {key, std::move(value), where};
}

std::string Values::as_toml(const std::string& table) const {
  // What stands below another heading comes after what stands below this one.
  std::string text, below, heading = table;
  const std::string prefix = table.empty() ? "" : table + ".";
  for (const auto& [key, value, where] : entries_) {
    const std::string name = prefix + key;
    if (const auto tables = tables_of(value); !tables.empty()) {
      for (const Values* one : tables)
        below += fmt::format("\n[[{}]]\n", name) + one->as_toml(name);
      continue;
    }
    if (const auto* one = std::get_if<Values>(&value); one && !one->free) {
      below += fmt::format("\n[{}]\n", name) + one->as_toml(name);
      continue;
    }
    const auto dot = name.rfind('.');
    const std::string own = dot == std::string::npos ? "" : name.substr(0, dot);
    if (own != heading) text += fmt::format("\n[{}]\n", heading = own);
    text += fmt::format("{} = {}\n", name.substr(dot + 1), grainpair::as_toml(value));
  }
  return text + below;
}

std::string Values::in_braces() const {
  std::vector<std::string> items;
  for (const auto& [key, value, where] : entries_)
    items.push_back(grainpair::as_toml(Value(key)) + " = " + grainpair::as_toml(value));
  return fmt::format("{{ {} }}", fmt::join(items, ", "));
}

std::string as_toml(const Value& value) {
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
  if (const auto* whole = std::get_if<long>(&value)) return fmt::format("{}", *whole);
  std::vector<std::string> items;
  if (const auto* list = std::get_if<std::vector<Value>>(&value)) {
    for (const Value& item : *list) items.push_back(as_toml(item));
    return fmt::format("[{}]", fmt::join(items, ", "));
  }
  return std::get<Values>(value).in_braces();
}

}  // namespace grainpair
