// Values of an input file, checked against its schema and complete.
#pragma once

#include <string>
#include <variant>
#include <vector>

namespace grainpair {

struct Value;
struct Entry;

/// A table: values by dotted key, in the order of the schema. Asking for a key the schema lacks, or
/// for another type than it has, throws std::logic_error.
class Values {
 public:
  double number(const std::string& key) const;  // also reads integers
  long integer(const std::string& key) const;
  bool flag(const std::string& key) const;
  const std::string& word(const std::string& key) const;
  std::vector<double> numbers(const std::string& key) const;
  std::vector<std::string> words(const std::string& key) const;
  const Values& table(const std::string& key) const;
  std::vector<Values> tables(const std::string& key) const;

  bool has(const std::string& key) const { return find(key); }
  /// Whether somebody gave the value: it is no default.
  bool given(const std::string& key) const;
  /// Who gave it: "case.toml:12" or "--set grains.friction=0.4"; of a default, who gave none.
  const std::string& where(const std::string& key) const;

  void set(const std::string& key, Value value, const std::string& where);
  std::string source;  // where the table itself stands, "case.toml:9"
  bool free = false;   // its keys are the author's choice, and undotted

  /// The keys as TOML, below the heading of `table` ("" for a whole file).
  std::string as_toml(const std::string& table = "") const;
  /// The same between braces on one line, for a free table.
  std::string in_braces() const;

 private:
  const Entry* find(const std::string& key) const;
  const Entry& at(const std::string& key) const;
  template <class T>
  const T& get(const std::string& key) const;

  std::vector<Entry> entries_;
};

/// One value, a list of them, or a table.
struct Value : std::variant<double, long, bool, std::string, std::vector<Value>, Values> {
  using variant::variant;
};

struct Entry {
  std::string key;
  Value value;
  std::string where;  // empty: a default
};

/// A value as TOML writes it; reals in the fewest digits that read back to the same double.
std::string as_toml(const Value& value);

}  // namespace grainpair
