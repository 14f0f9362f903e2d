// A scene's case file, checked and complete: every key of cases/schema.toml has a value of its
// declared type, in bounds.
#pragma once

#include <string>
#include <vector>

#include "cases/failure.hpp"
#include "cases/stiffness.hpp"
#include "cases/together.hpp"
#include "cases/values.hpp"

namespace grainpair {

class Case {
 public:
  /// Reads `path` (a file, or a folder that holds case.toml), what it extends and its material
  /// card, applies `overrides` ("mpm.cell_size=0.002"), checks all of it against the schema, fills
  /// in the defaults, derives what the grains determine and softens what mpm.stiffness and
  /// dem.stiffness say. A key is taken from the first that gives it: override, file, extended
  /// files, card, default. Throws CaseError.
  static Case load(const std::string& path, const std::vector<std::string>& overrides = {});

  // Values by dotted key, e.g. number("geometry.height"). A key the schema lacks throws
  // std::logic_error.
  double number(const std::string& key) const { return values_.number(key); }  // also of integers
  long integer(const std::string& key) const { return values_.integer(key); }
  bool flag(const std::string& key) const { return values_.flag(key); }
  const std::string& word(const std::string& key) const { return values_.word(key); }
  std::vector<double> numbers(const std::string& key) const { return values_.numbers(key); }
  bool has(const std::string& key) const { return values_.has(key); }
  const std::string& where(const std::string& key) const { return values_.where(key); }
  /// Whether a layer flows down a plane, in place of a column that collapses.
  bool chute() const { return is_chute(values_); }
  /// Whether the column stands in a silo and leaves by the orifice in its bottom.
  bool silo() const { return is_silo(values_); }

  /// The complete case as TOML, defaults and overrides included, the law's constants not softened;
  /// itself a case file that resolves to the same.
  const std::string& resolved() const { return resolved_; }
  /// The file as its author wrote it.
  const std::string& text() const { return text_; }
  const std::string& path() const { return path_; }
  /// What contradicts the grains without being wrong in itself (cases/constants.hpp), a line each.
  const std::vector<std::string>& contradictions() const { return contradictions_; }
  /// What was made of the stiffness of continuum and grains.
  const Stiffnesses& stiffness() const { return stiffness_; }

 private:
  std::string path_, text_, resolved_;
  Values values_;
  Stiffnesses stiffness_;
  std::vector<std::string> contradictions_;
};

}  // namespace grainpair
