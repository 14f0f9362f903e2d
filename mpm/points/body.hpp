// A body: every point's constitutive state, and the loop that updates it, several points at once.
// One virtual call per batch of points, never one per point; BodyOf<Law> is that loop for one law.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>

#include "mpm/points/point_stage.hpp"

namespace grainpair {

/// What the first `size` points bring to an update and take away.
struct Batch {
  explicit Batch(std::size_t most, bool with_work = true)
      : size(most),
        steps(most),
        sigma(most),
        energies(most),
        work(with_work ? most : 0),
        granular_temperature(most),
        stability(most),
        regime(most) {}

  std::size_t size;
  bool in_plane = false;  // no motion, no stress across it: of tensors, yz and zx are zero, and of
                          // spins all but z
  Columns<DeformationOf> steps;
  Columns<Tensor> sigma;         // [Pa]
  Columns<EnergiesOf> energies;  // [J/kg]; plastic and collisional of this step alone
  std::vector<double> work;      // [J/kg] stress work of this step, if it has room for it
  std::vector<double> granular_temperature;  // [m2/s2]
  Columns<StabilityOf> stability;
  std::vector<std::int32_t> regime;  // before the update that of the last step
};

class Body {
 public:
  virtual ~Body() = default;
  virtual void resize(std::size_t points) = 0;
  virtual void initialise(std::size_t first, std::span<const InitialState> initial,
                          Batch& batch) = 0;
  /// Updates points first .. first + batch.size - 1.
  virtual void update(std::size_t first, Batch& batch) = 0;
  /// The points of a strip from their velocity gradient to their new place, with what that does to
  /// the sums.
  virtual void advance(PointStage<PlaneStrain>& stage, const Strip& strip, PointSums& sums) = 0;
  virtual void advance(PointStage<Axisymmetric>& stage, const Strip& strip, PointSums& sums) = 0;
  virtual void advance(PointStage<ThreeDimensional>& stage, const Strip& strip,
                       PointSums& sums) = 0;
  /// state[i] <- state[order[i]]; called whenever the solver reorders its points.
  virtual void reorder(std::span<const std::uint32_t> order) = 0;
  /// Whether grains may have a granular temperature, dissipate by collisions, or be viscous.
  virtual bool fluctuates() const = 0;
  /// Of granular temperature [Pa s]; 0 for a law without.
  virtual double conductivity(std::size_t point, double void_ratio) const = 0;
  /// Adds to a point's fluctuations, as far as they do not become negative [J/kg]; gives its
  /// granular temperature [m2/s2].
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

  void initialise(std::size_t first, std::span<const InitialState> initial, Batch& batch) override {
    for (std::size_t i = 0; i < initial.size(); ++i) {
      const auto r = law_.initial(initial[i]);
      state_.set(first + i, r.state);
      batch.sigma[i] = r.sigma;
      batch.energies.set(i, r.energies);
      if (!batch.work.empty()) batch.work[i] = r.work;
      batch.granular_temperature[i] = law_.granular_temperature(r.state);
      batch.stability.set(i, law_.stability(r.state, initial[i].void_ratio));
      batch.regime[i] = static_cast<std::int32_t>(r.regime);
    }
  }

  void update(std::size_t first, Batch& batch) override {
    if (batch.in_plane)
      update_all<InPlane>(first, batch);
    else
      update_all<InSpace>(first, batch);
  }

  void advance(PointStage<PlaneStrain>& stage, const Strip& strip, PointSums& sums) override {
    advance_all(stage, strip, sums);
  }
  void advance(PointStage<Axisymmetric>& stage, const Strip& strip, PointSums& sums) override {
    advance_all(stage, strip, sums);
  }
  void advance(PointStage<ThreeDimensional>& stage, const Strip& strip, PointSums& sums) override {
    advance_all(stage, strip, sums);
  }

  void reorder(std::span<const std::uint32_t> order) override { state_.reorder(order); }

  bool fluctuates() const override { return !athermal; }

  double conductivity(std::size_t point, double void_ratio) const override {
    if constexpr (Conducts<Law>) return law_.conductivity(state_[point], void_ratio);
    return 0.0;
  }

