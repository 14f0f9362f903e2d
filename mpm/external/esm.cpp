// Laws that are called as an External Soil Model of Anura3D, point by point: tension positive,
// xx yy zz xy yz zx, engineering shear strains; the stress comes turned [Anura3D MPM software,
// Scientific manual, external soil models].
#include <fmt/format.h>

#include <algorithm>

#include "mpm/external/guard.hpp"
#include "mpm/external/law.hpp"

namespace grainpair {
namespace {

using EsmFunction = void(int* npt, int* noel, int* idset, double* stress, double* eunloading,
                         double* plasticmultiplier, double* dstran, int* nstatev, double* statev,
                         int* naddvar, double* additionalvar, char* cmname, int* nprops,
                         double* props, int* numberofphases, int* ntens, std::size_t cmname_length);

constexpr int added = 12;  // numbers in ADDITIONALVAR

class Esm final : public ExternalLaw {
 public:
  explicit Esm(const Case& scene) : constants_(scene), library_(scene, {"esm_", "esm", "ESM"}) {}

  int update(ExternalPoints& points, std::string& why) const override {
    for (int i = 0; i < points.block.size; ++i) {
      call(points, static_cast<std::size_t>(i), why);
      if (!why.empty()) return i + 1;
    }
    return 0;
  }

 private:
  void call(ExternalPoints& points, std::size_t i, std::string& why) const {
    thread_local Guarded of_stress, of_strain, of_state, of_constants, of_additional;
    auto& block = points.block;
    const auto states = static_cast<std::size_t>(constants_.state_count);
    double *const stress = of_stress.of(6), *const strain = of_strain.of(6),
                  *const state = of_state.of(states),
                  *const constants = of_constants.of(constants_.numbers.size()),
                  *const additional = of_additional.of(added);
    for (std::size_t c = 0; c < 6; ++c)
      stress[c] = -block.stress[c][i], strain[c] = (c < 3 ? -1.0 : -2.0) * block.strain[c][i];
    for (std::size_t s = 0; s < states; ++s) state[s] = block.state[s][i];
    std::ranges::copy(constants_.numbers, constants);
    std::fill_n(additional, added, 0.0);
    additional[0] = block.void_ratio_old[i] / (1.0 + block.void_ratio_old[i]);  // porosity
    additional[6] = additional[7] = points.time[i];
    additional[8] = block.dt;
    additional[9] = 1.0;                     // step
    additional[10] = points.steps[i] + 1.0;  // increment
    double modulus = 0.0, multiplier = 0.0;
    std::array<char, 80> name;
    name.fill(' '), std::ranges::copy(std::string_view("GRAINPAIR"), name.begin());
    int npt = static_cast<int>(points.id[i]) + 1, noel = npt, idset = 1,
        nstatev = constants_.state_count, naddvar = added,
        nprops = static_cast<int>(constants_.numbers.size()), phases = 1, ntens = 6;
    const Inside here(points.id[i]);
    const int failed = guarded(why, [&] {
      library_.function<EsmFunction>()(&npt, &noel, &idset, stress, &modulus, &multiplier, strain,
                                       &nstatev, state, &naddvar, additional, name.data(), &nprops,
                                       constants, &phases, &ntens, name.size());
      return 0;
    });
    if (failed) return;
    for (const auto* one : {&of_stress, &of_strain, &of_state, &of_constants, &of_additional})
      if (!one->intact()) why = "the law writes beside its arrays";
    for (std::size_t c = 0; c < 6; ++c) block.stress[c][i] = -stress[c];
    for (std::size_t s = 0; s < states; ++s) block.state[s][i] = state[s];
    block.modulus[i] = modulus;
  }

  ExternalConstants constants_;
  Library library_;
};

}  // namespace

std::unique_ptr<ExternalLaw> make_esm(const Case& scene) { return std::make_unique<Esm>(scene); }

}  // namespace grainpair
