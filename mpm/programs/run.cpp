// mpm_run CASE -o mpm.h5: the continuum side of a scene, from release to rest.
#include "mpm/programs/run.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <chrono>
#include <cstdio>
#include <limits>

#include "cases/command_line.hpp"
#include "cases/hdf5.hpp"
#include "mpm/output/checkpoint.hpp"
#include "mpm/output/output.hpp"
#include "mpm/programs/start_ranks.hpp"
#include "mpm/step/cost.hpp"
#include "mpm/step/simulation.hpp"
#include "mpm/step/timed.hpp"
#include "mpm/step/watch.hpp"

namespace grainpair {
namespace {

/// A word of a command line as a shell takes it back.
std::string quoted(const std::string& word) {
  constexpr const char* plain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789@%+=:,./-_";
  if (!word.empty() && word.find_first_not_of(plain) == std::string::npos) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

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
           scene.chute() ? std::numeric_limits<double>::infinity()
                         : scene.number("geometry.floor_length")},
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

/// A run as far as it has come.
class Run {
 public:
  Run(const Case& scene, const Start& from, const Ranks& ranks)
      : simulation(make_simulation(scene, from, ranks)),
        tau(time_scale(scene)),
        watch(watch_over(*simulation, scene)),
        frames(scene.number("time.frame_interval") * tau),
        rows(scene.number("time.energy_interval") * tau),
        begin(simulation->ledger()) {}

  /// All that it goes on from, with the time it has taken.
  void archive(Archive& to) {
    simulation->archive(to);
    watch.archive(to);
    to.number("next_frame", frames.next), to.number("next_row", rows.next);
    to.number("next_look", looks.next), to.number("peak", peak), to.number("steps", steps);
    Spent now = spent_so_far();
    double wall = wall_so_far(), sent = sent_so_far();
    to.structure<double>("spent", now), to.number("wall", wall);
    if (simulation->ranks().many()) to.number("sent", sent);
    spent = now, earlier_whole = now.whole - processor_seconds();
    earlier_wall += wall - wall_so_far(), earlier_sent += sent - sent_so_far();
  }
  Spent spent_so_far() const {
    Spent out = spent;
    out.whole = earlier_whole + processor_seconds();
    out.engine = out.whole - out.setup - out.output;  // a step is too short to be timed
    return out;
  }
  double wall_so_far() const {
    const std::chrono::duration<double> here = std::chrono::steady_clock::now() - start;
    return earlier_wall + here.count();
  }

