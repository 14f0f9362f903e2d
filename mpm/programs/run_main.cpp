// mpm_run CASE -o mpm.h5: the continuum side of a scene, from release to rest.
#include <fmt/format.h>
#include <omp.h>

#include <chrono>
#include <cstdio>

#include "cases/command_line.hpp"
#include "mpm/output/output.hpp"
#include "mpm/step/cost.hpp"
#include "mpm/step/simulation.hpp"
#include "mpm/step/timed.hpp"
#include "mpm/step/watch.hpp"

namespace {

using namespace grainpair;

/// Calls `work`, whose processor time is added to `to` [s].
void timed(double& to, auto&& work) {
  const Timed until_done(&to);
  work();
}

/// Progress lines for the launcher, at most ten a second.
class Progress {
 public:
  explicit Progress(bool on) : on_(on) {}
  void operator()(double fraction, const std::string& text) {
    const auto now = std::chrono::steady_clock::now();
    if (!on_ || (fraction < 1.0 && now - last_ < std::chrono::milliseconds(100))) return;
    last_ = now;
    best_ = std::max(best_, fraction);
    fmt::print("progress {:.4f} {}\n", best_, text);
    std::fflush(stdout);
  }

 private:
  bool on_;
  double best_ = 0.0;
  std::chrono::steady_clock::time_point last_{};
};

/// Output times k * interval, and a step that ends on the next one.
struct Clock {
  double interval, next;
  explicit Clock(double seconds) : interval(seconds), next(seconds) {}
  bool due(double time) {
    if (time < next * (1.0 - 1e-12)) return false;
    while (next <= time * (1.0 + 1e-12)) next += interval;
    return true;
  }
};

/// A step, one of the equal ones that land on the time `end`, of at most this share of the stable
/// one.
TimeStep step_towards(Simulation& simulation, double end, double share) {
  TimeStep step = simulation.stable_step();
  const double left = end - simulation.time();
  step.dt = left / std::ceil(left / (share * step.dt));
  simulation.step(step.dt);
  return step;
}

Watch watch_over(const Simulation& simulation, const Case& scene) {
  return {simulation,
          {scene.number("geometry.height"), scene.number("geometry.gravity"),
           scene.number("geometry.floor_length")},
          scene.number("mpm.cell_size")};
}

void tell(const Case& scene, const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings)
    fmt::print(stderr, "{}: warning: {}\n", scene.path(), warning);
}

void print(const Cost& cost) {
  fmt::print(
      "{{\"points\": {}, \"nodes\": {}, \"bytes\": {:.0f}, \"time_step\": {:.17g}, "
      "\"steps\": {:.0f}, \"frames\": {:.0f}, \"seconds\": {:.4g}, \"disk\": {:.0f}}}\n",
      cost.points, cost.nodes, cost.bytes, cost.time_step, cost.steps, cost.frames, cost.seconds,
      cost.disk);
}

void run(const Case& scene, const Start& start, const std::string& path,
         const Provenance& provenance, Progress progress) {
  for (const std::string& line : scene.contradictions()) fmt::print(stderr, "warning: {}\n", line);
  refuse_more_than_there_is(estimate(scene), scene);
  Draft draft(path);
  const auto wall_start = std::chrono::steady_clock::now();
  const auto simulation = make_simulation(scene, start);
  Output output(draft, scene, provenance);

  const double tau = time_scale(scene), end = scene.number("time.maximum") * tau;
  const double rest = scene.number("time.rest_kinetic_energy");
  Clock frames(scene.number("time.frame_interval") * tau),
      rows(scene.number("time.energy_interval") * tau), looks(Watch::interval * tau);
  // Above the claimed limit the step is asked for, and runs as long as it does.
  const bool asked_for = scene.number("mpm.time_step_fraction") > 1.0;
  std::string end_reason = "maximum";
  double peak = 0.0;
  long steps = 0;
  const EnergyLedger begin = simulation->ledger();
  Watch watch = watch_over(*simulation, scene);

  Spent spent{.setup = processor_seconds()};
  timed(spent.output, [&] {
    output.frame(*simulation, 0, 0.0);
    output.energies(*simulation, {});
  });
  while (simulation->time() < end * (1.0 - 1e-12)) {
    TimeStep step;
    double kinetic = 0.0;
    timed(spent.engine, [&] {  // with its own watch over itself
      step = step_towards(*simulation, std::min(frames.next, end),
                          asked_for ? 1.0 : watch.step_share());
      ++steps;
      kinetic = simulation->ledger().kinetic;
      watch.step(*simulation, steps);
    });
    const double time = simulation->time();
    peak = std::max(peak, kinetic);
    if (rows.due(time)) timed(spent.output, [&] { output.energies(*simulation, step); });
    if (looks.due(time)) timed(spent.engine, [&] { watch.points(*simulation); });
    const bool at_rest =
        kinetic < rest * peak && time > tau;  // the release itself starts from rest
    if (frames.due(time) || at_rest)
      timed(spent.output, [&] { output.frame(*simulation, steps, step.dt); });
    progress(time / end, fmt::format("t = {:.2f} sqrt(H/g), dt = {:.1e} s", time / tau, step.dt));
    if (at_rest) {
      end_reason = "rest";
      break;
    }
  }
  const auto wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start);
  const auto warnings = watch.warnings(begin, simulation->ledger());
  tell(scene, warnings);
  output.warnings(warnings);
  spent.whole = processor_seconds();
  output.finish(end_reason, spent, wall.count(), steps);
  progress(1.0, end_reason == "rest" ? "at rest" : "time.maximum reached");
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine line("Runs a case with the material point method.");
  std::string path, packing, out = "mpm.h5";
  std::vector<std::string> overrides;
  unsigned seed = 1;
  int threads = 1;
  bool show_progress = false, quiet = false, only_estimate = false;
  line.option("case", path, "case file, or the folder of its case.toml")
      .required()
      .option("-o,--out", out, "result file")
      .repeated("--set", overrides, "key=value, in place of what the case says")
      .option("--packing", packing, "result of a grain run, where initial.state = packing")
      .option("--seed", seed, "seed of mpm.jitter")
      .seed()
      .option("--threads", threads, "threads")
      .threads()
      .flag("--progress", show_progress, "progress lines on standard output")
      .flag("--quiet", quiet, "no summary at the end")
      .flag("--estimate", only_estimate,
            "print what the run would take as JSON, and run nothing: memory and disk in bytes, "
            "processor seconds");
  if (const auto done = line.parse(argc, argv)) return *done;
  omp_set_num_threads(threads);
  std::string command;
  for (int i = 0; i < argc; ++i) {
    if (i > 0) command += ' ';
    command += argv[i];
  }
  try {
    if (only_estimate) {
      print(estimate(Case::load(path, overrides)));
      return 0;
    }
    Start start{seed};
    if (!packing.empty()) start.packing.emplace(packing);
    run(Case::load(path, overrides), start, out, {command, seed, threads}, Progress(show_progress));
  } catch (const CaseError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "{}: out of memory choose larger cells, or fewer mpm.points_per_cell\n",
               path);
    return 3;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", path, error.what());
    return 3;
  }
  if (!quiet && !show_progress) fmt::print("{}\n", out);
  return 0;
}
