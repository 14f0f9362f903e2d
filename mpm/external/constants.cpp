#include "cases/hints.hpp"
#include "mpm/external/law.hpp"

namespace grainpair {

ExternalConstants::ExternalConstants(const Case& scene)
    : cell_size(scene.number("mpm.cell_size")),
      kirchhoff(scene.has("material.stress_measure") &&
                scene.word("material.stress_measure") == "kirchhoff"),
      separates(!scene.has("material.separates") || scene.flag("material.separates")),
      serial(scene.has("material.thread_safe") && !scene.flag("material.thread_safe")),
      umat(scene.word("material.interface") == "umat") {
  if (scene.has("material.constants")) numbers = scene.numbers("material.constants");
  if (scene.has("material.state_variables"))
    state_count = static_cast<int>(scene.integer("material.state_variables"));
  initial_state.assign(static_cast<std::size_t>(state_count), 0.0);
  if (scene.has("material.initial_state")) {
    const auto given = scene.numbers("material.initial_state");
    if (given.size() != initial_state.size())
      refuse(scene.where("material.initial_state"),
             "material.initial_state holds {} numbers (material.state_variables = {})",
             given.size(), state_count);
    initial_state = given;
  }
  if (!scene.has("material.void_ratio_state")) return;
  void_ratio_state = static_cast<std::size_t>(scene.integer("material.void_ratio_state"));
  if (void_ratio_state > initial_state.size())
    refuse(scene.where("material.void_ratio_state"),
           "material.void_ratio_state = {} (there are {} state variables)", void_ratio_state,
           state_count);
}

}  // namespace grainpair
