#include "cases/rates.hpp"

#include <toml++/toml.h>

#include <stdexcept>

namespace grainpair {

extern const char* const rates;  // the text of cases/rates.toml

double measured(const std::string& name) {
  static const toml::table table = toml::parse(rates);
  const auto value = table.at_path(name).value<double>();
  if (!value) throw std::logic_error("cases/rates.toml: no number '" + name + "'");
  return *value;
}

}  // namespace grainpair
