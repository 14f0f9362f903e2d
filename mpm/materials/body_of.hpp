// The loop that a law's points go through, several at once, and the law's entry into the registry.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>

#include "mpm/points/by_batch.hpp"

namespace grainpair {

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
      batch.collisional_pressure[i] = r.collisional_pressure;
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

  void advance(MaterialPoints<2>& points, const CellsOfStep& cells, const Strip& strip,
               PointSums& sums) override {
    advance_all(points, cells, strip, sums);
  }
  void advance(MaterialPoints<3>& points, const CellsOfStep& cells, const Strip& strip,
               PointSums& sums) override {
    advance_all(points, cells, strip, sums);
  }

  void reorder(std::span<const std::uint32_t> order) override { state_.reorder(order); }

  void archive(Archive& to) override { state_.archive("state", to); }

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
  static constexpr Accounts accounts{!athermal, std::is_base_of_v<WithContacts, Law>};
  /// What a law leaves at zero: fluctuation, collisional and contact, and viscosity.
  struct Zeros {
    static constexpr Range energies{athermal ? 2u : 4u, accounts.contacts ? 4u : 5u},
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

  template <class Where>
  [[gnu::noinline]] GRAINPAIR_FLATTEN void update_all(std::size_t first, Batch& batch) {
    if constexpr (by_regime) {
      for (std::size_t begin = 0; begin < batch.size; begin += window)
        update_by_regime<Where>(first, batch, begin, std::min(begin + window, batch.size));
    } else {
      const Law law = law_;  // which no store can change
      const std::size_t end = batch.size / Wide::size() * Wide::size();
      for_each_block(0, end,
                     [&](const Block& block) { update<Where>(law, state_, first, batch, block); });
      if (end < batch.size)
        update<Where>(law, state_, first, batch, Scattered::some(end, batch.size));
    }
  }

  template <int Dim>
  void advance_all(MaterialPoints<Dim>& points, const CellsOfStep& cells, const Strip& strip,
                   PointSums& sums) {
    if constexpr (Dim == 2) {
      if (points.axisymmetric()) return advance_as<true>(points, cells, strip, sums);
    }
    advance_as<false>(points, cells, strip, sums);
  }

  /// Block by block; through a batch where points of one regime are to be brought together.
  template <bool Axisymmetric, int Dim>
  GRAINPAIR_FLATTEN void advance_as(MaterialPoints<Dim>& points, const CellsOfStep& cells,
                                    const Strip& strip, PointSums& out) {
    PointSums sums;
    if constexpr (by_regime)
      advance_by_batch<Zeros, accounts, Axisymmetric>(
          points, cells, strip, sums, [&](std::size_t first, Batch& batch) {
            update_all<typename MaterialPoints<Dim>::Where>(first, batch);
          });
    else
      advance_in_order<Axisymmetric>(points, cells, strip, sums);
    out = sums;
  }

  template <bool Axisymmetric, int Dim>
  void advance_in_order(MaterialPoints<Dim>& points, const CellsOfStep& cells, const Strip& strip,
                        PointSums& sums) {
    using Where = typename MaterialPoints<Dim>::Where;
    const Law law = law_;
    for_each_block(strip.begin, strip.end, [&](const Block& block) {
      const Strained strained = points.template strain<Axisymmetric>(block, cells.rates, sums);
      const auto r = law.update(state_.load(block, state_without<Where>), strained.step);
      state_.store(r.state, block, state_without<Where>);
      store_whole(r.regime, block, points.points.regime);
      points.template book<accounts>(
          block, strained.step.mixing, strained.detached,
          {r.sigma, r.energies, law.stability(r.state, strained.step.void_ratio),
           law.granular_temperature(r.state), r.collisional_pressure},
          cells.pressures, sums);
    });
  }

