#include "mpm/simulation_setup.hpp"

namespace grainpair {

namespace {

template <class Enum>
Enum choice(const std::string& word, std::initializer_list<std::pair<const char*, Enum>> names) {
  for (const auto& [name, value] : names)
    if (word == name) return value;
  throw std::logic_error("choice '" + word + "' is in the schema and not in the solver");
}

Numerics numerics_of(const Case& scene) {
  return {
      .h = scene.number("mpm.cell_size"),
      .transfer = choice<TransferScheme>(scene.word("mpm.transfer"), {{"pic", TransferScheme::pic},
                                                                      {"flip", TransferScheme::flip},
                                                                      {"apic", TransferScheme::apic},
                                                                      {"affine_flip", TransferScheme::affine_flip},
                                                                      {"xpic", TransferScheme::xpic}}),
      .relaxation_time = scene.number("mpm.relaxation_time"),
      .gradient_relaxation_time = scene.number("mpm.gradient_relaxation_time"),
      .xpic_order = static_cast<int>(scene.integer("mpm.xpic_order")),
      .stress_update = choice<StressUpdate>(scene.word("mpm.stress_update"), {{"first", StressUpdate::first},
                                                                              {"last", StressUpdate::last},
                                                                              {"musl", StressUpdate::musl}}),
      .averaging = choice<VolumetricAveraging>(scene.word("mpm.volumetric_averaging"),
                                               {{"none", VolumetricAveraging::none},
                                                {"cell", VolumetricAveraging::cell},
                                                {"nodal", VolumetricAveraging::nodal}}),
      .time_step_fraction = scene.number("mpm.time_step_fraction"),
  };
}

}  // namespace

double time_scale(const Case& scene) {
  return std::sqrt(scene.number("geometry.height") / scene.number("geometry.gravity"));
}

std::unique_ptr<Simulation> make_simulation(const Case& scene, unsigned seed) {
  const Numerics numerics = numerics_of(scene);
  const std::string& kinematics = scene.word("geometry.dimension");
  if (kinematics == "axisymmetric") return make_column<Axisymmetric>(scene, numerics, seed);
  if (kinematics == "three_dimensional") return make_column<ThreeDimensional>(scene, numerics, seed);
  return make_column<PlaneStrain>(scene, numerics, seed);
}

}  // namespace grainpair
