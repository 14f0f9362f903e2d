#include "mpm/external/tangent.hpp"

#include <algorithm>
#include <cmath>

#include "mpm/external/called.hpp"

namespace grainpair {
namespace {

/// The state of one point on the path, and the step it takes.
struct OnPath {
  Called now;
  const ExternalLaw& law;

  /// A step over `strain`; what it leaves is kept where `keep` says so.
  std::array<double, 6> step(const std::array<double, 6>& strain, bool keep) {
    Called trial = now;
    for (std::size_t c = 0; c < 6; ++c) trial.strain[c][0] = strain[c];
    const double volumetric = strain[0] + strain[1] + strain[2];
    trial.e[0] = (1.0 + trial.e_old[0]) * std::exp(-volumetric) - 1.0;
    ExternalPoints points = trial.points(1, 1e-6);
    std::string why;
    if (law.update(points, why)) throw SolverError(Failure::library, "the tangent: {}", why);
    std::array<double, 6> stress{};
    for (std::size_t c = 0; c < 6; ++c) stress[c] = trial.stress[c][0];
    if (keep) {
      now = trial;
      now.e_old[0] = trial.e[0], now.steps[0] += 1.0, now.clock[0] += 1e-6;
      for (std::size_t c = 0; c < 6; ++c) now.total[c][0] += strain[c];
    }
    return stress;
  }
};

}  // namespace

std::optional<double> tangent_error(const Case& material) {
  if (material.word("material.law") != "external" || material.word("material.interface") != "umat")
    return {};
  const auto law = make_umat(material);
  const ExternalConstants constants(material);
  OnPath path{Called(static_cast<std::size_t>(constants.state_count)), *law};
  const double e = material.number("initial.void_ratio");
  Called& now = path.now;
  for (auto* six : {&now.stress, &now.strain, &now.total})
    for (auto& numbers : *six) numbers[0] = 0.0;
  for (auto& numbers : now.spin) numbers[0] = 0.0;
  now.stress[0][0] = now.stress[2][0] = 750.0, now.stress[1][0] = 1500.0;
  now.e_old[0] = now.e[0] = e;
  now.id[0] = now.clock[0] = now.steps[0] = now.counted[0][0] = now.counted[1][0] = 0.0;
  for (std::size_t i = 0; i < now.states.size(); ++i) now.states[i][0] = constants.initial_state[i];
  if (constants.void_ratio_state > 0) now.states[constants.void_ratio_state - 1][0] = e;

  double worst = 0.0;
  for (int i = 0; i < 60; ++i) {
    // a fifth of it volume: stress stays, and the law yields
    const std::array<double, 6> strain{-2e-5, 6e-5, -1e-5, 3e-5, 0.0, 1e-5};
    if (i % 6 == 5) {
      path.step(strain, false);
      std::array<double, 36> told{};
      std::copy_n(law->tangent(), 36, told.begin());
      double largest = 0.0;
      for (const double number : told) largest = std::max(largest, std::abs(number));
      for (std::size_t c = 0; c < 6; ++c) {
        constexpr double small = 1e-8;
        auto more = strain, less = strain;
        const double own = c < 3 ? small : 0.5 * small;  // engineering shear
        more[c] += own, less[c] -= own;
        const auto up = path.step(more, false), down = path.step(less, false);
        for (std::size_t r = 0; r < 6; ++r)
          worst = std::max(worst, std::abs((up[r] - down[r]) / (2.0 * small) -
                                           told[abaqus_place[c] * 6 + abaqus_place[r]]) /
                                      largest);
      }
    }
    path.step(strain, true);
  }
  return worst;
}

}  // namespace grainpair
