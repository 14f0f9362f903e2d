// What material points tell of themselves, and what they do not.
#include <cmath>

#include "compare/mapping/run_file.hpp"

namespace grainpair {

void RunFile::read_state(const Points& points, Cloud& c) const {
  const std::string& at = points.at;
  const std::size_t count = points.count;
  const auto& which = points.moving;
  const auto state = [&](const std::string& name) {
    const std::string record = name.substr(0, name.find('/'));
    if (!file_.has(at + record))
      return std::vector<double>(which.size(), std::numeric_limits<double>::quiet_NaN());
    return pick(file_.read(at + name, count), which);
  };
  c.void_ratio = state("void_ratio");
  c.granular_temperature = state("granular_temperature");
  if (file_.has(at + "volume")) c.volume = pick(positive(at + "volume", count), which);
  std::array<std::vector<double>, 6> s;
  constexpr std::array names{"xx", "yy", "zz", "xy", "yz", "zx"};
  for (std::size_t i = 0; i < 6; ++i) s[i] = state(std::string("stress/") + names[i]);
  c.untold = untold(points, c);
  for (std::size_t p = 0; p < c.size(); ++p) {
    Mat3 m;
    m << s[0][p], s[3][p], s[5][p], s[3][p], s[1][p], s[4][p], s[5][p], s[4][p], s[2][p];
    c.stress.push_back(from_matrix(m));
  }
}

std::vector<std::string> RunFile::untold(const Points& points, const Cloud& c) const {
  std::vector<std::string> out;
  const auto lack = [&](bool lacking, std::initializer_list<const char*> fields) {
    if (lacking) out.insert(out.end(), fields.begin(), fields.end());
  };
  const auto has = [&](const char* record) { return file_.has(points.at + record); };
  const bool solid = c.size() == 0 || !std::isnan(c.solid_volume.front());
  lack(!solid, {"solid_fraction", "void_ratio"});
  lack(!solid || !has("void_ratio"), {"void_ratio_state"});
  lack(!has("granular_temperature"), {"granular_temperature_state"});
  const bool bulk = has("volume") || (solid && has("void_ratio"));
  lack(!has("stress") || !bulk, {"stress_state", "pressure", "deviatoric_stress", "stress_ratio",
                                 "inertial_number", "stress_power"});
  // Points have a size, but it is not that of grains.
  const bool grains = scene_.has_case || file_.has_attribute("/", "diameter");
  lack(!grains || std::isnan(scene_.grain.density), {"inertial_number"});
  return out;
}

}  // namespace grainpair
