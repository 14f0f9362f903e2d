// A body: every point's constitutive state, and the loop that updates it, several points at once. One virtual call per
// batch of points, never one per point; BodyOf<Law> is that loop for one law.
#pragma once

#include <array>
#include <cstdint>
#include <numeric>

#include "mpm/material.hpp"

namespace grainpair {

/// Results of an update, one entry per point of the batch.
struct Batch {
  std::span<const Deformation> steps;
  std::span<SymTensor> sigma;              // [Pa]
  std::span<Energies> energies;            // [J/kg]; plastic and collisional of this step alone
  std::span<double> work;                  // [J/kg] stress work of this step
  std::span<double> granular_temperature;  // [m2/s2]
  std::span<Stability> stability;
  std::span<std::uint8_t> regime;          // before the update that of the last step
};

class Body {
 public:
  virtual ~Body() = default;
  virtual void resize(std::size_t points) = 0;
  virtual void initialise(std::size_t first, std::span<const InitialState> initial,
                          Batch batch) = 0;
  /// Updates points first .. first + batch.steps.size() - 1.
  virtual void update(std::size_t first, Batch batch) = 0;
  /// state[i] <- state[order[i]]; called whenever the solver reorders its points.
  virtual void reorder(std::span<const std::uint32_t> order) = 0;
  /// Of granular temperature [Pa s]; 0 for a law without.
  virtual double conductivity(std::size_t point, double void_ratio) const = 0;
  /// Adds to a point's fluctuations, as far as they do not become negative [J/kg]; gives its granular temperature [m2/s2].
  virtual double heat(std::size_t point, double energy) = 0;
  /// The quasi-static part of a point's stress sigma at void ratio e; all of it for a law without
  /// collisions [Pa].
  virtual SymTensor quasi_static_stress(std::size_t point, const SymTensor& sigma,
                                        double e) const = 0;
};

template <Material Law>
class BodyOf final : public Body {
 public:
  template <class Real>
  using State = typename Law::template State<Real>;

  explicit BodyOf(const Law& law) : law_(law) {}

  void resize(std::size_t points) override { state_.resize(points); }

  void initialise(std::size_t first, std::span<const InitialState> initial, Batch batch) override {
    for (std::size_t i = 0; i < initial.size(); ++i)
      keep(law_.initial(initial[i]), initial[i].void_ratio, first + i, batch, i);
  }

  void update(std::size_t first, Batch batch) override {
    const std::size_t n = batch.steps.size();
    if constexpr (!requires { Law::regimes_cost_differently; }) {
      update(first, batch, n, [](std::size_t i) { return i; });
    } else {
      for (std::size_t begin = 0; begin < n; begin += window) {
        const std::size_t count = std::min(window, n - begin);
        const auto order = by_regime(batch.regime.subspan(begin, count));
        update(first, batch, count, [&](std::size_t i) { return begin + order[i]; });
      }
    }
  }

  void reorder(std::span<const std::uint32_t> order) override {
    std::vector<State<double>> sorted;
    sorted.reserve(state_.size());
    for (const auto p : order) sorted.push_back(state_[p]);
    state_ = std::move(sorted);
  }

  double conductivity(std::size_t point, double void_ratio) const override {
    if constexpr (Conducts<Law>) return law_.conductivity(state_[point], void_ratio);
    return 0.0;
  }

  double heat(std::size_t point, double energy) override {
    if constexpr (Conducts<Law>) state_[point] = law_.heated(state_[point], energy);
    return law_.granular_temperature(state_[point]);
  }

  SymTensor quasi_static_stress(std::size_t point, const SymTensor& sigma,
                                double e) const override {
    if constexpr (requires { law_.quasi_static_stress(state_[point], e); })
      return law_.quasi_static_stress(state_[point], e);
    else
      return sigma;
  }

 private:
  static constexpr std::size_t window = 256;  // points sorted by regime before they are updated together

  /// Order of at most `window` points in which those of one regime lie together.
  static std::array<std::uint8_t, window> by_regime(std::span<const std::uint8_t> regime) {
    std::array<std::uint16_t, 257> next{};
    for (const auto r : regime) ++next[r + 1u];
    std::partial_sum(next.begin(), next.end(), next.begin());
    std::array<std::uint8_t, window> order;
    for (std::size_t i = 0; i < regime.size(); ++i) order[next[regime[i]]++] = static_cast<std::uint8_t>(i);
    return order;
  }

  /// Points first + at(0) ... first + at(count - 1): several at once, and what is left over one by one.
  template <class At>
  void update(std::size_t first, const Batch& batch, std::size_t count, const At& at) {
    std::size_t i = 0;
    for (; i + Wide::size() <= count; i += Wide::size()) {
      std::array<std::size_t, Wide::size()> lanes;
      for (std::size_t lane = 0; lane < lanes.size(); ++lane) lanes[lane] = at(i + lane);
      update_together(&state_[first], batch, [lanes](std::size_t lane) { return lanes[lane]; });
    }
    for (; i < count; ++i) {
      const Deformation& step = batch.steps[at(i)];
      keep(law_.update(state_[first + at(i)], step), step.void_ratio, first + at(i), batch, at(i));
    }
  }

  template <class At>
  [[gnu::flatten]] void update_together(State<double>* state, const Batch& batch, const At& at) const {
    const auto step = load<DeformationOf>(batch.steps.data(), at);
    const auto r = law_.update(load<State>(state, at), step);
    store<State>(r.state, state, at);
    store<Tensor>(r.sigma, batch.sigma.data(), at);
    store<EnergiesOf>(r.energies, batch.energies.data(), at);
    store<Single>(r.work, batch.work.data(), at);
    store<Single>(law_.granular_temperature(r.state), batch.granular_temperature.data(), at);
    store<StabilityOf>(law_.stability(r.state, step.void_ratio), batch.stability.data(), at);
    for (std::size_t lane = 0; lane < Wide::size(); ++lane) batch.regime[at(lane)] = static_cast<std::uint8_t>(r.regime[lane]);
  }

  void keep(const Response<double, Law::template State>& r, double void_ratio, std::size_t point, const Batch& out,
            std::size_t i) {
    state_[point] = r.state;
    out.sigma[i] = r.sigma;
    out.energies[i] = r.energies;
    out.work[i] = r.work;
    out.granular_temperature[i] = law_.granular_temperature(r.state);
    out.stability[i] = law_.stability(r.state, void_ratio);
    out.regime[i] = static_cast<std::uint8_t>(r.regime);
  }

  Law law_;
  std::vector<State<double>> state_;
};

using BodyFactory = std::function<std::unique_ptr<Body>(const Case&)>;

/// Laws by name. Filled by GRAINPAIR_REGISTER_MATERIAL at start-up.
std::map<std::string, BodyFactory>& material_registry();

/// Puts a law into the registry. Law must be constructible from `const Case&`.
#define GRAINPAIR_REGISTER_MATERIAL(Law, name)                                  \
  [[maybe_unused]] const bool Law##_registered =                                \
      ::grainpair::material_registry()                                          \
          .emplace(name,                                                        \
                   [](const ::grainpair::Case& c) {                             \
                     return std::make_unique<::grainpair::BodyOf<Law>>(Law(c)); \
                   })                                                           \
          .second;

}  // namespace grainpair
