// What no single key can tell.
#include "cases/together.hpp"

#include "cases/hints.hpp"

namespace grainpair {

namespace {

constexpr double least_restitution = 0.06;  // that of grains.restitution, for the engine's damping

}  // namespace

void check_scene(const Values& c) {
  const auto where = [&](const std::string& key) { return c.where(key); };
  const auto pair = [&](const std::string& choice, const std::string& with,
                        const std::string& value) {
    if (c.word(choice) == with && !c.given(value))
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
  if (const double e = c.number("walls.restitution"); e > 0.0 && e < least_restitution)
    refuse(where("walls.restitution"),
           "walls.restitution = {:g} is out of bounds (outside {:g} .. 1; 0 means "
           "grains.restitution)",
           e, least_restitution);
  if (c.word("geometry.dimension") == "axisymmetric" && c.word("walls.front_back") == "periodic")
    refuse(where(c.given("walls.front_back") ? "walls.front_back" : "geometry.dimension"),
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

void check_point(const Values& path) {
  const Values& start = path.table("start");
  bool stressed = start.number("pressure") != 0.0;
  if (start.has("stress"))
    for (const double component : start.numbers("stress")) stressed |= component != 0.0;
  for (const Values& leg : path.tables("leg")) {
    if (leg.has("strain") && leg.number("strain") == 0.0)
      refuse(leg.where("strain"), "leg.strain = 0 goes nowhere (negative: unloading)");
    const std::string& kind = leg.word("path");
    const bool holds = kind == "triaxial" || kind == "biaxial" ||
                       (kind == "simple_shear" && leg.word("constant") == "stress");
    if (holds && !stressed)
      refuse(leg.where("path"),
             "this leg holds a stress that is zero (give [start] a pressure or a stress)");
  }
}

}  // namespace grainpair
