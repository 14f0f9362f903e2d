// What no single key can tell.
#include "cases/together.hpp"

#include <cmath>

#include "cases/hints.hpp"
#include "cases/schema.hpp"

namespace grainpair {
namespace {

/// What a scene that is no collapse may have of a choice.
void only(const Values& c, const char* key, const char* word, const char* why) {
  if (c.word(key) != word)
    refuse(c.where(key), "{} = \"{}\" contradicts geometry.scene = \"{}\" ({}; only \"{}\")", key,
           c.word(key), c.word("geometry.scene"), why, word);
}

/// A chute has neither gate, left wall nor end, and starts from its nominal state.
void check_chute(const Values& c) {
  only(c, "walls.left", "smooth", "it repeats along the flow and has no left wall");
  only(c, "walls.gate", "instantaneous", "it has no gate");
  only(c, "walls.front_back", "periodic", "it repeats across the flow");
  only(c, "initial.state", "nominal", "no packing of a chute is mapped");
  if (c.word("geometry.dimension") == "axisymmetric")
    refuse(
        c.where("geometry.dimension"),
        "geometry.dimension = \"axisymmetric\" contradicts geometry.scene = \"chute\" (a plane has "
        "no axis)");
  if (c.word("mpm.transfer") == "xpic")
    refuse(c.where("mpm.transfer"),
           "mpm.transfer = \"xpic\" contradicts geometry.scene = \"chute\" (its sweeps know no "
           "period)");
  if (c.has("geometry.floor_length"))
    refuse(c.where("geometry.floor_length"),
           "geometry.floor_length contradicts geometry.scene = \"chute\" (it repeats after "
           "geometry.length, and ends nowhere)");
  if (!c.has("geometry.inclination"))
    refuse(c.where("geometry.scene"), "missing key 'geometry.inclination' (angle of the chute)");
  const double h = c.number("mpm.cell_size"), cells = c.number("geometry.length") / h;
  constexpr double fewest = 6.0;  // beside the nodes that repeat (mpm/step/period.hpp)
  if (cells < fewest - 1e-9)
    refuse(
        c.where("mpm.cell_size"),
        "mpm.cell_size = {:g} is more than {:.3g} of geometry.length = {:g} (the period of a chute "
        "takes {:g} cells)",
        h, 1.0 / fewest, c.number("geometry.length"), fewest);
  if (std::abs(cells - std::round(cells)) > 1e-9 * cells)
    refuse(c.where("geometry.length"),
           "geometry.length = {:g} is no whole number of cells of {:g} (a chute repeats after it). "
           "Choose mpm.cell_size to divide it.",
           c.number("geometry.length"), h);
}

void check_collapse(const Values& c) {
  const char* end = "geometry.floor_length";
  if (c.has("geometry.inclination"))
    refuse(c.where("geometry.inclination"),
           "geometry.inclination = {:g} without geometry.scene = \"chute\" (a collapse has a level "
           "base)",
           c.number("geometry.inclination"));
  if (c.number("initial.velocity") > 0.0)
    refuse(c.where("initial.velocity"),
           "initial.velocity = {:g} without geometry.scene = \"chute\" (a column is let go from "
           "rest)",
           c.number("initial.velocity"));
  if (!c.has(end)) refuse(c.source, "missing key '{}' ({})", end, find_key(schema(), end)->doc);
}

/// A silo is a collapse that leaves by an orifice: its wall at x = L0 stays.
void check_silo(const Values& c) {
  for (const char* key : {"geometry.orifice", "geometry.fall"})
    if (!c.has(key))
      refuse(c.where("geometry.scene"), "missing key '{}' ({})", key, find_key(schema(), key)->doc);
  only(c, "walls.base", "coulomb", "its bottom and the floor below are plates");
  only(c, "walls.gate", "instantaneous", "its wall stays");
  only(c, "walls.front_back", "periodic", "its plates span a period");
  only(c, "initial.state", "nominal", "no packing in a silo is mapped");
  if (c.word("geometry.dimension") == "axisymmetric")
    refuse(c.where("geometry.dimension"),
           "geometry.dimension = \"axisymmetric\" contradicts geometry.scene = \"silo\" (its "
           "orifice is a slot)");
  const double half = c.number("geometry.orifice"), length = c.number("geometry.length");
  if (half >= length)
    refuse(c.where("geometry.orifice"),
           "geometry.orifice = {:g} is not shorter than geometry.length = {:g} (it would have no "
           "bottom)",
           half, length);
}

void check_no_silo(const Values& c) {
  for (const char* key : {"geometry.orifice", "geometry.fall"})
    if (c.has(key))
      refuse(c.where(key), "{} = {:g} without geometry.scene = \"silo\" (only a silo has it)", key,
             c.number(key));
}

bool is_scene(const Values& scene, const char* word) {
  return scene.has("geometry.scene") && scene.word("geometry.scene") == word;
}

}  // namespace

bool is_chute(const Values& scene) { return is_scene(scene, "chute"); }
bool is_silo(const Values& scene) { return is_scene(scene, "silo"); }

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
  const bool chute = is_chute(c);
  chute ? check_chute(c) : check_collapse(c);
  is_silo(c) ? check_silo(c) : check_no_silo(c);
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
  if (chute) return;
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
