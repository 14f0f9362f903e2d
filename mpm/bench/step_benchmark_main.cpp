// step_benchmark: the solver's step and its stages, the bare kernels, the output of a frame, and
// the machine's limits, timed in one run. Names hold what was run as key:value; the launcher's
// `bench` reads them.
//
// The scene is the seed's column (a cube in three dimensions), cut into as many points as asked:
// just released, when every cell holds its four or eight points and nothing has to be sorted; in
// flow; and come to rest.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <malloc.h>
#include <omp.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <optional>

#include "mpm/bench/bare_kernels.hpp"
#include "mpm/output/output.hpp"
#include "mpm/step/simulation.hpp"

namespace grainpair {

namespace {

/// Cells along a side so that about `points` points, 2^dim per cell, fill a square or a cube.
int side(int dim, double points) {
  return std::max(2, static_cast<int>(std::lround(0.5 * std::pow(points, 1.0 / dim))));
}

/// What is timed: the law on a column of so many points.
struct Scene {
  int dim;
  double points;
  std::string law = "drucker_prager";
  std::string shape = "quadratic_bspline";
  std::string precision = "single";
  double grains = 0.0;  // Young modulus of the grains [Pa], 0: the case's own
  double floor = 0.2;   // [m]; what flows needs more

  Case load() const {
    return Case::load(
        "cases/column",
        {"material.law=" + law, "mpm.shape=" + shape, "mpm.precision=" + precision,
         fmt::format("mpm.cell_size={:.17g}", 0.1 / side(dim, points)),
         fmt::format("geometry.thickness={}", dim == 3 ? 0.1 : 0.005),
         fmt::format("geometry.floor_length={}", floor),
         fmt::format("mpm.young_modulus={}", grains),
         fmt::format("geometry.dimension={}", dim == 3 ? "three_dimensional" : "plane_strain")});
  }
  bool operator==(const Scene&) const = default;
};

/// On the heap and in use, whatever earlier scenes have left behind.
double allocated_bytes() {
  const auto now = mallinfo2();
  return static_cast<double>(now.uordblks + now.hblkhd);
}

/// When a step is timed.
enum class Moment { start, flow, rest };
constexpr std::array moments{"start", "flow", "rest"};
/// That are timed then: points in flow are sorted every few dozen steps, and sorting counts.
constexpr int steps_on_the_way = 200;

/// A column on its way. The rows of a scene follow one another in the order of moments, so that it
/// collapses once for all of them.
struct Collapse {
  explicit Collapse(const Scene& s) : scene(s), simulation(make_simulation(s.load(), {})) {}

  /// In flow: 2 sqrt(H/g) after the release, in the midst of the collapse. At rest: when a
  /// hundredth of the largest kinetic energy is left.
  void advance(Moment moment) {
    const double flowing = 2.0 * time_scale(scene.load());
    omp_set_num_threads(omp_get_num_procs());
    double kinetic = simulation->ledger().kinetic;
    while (simulation->time() < flowing || (moment == Moment::rest && kinetic > 0.01 * largest)) {
      simulation->step(simulation->stable_step().dt);
      kinetic = simulation->ledger().kinetic;
      largest = std::max(largest, kinetic);
    }
  }

