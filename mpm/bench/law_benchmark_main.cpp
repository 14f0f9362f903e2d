// law_benchmark: nanoseconds per point and step of every law and integrator, over batches as the
// solver makes them.
//
// The points sit in a dense flow: void ratios 0.69 to 0.73, sheared at 10/s in random directions
// with a volumetric rate that alternates, steps of 10 microseconds. Regimes mix as in a collapse;
// their shares are reported beside the time. elastic, plastic, critical and collisional hold the
// points in one regime.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <array>
#include <iostream>
#include <random>

#include "cases/case.hpp"
#include "mpm/points/body.hpp"

namespace grainpair {
namespace {

constexpr std::size_t count = 256;  // states, steps and results stay in the second-level cache
constexpr double dt = 1e-5;

struct Flow {
  double e_low, e_high, pressure, shear_rate, volume_rate;
};
const std::map<std::string, Flow> flows{{"mixed", {0.69, 0.73, 1e3, 10.0, 1.0}},
                                        {"elastic", {0.69, 0.73, 1e4, 0.01, 0.01}},
                                        {"plastic", {0.7092, 0.7095, 1e4, 10.0, 0.0}},
                                        {"critical", {0.7080, 0.7085, 0.0, 10.0, 0.01}},
                                        {"collisional", {0.75, 1.5, 0.0, 10.0, 1.0}}};

void update(benchmark::State& state, const Case& material, const Flow& flow) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit;
  const auto body = material_registry().at(material.word("material.law"))(material);
  body->resize(count);
  std::vector<InitialState> initial(count);
  Batch batch(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double e = flow.e_low + (flow.e_high - flow.e_low) * unit(random);
    initial[i] = {flow.pressure * (0.2 + unit(random)) * SymTensor{0.75, 1.5, 0.75, 0, 0, 0}, e,
                  1e-4};
    // plane motion, as in the solver's plane strain
    SymTensor D{normal(random), normal(random), 0.0, normal(random), 0.0, 0.0};
    D = deviator(D).normalized() * flow.shear_rate / std::numbers::sqrt2;
    batch.steps.set(i, {D, Vec3{0.0, 0.0, flow.shear_rate * normal(random)}, dt, e, e});
  }
  body->initialise(0, initial, batch);

  std::array<double, 5> share{};
  std::size_t step = 0;
  // Every point's volume goes forth and back, in step with no other; 1000 steps a cycle. Counted in
  // the time.
  const auto move = [&] {
    ++step;
    for (std::size_t i = 0; i < count; ++i) {
      const double rate = (step + 4 * i) % 1000 < 500 ? flow.volume_rate : -flow.volume_rate;
      Deformation next = batch.steps[i];
      next.void_ratio_old = next.void_ratio;
      next.void_ratio += rate * dt;
      batch.steps.set(i, next);
    }
  };
  const int warm_up = material.word("material.integrator") == "dormand_prince" ? 50 : 500;
  for (int i = 0; i < warm_up; ++i) move(), body->update(0, batch);
  for (auto _ : state) {
    move();
    body->update(0, batch);
    benchmark::DoNotOptimize(batch.work.data());
  }
  for (const auto r : batch.regime) share[static_cast<std::size_t>(r)] += 1.0 / count;
  const double points = static_cast<double>(state.iterations() * count);
  state.counters["ns/point"] =
      benchmark::Counter(points * 1e-9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  for (std::size_t r = 0; r < share.size(); ++r)
    if (share[r] > 0.0) state.counters[fmt::format("regime {}", r)] = share[r];
}

}  // namespace
}  // namespace grainpair

int main(int argc, char** argv) {
  using namespace grainpair;
  benchmark::Initialize(&argc, argv);
  const std::string path = argc > 1 ? argv[1] : "cases/column";
  try {
    for (const auto& [law, factory] : material_registry()) {
      if (law == "external") continue;  // law-test tells its cost
      const bool rates = law == "critical_state" || law == "solid_fluid";
      for (const std::string integrator : {"implicit", "dormand_prince"}) {
        if (integrator == "dormand_prince" && !rates) continue;
        for (const auto& [name, flow] : flows) {
          if (name != "mixed" && law != "solid_fluid") continue;
          const Case material =
              Case::load(path, {"material.law=" + law, "material.integrator=" + integrator});
          benchmark::RegisterBenchmark(
              fmt::format("{}/{}/{}", law, integrator, name).c_str(),
              [material, flow = flow](benchmark::State& state) { update(state, material, flow); });
        }
      }
    }
  } catch (const CaseError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
  benchmark::RunSpecifiedBenchmarks();
}