  /// To its neighbours, by this rank [bytes].
  double sent_so_far() const { return earlier_sent + simulation->ranks().sent(); }

  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
  std::unique_ptr<Simulation> simulation;
  double tau;
  Watch watch;
  Clock frames, rows, looks{Watch::interval * tau};
  EnergyLedger begin;
  double peak = 0.0, earlier_whole = 0.0, earlier_wall = 0.0, earlier_sent = 0.0;
  long steps = 0;
  Spent spent;
};

/// From where it is to its end; what ended it.
std::string advance(Run& run, const Case& scene, Output& output, Checkpoints& checkpoints,
                    Progress& progress) {
  Simulation& simulation = *run.simulation;
  const double end = scene.number("time.maximum") * run.tau;
  const double rest = scene.number("time.rest_kinetic_energy");
  // Above the claimed limit the step is asked for, and runs as long as it does.
  const bool asked_for = scene.number("mpm.time_step_fraction") > 1.0;
  while (simulation.time() < end * (1.0 - 1e-12)) {
    const TimeStep step = step_towards(simulation, std::min(run.frames.next, end),
                                       asked_for ? 1.0 : run.watch.step_share());
    ++run.steps;
    const double kinetic = simulation.ledger().kinetic;
    run.watch.step(simulation, run.steps);
    const double time = simulation.time();
    run.peak = std::max(run.peak, kinetic);
    if (run.rows.due(time)) timed(run.spent.output, [&] { output.energies(simulation, step); });
    if (run.looks.due(time)) run.watch.points(simulation);
    const bool at_rest =
        kinetic < rest * run.peak && time > run.tau;  // the release itself starts from rest
    if (run.frames.due(time) || at_rest)
      timed(run.spent.output, [&] { output.frame(simulation, run.steps, step.dt); });
    progress(time / end,
             fmt::format("t = {:.2f} sqrt(H/g), dt = {:.1e} s", time / run.tau, step.dt));
    if (at_rest) return "rest";
    if (checkpoints.due())
      timed(run.spent.output, [&] {
        checkpoints.keep(output, run.steps, [&](Archive& to) {
          run.archive(to);
          output.archive(to);
        });
      });
  }
  return "maximum";
}

/// Warnings, the result's end, and what the run took.
void conclude(Run& run, const Case& scene, Output& output, const std::string& end_reason,
              const std::vector<std::string>& earlier) {
  const Ranks& ranks = run.simulation->ranks();
  const auto warnings = run.watch.warnings(run.begin, run.simulation->ledger());
  if (ranks.here() == 0) tell(scene, warnings);
  output.warnings(warnings);
  if (ranks.many()) output.shares(run.simulation->imbalance(), ranks.largest(run.sent_so_far()));
  Spent spent = run.spent_so_far();
  ranks.sum(std::span(&spent, 1));
  output.finish(end_reason, spent, run.wall_so_far(), run.steps, earlier);
}

void start(Run& run, Output& output) {
  timed(run.spent.output, [&] {
    output.frame(*run.simulation, 0, 0.0);
    output.energies(*run.simulation, {});
  });
}

void say_the_end(const std::string& reason, Progress& progress) {
  progress(1.0, reason == "rest" ? "at rest" : "time.maximum reached");
}

/// By one process, or by ranks, of which the first has the draft of the result.
void run(const Case& scene, const Start& from, const std::string& path, Draft* draft,
         const Provenance& provenance, Progress progress, const Ranks& ranks) {
  Run run(scene, from, ranks);
  const auto first_state = [&](Archive& to) { run.simulation->archive(to); };
  Checkpoints checkpoints(path, draft, scene, first_state, ranks);
  Output output(draft, scene, provenance);
  run.spent.setup = processor_seconds();
  const bool goes_on = checkpoints.restore([&](Archive& to) {
    run.archive(to);
    output.archive(to);
  });
  if (!goes_on)
    start(run, output);
  else if (draft)
    fmt::print(stderr, "{}: goes on from t = {:.4g} s\n", path, run.simulation->time());
  try {
    const std::string end_reason = advance(run, scene, output, checkpoints, progress);
    conclude(run, scene, output, end_reason, checkpoints.frames());
    checkpoints.remove();
    say_the_end(end_reason, progress);
  } catch (const SolverError&) {  // it would end so again
    checkpoints.remove();
    throw;
  }
}

/// The same, where there is memory and disk for it. Ranks begin once the first has found that there
/// is, and else do nothing.
void run_if_it_fits(const Case& scene, const Start& start, const std::string& path,
                    const Provenance& provenance, Progress progress, const Ranks& ranks) {
  Cost cost = estimate(scene);
  const double disk = cost.disk;
  cost.bytes *= static_cast<double>(ranks.on_this_machine()) / ranks.count();
  refuse_more_than_there_is(cost, scene);
  if (ranks.here() == 0)
    for (const std::string& line : scene.contradictions())
      fmt::print(stderr, "warning: {}\n", line);
  hdf5::with_room(path, disk, [&] {
    std::optional<Draft> draft;
    ranks.begin([&] {
      refuse_lack_of_room(path, disk);
      draft.emplace(path);
    });
    run(scene, start, path, draft ? &*draft : nullptr, provenance, progress, ranks);
  });
}

/// The exit code of `work`, whose failures are said: by the first rank those that all have at once.
template <class F>
int guarded(const std::string& path, const Ranks& ranks, F&& work) {
  try {
    return work();
  } catch (const CaseError& error) {
    if (ranks.here() == 0) fmt::print(stderr, "{}\n", error.what());
    return 2;
  } catch (const SolverError& error) {
    if (ranks.here() == 0) fmt::print(stderr, "{}: {}\n", path, error.what());
    return 3;
  } catch (const NotBegun&) {
    return 0;  // the first rank's code is what counts
  } catch (const RoomError& error) {
    fmt::print(stderr, "{}\n", error.what());
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "{}: out of memory choose larger cells, or fewer mpm.points_per_cell\n",
               path);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", path, error.what());
  }
  ranks.abandon();  // the others wait for this one
  return 3;
}

}  // namespace

int run_program(int argc, char** argv, const Ranks& ranks) {
  CommandLine line("Runs a case with the material point method.");
  std::string path, packing, out = "mpm.h5";
  std::vector<std::string> overrides;
  unsigned seed = 1;
  int threads = 1, wanted_ranks = 1;
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
      .option("--ranks", wanted_ranks, "processes that share the scene over MPI, of --threads each")
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
    command += quoted(argv[i]);
  }
  return guarded(path, ranks, [&] {
    if (only_estimate) {
      print(estimate(Case::load(path, overrides)));
      return 0;
    }
    if (wanted_ranks > 1 && !ranks.many()) return start_ranks(argc, argv, wanted_ranks);
    Start start{seed};
    if (!packing.empty()) start.packing.emplace(packing);
    run_if_it_fits(Case::load(path, overrides), start, out,
                   {command, seed, threads * ranks.count()},
                   Progress(show_progress && ranks.here() == 0), ranks);
    if (ranks.here() == 0 && !quiet && !show_progress) fmt::print("{}\n", out);
    return 0;
  });
}

}  // namespace grainpair
