#include "cases/hints.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <numeric>
#include <set>
#include <utility>

namespace grainpair {
namespace {

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

}  // namespace

void refuse_line(const std::string& where, const std::string& what) {
  std::string line = where + ": " + what;
  std::ranges::replace_if(
      line, [](unsigned char c) { return c < ' ' || c == 0x7f; }, ' ');
  throw CaseError(line);
}

std::string suggestion(const std::string& word, const std::vector<std::string>& known) {
  const std::size_t most = std::max<std::size_t>(2, word.size() / 3);
  const std::string* nearest = nullptr;
  std::size_t least = most + 1;
  for (const std::string& candidate : known) {
    const std::size_t a = word.size(), b = candidate.size();
    if ((a > b ? a - b : b - a) >= least)
      continue;  // at least as many insertions, whatever the letters
    if (const std::size_t apart = distance(word, candidate); apart < least)
      least = apart, nearest = &candidate;
  }
  return nearest ? fmt::format(" Did you mean '{}'?", *nearest) : "";
}

void refuse_key(const std::vector<Key>& keys, const std::string& where, const std::string& prefix,
                const std::string& name) {
  if (const std::string* now = successor(name); now && &keys == &schema())
    refuse(where, "'{}' is no more (a key of earlier versions). Write {}", name, *now);
  Key asked;
  asked.name = name;
  std::vector<std::string> siblings, namesakes;
  std::set<std::string> tables;
  for (const Key& key : keys) {
    if (key.name == name)
      for (const auto& [other, values] : key.when)
        refuse(where, "unknown key '{}' (it goes with {}{} = {} alone)", prefix + name, prefix,
               other, fmt::join(values, " | "));
    tables.insert(key.type == Key::Type::table ? key.name : key.table());
    if (key.table() == asked.table() && std::ranges::count(siblings, key.leaf()) == 0)
      siblings.push_back(key.leaf());
    if (key.leaf() == asked.leaf()) namesakes.push_back(key.name);
  }
  tables.erase("");
  if (siblings.empty() || asked.table().empty()) {
    const std::string table = asked.table().empty() ? name : asked.table();
    if (tables.contains(table))
      refuse(where, "'{0}' is a table, not a value (its keys stand under [{0}])", prefix + table);
    std::vector<std::string> known = siblings;
    std::ranges::copy_if(tables, std::back_inserter(known), [&](const std::string& one) {
      return std::ranges::count(siblings, one) == 0;
    });
    refuse(where, "unknown {} '{}' (known: {}).{}", asked.table().empty() ? "key" : "table",
           prefix + table, fmt::join(known, ", "), suggestion(table, known));
  }
  std::string hint = suggestion(asked.leaf(), siblings);
  if (hint.empty() && !namesakes.empty())
    hint = fmt::format(" Did you mean '{}'?", namesakes.front());
  refuse(where, "unknown key '{}' (known: {}).{}", prefix + name, fmt::join(siblings, ", "), hint);
}

}  // namespace grainpair
