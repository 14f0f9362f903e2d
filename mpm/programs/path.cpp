#include "mpm/programs/path.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>

#include "cases/kinds.hpp"
#include "mpm/programs/law_alone.hpp"

namespace grainpair {
namespace {

/// Components xx yy zz xy yz zx as a tensor.
SymTensor tensor(const std::vector<double>& components) {
  SymTensor t;
  for (Eigen::Index i = 0; i < 6; ++i)
    t[i] = (i < 3 ? 1.0 : std::numbers::sqrt2) * components[static_cast<std::size_t>(i)];
  return t;
}

Leg read_leg(const Values& given) {
  using Kind = Leg::Kind;
  static const std::map<std::string, Kind> kinds{{"strain", Kind::strain},
                                                 {"isotropic", Kind::isotropic},
                                                 {"simple_shear", Kind::simple_shear},
                                                 {"triaxial", Kind::triaxial},
                                                 {"biaxial", Kind::biaxial},
                                                 {"rest", Kind::rest}};
  Leg leg;
  leg.kind = kinds.at(given.word("path"));
  leg.steps = given.integer("steps");
  if (given.has("duration")) leg.duration = given.number("duration");
  if (leg.kind == Kind::rest) return leg;
  if (leg.kind == Kind::strain) {
    leg.rate = tensor(given.numbers("rate"));
    return leg;
  }
  const double rate = given.number("rate"), strain = given.number("strain");
  const double signed_rate = std::copysign(rate, strain);
  leg.duration = std::abs(strain) / rate;
  if (given.has("cycles")) leg.cycles = static_cast<int>(given.integer("cycles"));
  switch (leg.kind) {
    case Kind::isotropic:
      leg.rate = signed_rate / 3.0 * identity();
      break;
    case Kind::simple_shear:
      // du_x/dy = -rate: D_xy = rate/2 (compression positive), W_xy = -rate/2
      leg.rate[3] = signed_rate / std::numbers::sqrt2;
      leg.spin[2] = 0.5 * signed_rate;
      leg.constant_stress = given.word("constant") == "stress";
      break;
    default:  // triaxial, biaxial
      leg.rate[1] = signed_rate;
      leg.constant_stress = true;
  }
  return leg;
}

}  // namespace

PointPath PointPath::load(const std::string& path, const std::vector<std::string>& overrides) {
  const Document file = read_document(path, Kind::point);
  const Values &values = file.values, &start = values.table("start");

  std::vector<std::string> set = law_alone;
  if (values.has("set"))
    for (const std::string& word : values.words("set")) set.push_back(word);
  set.insert(set.end(), overrides.begin(), overrides.end());
  // the law's reference volume is that of the start
  if (start.has("void_ratio"))
    set.push_back(fmt::format("initial.void_ratio={}", start.number("void_ratio")));

  PointPath result;
  const auto scene = std::filesystem::path(path).parent_path() / values.word("case");
  result.material = Case::load(scene.string(), set);
  result.text = file.text;
  result.every = values.integer("every");
  const auto of_start = [&](const std::string& key) {
    return start.has(key) ? start.number(key) : result.material.number("initial." + key);
  };
  result.void_ratio = of_start("void_ratio");
  result.granular_temperature = of_start("granular_temperature");
  result.stress = start.has("stress") ? tensor(start.numbers("stress"))
                                      : SymTensor(start.number("pressure") * identity());
  for (const Values& leg : values.tables("leg")) result.legs.push_back(read_leg(leg));
  return result;
}

}  // namespace grainpair
