// step_benchmark: the solver's step and its stages, the bare kernels, the output of a frame, and
// the machine's limits, timed in one run. Names hold what was run as key:value; the launcher's
// `bench` reads them.
//
// The scene is the seed's column (a cube in three dimensions) just released, cut into as many
// points as asked.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <malloc.h>
#include <omp.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <iostream>

#include "mpm/bench/bare_kernels.hpp"
#include "mpm/output/output.hpp"
#include "mpm/step/simulation.hpp"

namespace grainpair {

namespace {

/// Cells along a side so that about `points` points, 2^dim per cell, fill a square or a cube.
int side(int dim, double points) {
  return std::max(2, static_cast<int>(std::lround(0.5 * std::pow(points, 1.0 / dim))));
}

Case scene(int dim, double points, const std::string& law, const std::string& shape,
           const std::string& precision = "single") {
  const double h = 0.1 / side(dim, points);
  return Case::load(
      "cases/column",
      {"material.law=" + law, "mpm.shape=" + shape, "mpm.precision=" + precision,
       fmt::format("mpm.cell_size={:.17g}", h),
       fmt::format("geometry.thickness={}", dim == 3 ? 0.1 : 0.005), "geometry.floor_length=0.2",
       fmt::format("geometry.dimension={}", dim == 3 ? "three_dimensional" : "plane_strain")});
}

/// On the heap and in use, whatever earlier scenes have left behind.
double allocated_bytes() {
  const auto now = mallinfo2();
  return static_cast<double>(now.uordblks + now.hblkhd);
}

void step(benchmark::State& state, int dim, double points, const std::string& law,
          const std::string& shape, const std::string& precision, int threads) {
  omp_set_num_threads(threads);
  const double before = allocated_bytes();
  const auto simulation = make_simulation(scene(dim, points, law, shape, precision), {});
  for (int i = 0; i < 3; ++i) simulation->step(simulation->stable_step().dt);
  state.counters["bytes_per_point"] =
      (allocated_bytes() - before) / static_cast<double>(simulation->size());
  state.counters["points"] = static_cast<double>(simulation->size());
  for (auto _ : state) simulation->step(simulation->stable_step().dt);
}

/// What one part of the step takes, while the step goes on.
void stage(benchmark::State& state, int dim, double points, double StageTimes::*part) {
  omp_set_num_threads(1);
  const auto simulation =
      make_simulation(scene(dim, points, "drucker_prager", "quadratic_bspline"), {});
  simulation->step(simulation->stable_step().dt);
  state.counters["points"] = static_cast<double>(simulation->size());
  double before = 0.0;
  StageTimes times;
  for (auto _ : state) {
    simulation->step(simulation->stable_step().dt, times);
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
  const Case column = scene(2, points, "drucker_prager", "quadratic_bspline");
  const auto simulation = make_simulation(column, {});
  const auto path =
      std::filesystem::temp_directory_path() / fmt::format("grainpair_{}.h5", getpid());
  state.counters["points"] = static_cast<double>(simulation->size());
  Draft draft(path.string());
  Output output(draft, column, {});
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
void add(const std::string& name, F&& f) {
  benchmark::RegisterBenchmark(name.c_str(), std::forward<F>(f))->MeasureProcessCPUTime();
}

template <int Dim>
void add_stages(double points) {
  const auto name = [&](const char* what) {
    return fmt::format("benchmark:{}/dimension:{}/shape:quadratic_bspline/threads:1/points:{:.0f}",
                       what, Dim, points);
  };
  add(name("bare_kernels"), [=](benchmark::State& s) { bare<Dim>(s, points); });
  const auto add_stage = [&](const char* what, double StageTimes::*part) {
    benchmark::RegisterBenchmark(name(what).c_str(), [=](benchmark::State& s) {
      stage(s, Dim, points, part);
    })->UseManualTime();
  };
  add_stage("particles_to_grid", &StageTimes::to_grid);
  add_stage("grid_to_particles", &StageTimes::to_points);
  add_stage("constitutive_update", &StageTimes::update);
}

void add_step(int dim, double points, const std::string& law, const std::string& shape, int threads,
              const std::string& precision = "single") {
  const std::string of_shape = shape == "quadratic_bspline" ? precision : "double";
  add(fmt::format(
          "benchmark:step/dimension:{}/shape:{}/precision:{}/law:{}/threads:{}/points:{:.0f}", dim,
          shape, of_shape, law, threads, points),
      [=](benchmark::State& s) { step(s, dim, points, law, shape, precision, threads); });
}

}  // namespace
}  // namespace grainpair

int main(int argc, char** argv) {
  using namespace grainpair;
  benchmark::Initialize(&argc, argv);
  const std::string quadratic = "quadratic_bspline";
  add("benchmark:triad", triad);
  add("benchmark:multiply_add", multiply_add);
  for (const double points : {14400.0, 1e6}) {
    add_stages<2>(points);
    add_stages<3>(points);
  }
  for (const int dim : {2, 3}) {
    for (const int threads : {1, 2})
      for (const std::string law : {"drucker_prager", "lade_duncan", "solid_fluid"})
        add_step(dim, 14400, law, quadratic, threads);
    add_step(dim, 14400, "drucker_prager", quadratic, 1, "double");
    for (const std::string shape : {"linear", "gimp", "cubic_bspline"})
      add_step(dim, 14400, "drucker_prager", shape, 1);
    for (const double points : {1e3, 1e4, 1e5, 1e6, 1e7})
      for (const int threads : {1, 2}) add_step(dim, points, "drucker_prager", quadratic, threads);
  }
  add("benchmark:frame/dimension:2/points:14400", [](benchmark::State& s) { frame(s, 14400); });
  try {
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 3;
  }
}
