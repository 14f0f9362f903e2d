#include "mpm/step/simulation.hpp"

#include <fmt/format.h>

#include "cases/memory.hpp"
#include "cases/rates.hpp"
#include "mpm/step/column.hpp"

namespace grainpair {

namespace {

template <class Enum>
Enum choice(const std::string& word, std::initializer_list<std::pair<const char*, Enum>> names) {
  for (const auto& [name, value] : names)
    if (word == name) return value;
  throw std::logic_error("choice '" + word + "' is in the schema and not in the solver");
}

Numerics numerics_of(const Case& scene) {
  const double h = scene.number("mpm.cell_size"), H = scene.number("geometry.height");
  const double fall = time_scale(scene), crossing = fall * h / H;  // sqrt(H/g), h/sqrt(g H) [s]
  return {
      .h = h,
      .transfer = choice<TransferScheme>(scene.word("mpm.transfer"),
                                         {{"pic", TransferScheme::pic},
                                          {"flip", TransferScheme::flip},
                                          {"apic", TransferScheme::apic},
                                          {"affine_flip", TransferScheme::affine_flip},
                                          {"xpic", TransferScheme::xpic}}),
      .velocity_relaxation = scene.number("mpm.velocity_relaxation") * fall,
      .gradient_relaxation = scene.number("mpm.gradient_relaxation") * fall,
      .most_own_speed = H / fall,  // half of the energy of a fall from the top
      .void_ratio_relaxation = scene.number("mpm.void_ratio_relaxation") * crossing,
      .volume_relaxation = scene.number("mpm.volume_relaxation"),
      .xpic_order = static_cast<int>(scene.integer("mpm.xpic_order")),
      .stress_update =
          choice<StressUpdate>(scene.word("mpm.stress_update"), {{"first", StressUpdate::first},
                                                                 {"last", StressUpdate::last},
                                                                 {"musl", StressUpdate::musl}}),
      .averaging = scene.word("mpm.volumetric_averaging") == "cell",
      .conduction = scene.flag("material.conduction"),
      .time_step_fraction = scene.number("mpm.time_step_fraction"),
  };
}

/// Refuses a start that the case does not ask for, or a packing of another column.
void check(const Start& start, const Case& scene) {
  const bool asked = scene.word("initial.state") == "packing";
  if (asked && !start.packing)
    throw CaseError(
        fmt::format("{}: initial.state: no packing (the points are to start from settled grains) "
                    "give the result of a grain "
                    "run with --packing, or use `grainpair run`",
                    scene.path()));
  if (!start.packing) return;
  const Packing& packing = *start.packing;
  if (!asked)
    throw CaseError(fmt::format(
        "{}: initial.state is nominal (and {} was given as the packing) set it to packing",
        scene.path(), packing.path()));
  if (scene.word("geometry.dimension") == "axisymmetric")
    throw CaseError(fmt::format(
        "{}: initial.state: packings of axisymmetric columns are not mapped use nominal",
        scene.path()));
  const auto extent = packing.extent(scene.number("grains.density"));
  const std::array<const char*, 3> key{"geometry.length", "geometry.height", "geometry.thickness"};
  for (std::size_t d = 0; d < 3; ++d)
    if (std::abs(extent[d] - scene.number(key[d])) > 1e-6 * extent[d])
      throw CaseError(
          fmt::format("{}: {} = {:.6g} (the packing in {} has {:.6g}) give a packing of this case",
                      scene.path(), key[d], scene.number(key[d]), packing.path(), extent[d]));
}

/// Refuses too many ranks for a column.
void check(const Ranks& ranks, const Case& scene) {
  constexpr double least = 8.0;  // cells of a rank: else three would share nodes
  const double cells = scene.number("geometry.length") / scene.number("mpm.cell_size");
  if (cells < least * ranks.count())
    throw CaseError(fmt::format(
        "{}: --ranks {}: the column is {:.0f} cells long (a rank takes {:.0f} at least) take "
        "{:.0f} "
        "at most, or smaller mpm.cell_size",
        scene.path(), ranks.count(), cells, least, std::max(1.0, std::floor(cells / least))));
}

}  // namespace

double time_scale(const Case& scene) {
  return std::sqrt(scene.number("geometry.height") / scene.number("geometry.gravity"));
}

std::unique_ptr<Simulation> make_simulation(const Case& scene, const Start& start,
                                            const Ranks& ranks) {
  check(start, scene);
  if (ranks.many()) check(ranks, scene);
  const Numerics numerics = numerics_of(scene);
  const std::string& kinematics = scene.word("geometry.dimension");
  if (kinematics == "three_dimensional") return make_column<3>(scene, numerics, start, ranks);
  return make_column<2>(scene, numerics, start, ranks);
}

/// Steps land on the frames. They are bounded by what the stress at the start allows, shortened as
/// the law's flow is known to do, and by the speed of the fall.
Cost estimate(const Case& scene) {
  const Numerics numerics = numerics_of(scene);
  const bool space = scene.word("geometry.dimension") == "three_dimensional";
  const std::string& law = scene.word("material.law");
  Cost out = space ? cost_of_column<3>(scene, numerics) : cost_of_column<2>(scene, numerics);
  const double fall = std::sqrt(scene.number("geometry.gravity") * scene.number("geometry.height"));
  // A layer that flows is nowhere denser than at the start.
  const double shortening = scene.chute() ? 1.0 : measured("continuum.shortening." + law);
  const double step = std::min(out.time_step * shortening, 0.2 * numerics.h / fall);
  const double interval = scene.number("time.frame_interval"), tau = time_scale(scene);
  const double whole = std::floor(scene.number("time.maximum") / interval + 1e-9);
  const double rest = scene.number("time.maximum") - whole * interval;
  out.frames = whole + 1.0;
  out.steps =
      whole * std::ceil(interval * tau / step) + std::ceil(std::max(0.0, rest * tau / step - 1e-9));
  const auto points = static_cast<double>(out.points);
  out.disk = measured("continuum.disk_per_point") * out.frames * points;
  const double update = 1e-9 * measured("continuum.point_step." + law) *
                        (space ? measured("continuum.space_over_plane") : 1.0);
  out.seconds = out.steps * (measured("continuum.seconds_per_step") + update * points);
  // A run that is kept half-way is put together at its end from what was kept.
  const double kept_every = scene.number("output.checkpoint_interval");
  if (kept_every > 0.0 && out.seconds > kept_every) out.disk = 2.0 * (out.disk + out.bytes);
  return out;
}

void refuse_more_than_there_is(const Cost& cost, const Case& scene) {
  const double there = static_cast<double>(available_memory());
  if (cost.bytes <= there) return;
  throw CaseError(fmt::format(
      "{}: mpm.cell_size = {:g} m takes about {:.3g} GB of memory, for {:.3g} points and {:.3g} "
      "nodes (there are {:.3g} GB) choose larger cells, or fewer mpm.points_per_cell",
      scene.path(), scene.number("mpm.cell_size"), 1e-9 * cost.bytes,
      static_cast<double>(cost.points), static_cast<double>(cost.nodes), 1e-9 * there));
}

}  // namespace grainpair
