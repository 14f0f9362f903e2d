// The energy accounts of a collapse: what contacts have dissipated since the release, by direction,
// by grain and by lifetime.
//
// Held energies are exact at any moment. Dissipation is sampled: the powers of all contacts, every
// few steps, count for the interval that ends there. Sampled at every step, the work done on each
// contact less the elastic energy it holds is taken instead, which is the dissipation exactly.
//
// Each contact's dissipation also counts half for either of its grains; where one of the two is
// glued, or a wall, all of it for the moving one. So it has a place, and its sum over the moving
// grains is that of the contacts.
//
// Ranks: every account is a sum over the contacts that count on this rank (moment.hpp), so the sums
// of all ranks add up to those of the whole; grains and contacts are known by their ids, never by
// their places. A contact's account and age stay with the rank that owns its grain of the lower id:
// who hands such a grain to another rank has to hand them over as well (Lifetimes::leave, join), or
// the contact counts as ended and begun. What a grain has taken in stays where it was booked, and
// is summed by ids (by_id).
#pragma once

#include <array>
#include <span>
#include <vector>

#include "dem_reference/ledger/lifetimes.hpp"
#include "dem_reference/ledger/moment.hpp"
#include "dem_reference/ledger/state.hpp"

namespace grainpair::ledger {

/// Normal and tangential of pairs, all of pairs with a glued grain, of walls, rolling of pairs;
/// and, which is no dissipation, what walls that move have done on the grains [J].
using Totals = std::array<double, 6>;

class Accounts {
 public:
  /// interval: between samples [s], one time step if every_step; unit: binary contact time [s];
  /// threshold of an enduring contact, in units. `start` is the moment of release.
  Accounts(const Moment& start, double interval, bool every_step, double unit, double threshold);

  /// One sample.
  void add(const Moment& moment);

  /// Dissipated since the release.
  Totals dissipated(const Moment& moment) const;
  /// The same by grain, in the order of the moment's: out has its count [J].
  void by_grain(const Moment& moment, double* out) const;
  /// What this rank has seen of it, of all ids below out's size: also of grains that have left [J].
  void by_id(const Moment& moment, std::span<double> out) const;
  double force_error() const { return force_error_; }
  double torque_error() const { return torque_error_; }
  Lifetimes& lifetimes() { return lifetimes_; }
  /// All that samples have changed since the release.
  void state(State& of);

 private:
  struct Sums {
    Totals totals{};
    std::vector<double> grains;  // by id
    double of(std::int32_t id) const {
      return static_cast<std::size_t>(id) < grains.size() ? grains[id] : 0.0;
    }
  };
  /// Values of the contacts, times `weight`, to the totals and to the grains that they belong to.
  template <class Value>
  static void book(const Moment& moment, double weight, Value&& value, Sums& sums);
  Sums held(const Moment& moment) const;
  Heat held(const Pair& pair) const;

  double interval_;
  bool every_step_;
  Lifetimes lifetimes_;
  Sums taken_, begun_;  // in since the release; held then
  double force_error_ = 0.0, torque_error_ = 0.0;
};

}  // namespace grainpair::ledger
