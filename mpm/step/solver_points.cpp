// What points make of their velocity gradients, and their new places.
#include "cases/failure.hpp"
#include "mpm/step/solver.hpp"
#include "mpm/step/timed.hpp"

namespace grainpair {

/// What points make of their velocity gradients (material_points.hpp); a point that turns inside
/// out or leaves the grid ends the run, named.
template <int D>
void Solver<D>::update_points(StrainedPoints strained, double dt, Moves moves) {
  const Timed timed(times_ ? &times_->update : nullptr);
  point_sums_.assign(strips_.size(), {});
  const CellsOfStep cells{strained.rates, strained.pressures};
  material_.begin(dt, moves == Moves::yes);
  for_each_strip(
      [&](std::size_t s) { body_->advance(material_, cells, strips_[s], point_sums_[s]); });
  try {
    body_->check();
  } catch (const SolverError& error) {
    fail(error);
  }
  spent_rates_ = ClearingCells(std::move(strained.rates));
  hold_pressures(std::move(strained.pressures));
  const EnergyLedger before = ledger_;
  ledger_.stored = ledger_.fluctuation = 0.0;
  fastest_ = {};
  for (const PointSums& s : point_sums_) {
    if (s.inverted >= 0) {
      const auto p = static_cast<std::size_t>(s.inverted);
      fail(SolverError(
          Failure::inverted,
          "point {}: volume inverted (void ratio {:.3g}) at ({:.4g}, {:.4g}) m, t = {:.4g} s lower "
          "mpm.time_step_fraction",
          points_.id[p], points_.void_ratio[p], position(p)[0], position(p)[1], time_));
    }
    const double mixing = reduce(s.mixing);
    ledger_.stored += reduce(s.energies.stored);
    ledger_.fluctuation += reduce(s.energies.fluctuation);
    ledger_.plastic += reduce(s.energies.plastic);
    ledger_.regime_4 += reduce(s.energies.regime_4);
    ledger_.contact += reduce(s.energies.contact);
    ledger_.detached += s.detached;
    if (s.fastest.rate > fastest_.rate) fastest_ = s.fastest;
    ledger_.mixing -= mixing;  // work that the points took and the grid did not give
    ledger_.time_integration += mixing - s.detached;
  }
  // The grid gave its own figure for this work when it accelerated; what the two do not agree on is
  // the integrator's.
  const auto absorbed_by = [](const EnergyLedger& l) {
    return l.stored + l.fluctuation + l.plastic + l.regime_4 + l.contact;
  };
  const double absorbed = absorbed_by(ledger_) - absorbed_by(before);
  ledger_.time_integration -= absorbed;
  if (moves == Moves::yes) book_places();
}

/// Where the law has already answered.
template <int D>
void Solver<D>::move_points(MovingGrid grid, double dt) {
  const Timed timed(times_ ? &times_->update : nullptr);
  material_.begin(dt, true);
  point_sums_.assign(strips_.size(), {});
  for_each_strip([&](std::size_t s) {
    for_each_block(strips_[s].begin, strips_[s].end, [&](const Block& block) {
      material_.move(block, point_sums_[s]);
      material_.give_pressure(block, grid.cells.pressures);
    });
  });
  spent_rates_ = ClearingCells(GivenCells(std::move(grid.cells.rates)));
  hold_pressures(std::move(grid.cells.pressures));
  book_places();
}

template <int D>
void Solver<D>::hold_pressures(GivingCells given) {
  fold(given);
  spent_pressures_ = ClearingCells(std::move(pressures_));
  pressures_ = GivenCells(std::move(given));
}

template <int D>
void Solver<D>::book_places() {
  double potential = 0.0;
  for (const PointSums& s : point_sums_) {
    potential += reduce(s.potential);
    if (s.escaped >= 0) {
      const auto p = static_cast<std::size_t>(s.escaped);
      const Vec3 x = position(p);
      fail(SolverError(
          Failure::ejected,
          "point {}: left the grid at ({:.4g}, {:.4g}, {:.4g}) m, t = {:.4g} s (speed {:.3g} m/s) "
          "lengthen geometry.floor_length, or lower mpm.time_step_fraction if the speed is absurd",
          points_.id[p], x[0], x[1], x[2], time_, velocity(p).norm()));
    }
  }
  ranks().refuse(failed_);
  if (setup_.period) {
    const double along = energy_along();
    potential -= along;
    ledger_.time_integration += ledger_.slope - (along + passed_);
    ledger_.slope = along + passed_;
  }
  ledger_.time_integration += ledger_.potential - potential;
  ledger_.potential = potential;
}

template class Solver<2>;
template class Solver<3>;

}  // namespace grainpair
