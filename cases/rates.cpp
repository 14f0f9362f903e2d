#include "cases/rates.hpp"

#include <toml++/toml.h>

#include <stdexcept>
#include <vector>

namespace grainpair {

extern const char* const rates;      // the text of cases/rates.toml
extern const char* const softening;  // and of cases/softening.toml

double measured(const std::string& name) {
  static const toml::table table = toml::parse(rates);
  const auto value = table.at_path(name).value<double>();
  if (!value) throw std::logic_error("cases/rates.toml: no number '" + name + "'");
  return *value;
}

double softening_error(const std::string& law, double weight) {
  static const toml::table table = toml::parse(softening);
  const auto row = [&](const std::string& name) {
    const toml::array* const values = table.at_path(name).as_array();
    if (!values) throw std::logic_error("cases/softening.toml: no list '" + name + "'");
    std::vector<double> out;
    for (const toml::node& value : *values) out.push_back(value.value<double>().value());
    return out;
  };
  const std::vector<double> weights = row("weight"), errors = row("error." + law);
  double before = 0.0, error_before = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weight <= weights[i])
      return error_before + (errors[i] - error_before) * (weight - before) / (weights[i] - before);
    before = weights[i], error_before = errors[i];
  }
  return error_before * weight / before;
}

}  // namespace grainpair
