// A body: every point's constitutive state, and the loop that updates it. One virtual call per
// batch of points, never one per point; BodyOf<Law> is that loop for one law.
#pragma once

#include <cstdint>

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
  std::span<std::uint8_t> regime;
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
  /// The quasi-static part of a point's stress sigma at void ratio e; all of it for a law without
  /// collisions [Pa].
  virtual SymTensor quasi_static_stress(std::size_t point, const SymTensor& sigma,
                                        double e) const = 0;
};

template <Material Law>
class BodyOf final : public Body {
 public:
  explicit BodyOf(const Law& law) : law_(law) {}

  void resize(std::size_t points) override { state_.resize(points); }

  void initialise(std::size_t first, std::span<const InitialState> initial, Batch batch) override {
    for (std::size_t i = 0; i < initial.size(); ++i)
      store(first + i, i, law_.initial(initial[i]), initial[i].void_ratio, batch);
  }

  void update(std::size_t first, Batch batch) override {
    for (std::size_t i = 0; i < batch.steps.size(); ++i)
      store(first + i, i, law_.update(state_[first + i], batch.steps[i]), batch.steps[i].void_ratio,
            batch);
  }

  void reorder(std::span<const std::uint32_t> order) override {
    std::vector<typename Law::State> sorted;
    sorted.reserve(state_.size());
    for (const auto p : order) sorted.push_back(state_[p]);
    state_ = std::move(sorted);
  }

  SymTensor quasi_static_stress(std::size_t point, const SymTensor& sigma,
                                double e) const override {
    if constexpr (requires { law_.quasi_static_stress(state_[point], e); })
      return law_.quasi_static_stress(state_[point], e);
    else
      return sigma;
  }

 private:
  void store(std::size_t p, std::size_t i, const Response<typename Law::State>& r,
             double void_ratio, const Batch& out) {
    state_[p] = r.state;
    out.sigma[i] = r.sigma;
    out.energies[i] = r.energies;
    out.work[i] = r.work;
    out.granular_temperature[i] = law_.granular_temperature(r.state);
    out.stability[i] = law_.stability(r.state, r.sigma, void_ratio);
    out.regime[i] = static_cast<std::uint8_t>(r.regime);
  }

  Law law_;
  std::vector<typename Law::State> state_;
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