  Scene scene;
  std::unique_ptr<Simulation> simulation;
  double largest = 0.0;  // kinetic energy on the way to flow [J]
};

/// Holds one column at a time.
Simulation& collapsed(Scene scene, Moment moment) {
  static std::optional<Collapse> kept;
  scene.floor = 0.5;
  if (!kept || !(kept->scene == scene)) kept.emplace(scene);
  kept->advance(moment);
  return *kept->simulation;
}

void tell(benchmark::State& state, const Simulation& simulation) {
  state.counters["points"] = static_cast<double>(simulation.size());
  state.counters["seconds_since_release"] = simulation.time();
  state.counters["kinetic_over_potential"] =
      simulation.ledger().kinetic / simulation.ledger().potential;
}

void step_at_start(benchmark::State& state, const Scene& scene, int threads) {
  omp_set_num_threads(threads);
  const double before = allocated_bytes();
  const auto simulation = make_simulation(scene.load(), {});
  for (int i = 0; i < 3; ++i) simulation->step(simulation->stable_step().dt);
  state.counters["bytes_per_point"] =
      (allocated_bytes() - before) / static_cast<double>(simulation->size());
  tell(state, *simulation);
  for (auto _ : state) simulation->step(simulation->stable_step().dt);
}

void step_later(benchmark::State& state, const Scene& scene, Moment moment, int threads) {
  Simulation& simulation = collapsed(scene, moment);
  tell(state, simulation);
  omp_set_num_threads(threads);
  for (auto _ : state) simulation.step(simulation.stable_step().dt);
}

/// What one part of the step takes, while the step goes on.
void stage(benchmark::State& state, Simulation& simulation, double StageTimes::*part) {
  omp_set_num_threads(1);
  simulation.step(simulation.stable_step().dt);
  tell(state, simulation);
  double before = 0.0;
  StageTimes times;
  for (auto _ : state) {
    simulation.step(simulation.stable_step().dt, times);
    state.SetIterationTime(times.*part - before);
    before = times.*part;
  }
}

template <int Dim>
void bare(benchmark::State& state, double points) {
  BareKernels<Dim> kernels(side(Dim, points));
  state.counters["points"] = static_cast<double>(kernels.size());
  for (auto _ : state) kernels.step(1e-6);
}

void frame(benchmark::State& state, double points) {
  omp_set_num_threads(1);
  const Case column = Scene{2, points}.load();
  const auto simulation = make_simulation(column, {});
  const auto path =
      std::filesystem::temp_directory_path() / fmt::format("grainpair_{}.h5", getpid());
  state.counters["points"] = static_cast<double>(simulation->size());
  Draft draft(path.string());
  Output output(&draft, column, {});
  long count = 0;
  for (auto _ : state) output.frame(*simulation, count++, 1.0);
}

/// a = b + s c over arrays far larger than any cache: bytes moved per second.
void triad(benchmark::State& state) {
  constexpr std::size_t n = 1 << 24;
  std::vector<double> a(n), b(n, 1.0), c(n, 2.0);
  for (auto _ : state) {
    for (std::size_t i = 0; i < n; ++i) a[i] = b[i] + 3.0 * c[i];
    benchmark::DoNotOptimize(a.data());
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * 3 * n * sizeof(double)));
}

/// Fused multiply-adds in twelve independent vectors: enough to fill two pipelines of four cycles,
/// and few enough for the registers.
void multiply_add(benchmark::State& state) {
  using Wide [[gnu::vector_size(32)]] = double;
  constexpr int repeats = 1000, vectors = 12;
  Wide sums[vectors] = {};
  const Wide a = Wide{} + 0.999, b = Wide{} + 1e-3;
  for (auto _ : state) {
    Wide s[vectors];
#pragma GCC unroll 12
    for (int i = 0; i < vectors; ++i) s[i] = sums[i];
    for (int r = 0; r < repeats; ++r) {
#pragma GCC unroll 12
      for (int i = 0; i < vectors; ++i) s[i] = s[i] * a + b;
    }
#pragma GCC unroll 12
    for (int i = 0; i < vectors; ++i) sums[i] = s[i];
    benchmark::DoNotOptimize(sums);
  }
  state.counters["flops"] =
      benchmark::Counter(2.0 * 4.0 * vectors * repeats * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate);
}

template <class F>
auto* add(const std::string& name, F&& f) {
  return benchmark::RegisterBenchmark(name.c_str(), std::forward<F>(f))->MeasureProcessCPUTime();
}

template <int Dim>
void add_bare(double points) {
  add(fmt::format("benchmark:bare_kernels/dimension:{}/shape:quadratic_bspline/threads:1/"
                  "points:{:.0f}",
                  Dim, points),
      [=](benchmark::State& s) { bare<Dim>(s, points); });
}

void add_stages(const Scene& scene, Moment moment) {
  const auto add_stage = [&](const char* what, double StageTimes::*part) {
    const auto name = fmt::format(
        "benchmark:{}/state:{}/dimension:{}/shape:{}/law:{}/threads:1/points:{:.0f}", what,
        moments[static_cast<std::size_t>(moment)], scene.dim, scene.shape, scene.law, scene.points);
    auto* row = benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& s) {
      if (moment == Moment::start)
        stage(s, *make_simulation(scene.load(), {}), part);
      else
        stage(s, collapsed(scene, moment), part);
    });
    row->UseManualTime();
    if (moment != Moment::start) row->Iterations(steps_on_the_way);
  };
  add_stage("particles_to_grid", &StageTimes::to_grid);
  add_stage("grid_to_particles", &StageTimes::to_points);
  add_stage("constitutive_update", &StageTimes::update);
}

void add_step(const Scene& scene, int threads, Moment moment = Moment::start) {
  const std::string of_shape = scene.shape == "quadratic_bspline" ? scene.precision : "double";
  const auto name = fmt::format(
      "benchmark:step/state:{}/dimension:{}/shape:{}/precision:{}/law:{}/threads:{}/points:{:.0f}",
      moments[static_cast<std::size_t>(moment)], scene.dim, scene.shape, of_shape, scene.law,
      threads, scene.points);
  if (moment == Moment::start)
    add(name, [=](benchmark::State& s) { step_at_start(s, scene, threads); });
  else
    add(name, [=](benchmark::State& s) {
      step_later(s, scene, moment, threads);
    })->Iterations(steps_on_the_way);
}

/// Of a column that has to be computed before it can be timed.
void add_collapse(const Scene& scene) {
  for (const Moment moment : {Moment::flow, Moment::rest}) {
    for (const int threads : {1, 2}) add_step(scene, threads, moment);
    if (moment == Moment::flow) add_stages(scene, moment);
  }
}

}  // namespace
}  // namespace grainpair

int main(int argc, char** argv) {
  using namespace grainpair;
  benchmark::Initialize(&argc, argv);
  add("benchmark:triad", triad);
  add("benchmark:multiply_add", multiply_add);
  for (const double points : {14400.0, 1e6}) {
    add_bare<2>(points);
    add_bare<3>(points);
    for (const int dim : {2, 3}) add_stages({dim, points}, Moment::start);
  }
  for (const int dim : {2, 3}) {
    for (const int threads : {1, 2})
      for (const std::string law : {"drucker_prager", "lade_duncan", "solid_fluid"})
        add_step({dim, 14400, law}, threads);
    add_step({.dim = dim, .points = 14400, .precision = "double"}, 1);
    for (const std::string shape : {"linear", "gimp", "cubic_bspline"})
      add_step({.dim = dim, .points = 14400, .shape = shape}, 1);
    for (const double points : {1e3, 1e4, 1e5, 1e6, 1e7})
      for (const int threads : {1, 2}) add_step({dim, points}, threads);
    for (const double points : {1e3, 14400.0}) add_collapse({dim, points});
    // grains 60 times softer are on their way in an eighth of the steps, through the same regimes
    add_collapse({.dim = dim, .points = 14400, .law = "solid_fluid", .grains = 5e6});
  }
  add("benchmark:frame/dimension:2/points:14400", [](benchmark::State& s) { frame(s, 14400); });
  try {
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 3;
  }
}