  double heat(std::size_t point, double energy) override {
    if constexpr (Conducts<Law>) state_.set(point, law_.heated(state_[point], energy));
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
  static constexpr bool athermal = std::is_base_of_v<Athermal, Law>;
  /// What such a law leaves at zero: fluctuation and collisional, and viscosity.
  struct Zeros {
    static constexpr Range energies = athermal ? Range{2, 4} : Range{},
                           stability = athermal ? Range{1, 2} : Range{};
  };
  /// The elastic strain is the one tensor of a state, and its first member.
  template <class Where>
  static constexpr Range state_without = [] {
    if constexpr (requires(State<double> state) { state.strain; }) {
      static_assert(offsetof(State<double>, strain) == 0);
      return Where::tensor;
    }
    return Range{};
  }();
  static constexpr bool by_regime = requires { Law::regimes_cost_differently; };
  static constexpr std::size_t window =
      64;  // points of which those of one regime are brought together: few enough for the cache

  template <class Where>
  [[gnu::noinline, gnu::flatten]] void update_all(std::size_t first, Batch& batch) {
    if constexpr (!by_regime) {
      const Law law = law_;  // which no store can change
      for_each_block(0, batch.size,
                     [&](const auto& block) { update<Where>(law, first, batch, block); });
    } else
      for (std::size_t begin = 0; begin < batch.size; begin += window)
        update_by_regime<Where>(first, batch, begin, std::min(begin + window, batch.size));
  }

  /// Block by block; through a batch where points of one regime are to be brought together.
  template <class Kinematics>
  [[gnu::flatten]] void advance_all(PointStage<Kinematics>& stage, const Strip& strip,
                                    PointSums& out) {
    using Where = typename PointStage<Kinematics>::Where;
    PointSums sums;
    if constexpr (!by_regime) {
      const Law law = law_;
      for_each_block(strip.begin, strip.end, [&](const auto& block) {
        const Strained strained = stage.strain(block, sums);
        const auto r = law.update(state_.load(block, state_without<Where>), strained.step);
        state_.store(r.state, block, state_without<Where>);
        store_regime(r.regime, block, stage.points.regime);
        stage.template book<!athermal>(
            block, strained.mixing, strained.detached,
            {r.sigma, r.energies, law.stability(r.state, strained.step.void_ratio),
             law.granular_temperature(r.state)},
            sums);
      });
    } else {
      thread_local Batch batch(window, false);
      thread_local std::vector<double> mixing(window), detached(window);
      batch.in_plane = Kinematics::dimension == 2;
      for (std::size_t first = strip.begin; first < strip.end; first += window) {
        const std::size_t end = std::min(first + window, strip.end);
        batch.size = end - first;
        for_each_block(first, end, [&](const auto& block) {
          const Strained strained = stage.strain(block, sums);
          const auto row = block.from(first);
          batch.steps.store(strained.step, row, Where::step);
          row.store(strained.mixing, mixing), row.store(strained.detached, detached);
        });
        std::copy_n(&stage.points.regime[first], batch.size, batch.regime.begin());
        update_all<Where>(first, batch);
        std::copy_n(batch.regime.begin(), batch.size, &stage.points.regime[first]);
        for_each_block(first, end, [&](const auto& block) {
          const auto row = block.from(first);
          stage.template book<!athermal>(
              block, row.load(mixing), row.load(detached),
              {batch.sigma.load(row, Where::tensor), batch.energies.load(row, Zeros::energies),
               batch.stability.load(row, Zeros::stability), row.load(batch.granular_temperature)},
              sums);
        });
      }
    }
    out = sums;
  }

  /// Blocks of one regime as they are; what the others hold, regime by regime.
  template <class Where>
  void update_by_regime(std::size_t first, Batch& batch, std::size_t begin, std::size_t end) {
    std::array<std::uint32_t, window> mixed;
    std::size_t count = 0;
    for_each_block(begin, end, [&](const auto& block) {
      const auto* const regime = &batch.regime[block.first];
      if (std::all_of(regime, regime + block.count, [&](auto r) { return r == *regime; }))
        return update<Where>(law_, first, batch, block);
      for (std::size_t lane = 0; lane < block.count; ++lane)
        mixed[count++] = static_cast<std::uint32_t>(block(lane));
    });
    std::array<std::uint16_t, 6> next{};  // five regimes
    for (std::size_t i = 0; i < count; ++i)
      ++next[static_cast<std::size_t>(batch.regime[mixed[i]]) + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    std::array<std::uint32_t, window> order;
    for (std::size_t i = 0; i < count; ++i)
      order[next[static_cast<std::size_t>(batch.regime[mixed[i]])]++] = mixed[i];
    for (std::size_t i = 0; i < count; i += Wide::size()) {
      Scattered at;  // what is left over repeats the last
      for (std::size_t lane = 0; lane < Wide::size(); ++lane)
        at.points[lane] = order[std::min(i + lane, count - 1)];
      update<Where>(law_, first, batch, at);
    }
  }

  template <class Where, class At>
  void update(const Law& law, std::size_t first, Batch& batch, const At& at) {
    const auto step = batch.steps.load(at, Where::step);
    const auto r = law.update(state_.load(at.beyond(first), state_without<Where>), step);
    state_.store(r.state, at.beyond(first), state_without<Where>);
    batch.sigma.store(r.sigma, at, Where::tensor);
    batch.energies.store(r.energies, at, Zeros::energies);
    if (!batch.work.empty()) at.store(r.work, batch.work.data());
    if constexpr (!athermal)
      at.store(law.granular_temperature(r.state), batch.granular_temperature.data());
    batch.stability.store(law.stability(r.state, step.void_ratio), at, Zeros::stability);
    for (std::size_t lane = 0; lane < Wide::size(); ++lane)
      batch.regime[at(lane)] = static_cast<std::int32_t>(r.regime[lane]);
  }

  Law law_;
  Columns<State> state_;
};

using BodyFactory = std::function<std::unique_ptr<Body>(const Case&)>;

/// Laws by name. Filled by GRAINPAIR_REGISTER_MATERIAL at start-up.
std::map<std::string, BodyFactory>& material_registry();

/// Puts a law into the registry. Law must be constructible from `const Case&`.
// NOLINTBEGIN(bugprone-macro-parentheses): Law is a type
#define GRAINPAIR_REGISTER_MATERIAL(Law, name)                                  \
  [[maybe_unused]] const bool Law##_registered =                                \
      ::grainpair::material_registry()                                          \
          .emplace(name,                                                        \
                   [](const ::grainpair::Case& c) {                             \
                     return std::make_unique<::grainpair::BodyOf<Law>>(Law(c)); \
                   })                                                           \
          .second;
// NOLINTEND(bugprone-macro-parentheses)

}  // namespace grainpair