  /// Blocks of one regime as they are; what the others hold, regime by regime.
  template <class Where>
  void update_by_regime(std::size_t first, Batch& batch, std::size_t begin, std::size_t end) {
    std::array<std::uint32_t, window> mixed;
    std::size_t count = 0;
    for (; begin < end; begin += Wide::size()) {
      const std::size_t here = std::min(Wide::size(), end - begin);
      const auto* const regime = &batch.regime[begin];
      if (here == Wide::size() &&
          std::all_of(regime, regime + Wide::size(), [&](auto r) { return r == *regime; })) {
        update_block<Where>(state_, first, batch, Block{begin});
        continue;
      }
      for (std::size_t lane = 0; lane < here; ++lane)
        mixed[count++] = static_cast<std::uint32_t>(begin + lane);
    }
    std::array<std::uint16_t, 6> next{};  // five regimes
    for (std::size_t i = 0; i < count; ++i)
      ++next[static_cast<std::size_t>(batch.regime[mixed[i]]) + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    std::array<std::uint32_t, window> order;
    for (std::size_t i = 0; i < count; ++i)
      order[next[static_cast<std::size_t>(batch.regime[mixed[i]])]++] = mixed[i];
    update_brought_together<Where>(first, batch, std::span(order).first(count));
  }

  /// Points anywhere in a batch, by way of rows where they stand side by side: the law is compiled
  /// for blocks alone.
  template <class Where>
  void update_brought_together(std::size_t first, Batch& batch,
                               std::span<const std::uint32_t> order) {
    thread_local Arrays<State> state(window);
    thread_local Batch rows(window);
    const auto each_four = [&](auto&& f) {
      for (std::size_t i = 0; i < order.size(); i += Wide::size()) {
        Scattered at = Scattered::some(i, order.size());
        for (auto& point : at.points) point = order[point];
        f(at, Block{i});
      }
    };
    each_four([&](const Scattered& at, const Block& row) {
      state.store(state_.load(at.beyond(first), state_without<Where>), row, state_without<Where>);
      rows.steps.store(batch.steps.load(at, Where::step), row, Where::step);
    });
    for_each_block(0, (order.size() + Wide::size() - 1) / Wide::size() * Wide::size(),
                   [&](const Block& row) { update_block<Where>(state, 0, rows, row); });
    each_four([&](const Scattered& at, const Block& row) {
      state_.store(state.load(row, state_without<Where>), at.beyond(first), state_without<Where>);
      batch.sigma.store(rows.sigma.load(row, Where::tensor), at, Where::tensor);
      batch.energies.store(rows.energies.load(row, Zeros::energies), at, Zeros::energies);
      batch.stability.store(rows.stability.load(row, Zeros::stability), at, Zeros::stability);
      if (!batch.work.empty()) at.store(row.load(rows.work), batch.work);
      if constexpr (!athermal) {
        at.store(row.load(rows.granular_temperature), batch.granular_temperature);
        at.store(row.load(rows.collisional_pressure), batch.collisional_pressure);
      }
      for (std::size_t lane = 0; lane < Wide::size(); ++lane)
        batch.regime[at(lane)] = rows.regime[row(lane)];
    });
  }

  /// A function of its own: such laws are long, and would else be compiled at every call.
  template <class Where>
  [[gnu::noinline]] GRAINPAIR_FLATTEN void update_block(Arrays<State>& state, std::size_t first,
                                                        Batch& batch, const Block& block) const {
    update<Where>(law_, state, first, batch, block);
  }

  template <class Where, class At>
  static void update(const Law& law, Arrays<State>& state, std::size_t first, Batch& batch,
                     const At& at) {
    const auto step = batch.steps.load(at, Where::step);
    const auto r = law.update(state.load(at.beyond(first), state_without<Where>), step);
    state.store(r.state, at.beyond(first), state_without<Where>);
    batch.sigma.store(r.sigma, at, Where::tensor);
    batch.energies.store(r.energies, at, Zeros::energies);
    if (!batch.work.empty()) at.store(r.work, batch.work.data());
    if constexpr (!athermal) {
      at.store(law.granular_temperature(r.state), batch.granular_temperature.data());
      at.store(r.collisional_pressure, batch.collisional_pressure.data());
    }
    batch.stability.store(law.stability(r.state, step.void_ratio), at, Zeros::stability);
    for (std::size_t lane = 0; lane < Wide::size(); ++lane)
      batch.regime[at(lane)] = static_cast<std::int32_t>(r.regime[lane]);
  }

  Law law_;
  Arrays<State> state_;
};

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
