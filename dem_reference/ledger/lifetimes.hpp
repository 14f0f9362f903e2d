// Dissipation split by how long a contact lasts.
//
// A collision is a short contact of two grains, friction within the bed an enduring one. Sampled
// every few steps, a contact seen in k successive samples has lasted k sampling intervals, give or
// take one; its dissipation so far counts as short until its age passes the threshold.
//
// A contact's account takes in either its sampled dissipation, or, sampled at every step, the work
// done on it; what it holds as elastic energy then has to be taken off (`held`), all of which is
// back when the contact ends.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "dem_reference/ledger/state.hpp"

namespace grainpair::ledger {

/// Thresholds whose split is kept over time, as multiples of the case's own.
inline constexpr std::array kMultiples{0.5, 1.0, 2.0, 4.0};
/// Lifetimes [binary contact times] at which the final split is kept, so that its dependence on the
/// threshold is seen.
inline constexpr std::array kEdges{0.5, 1.0,  1.5,  2.0,  3.0,  4.0,  6.0,
                                   8.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0};

using Heat = std::array<double, 3>;  // normal, tangential, rolling [J]

/// The lower id of a contact's key (moment.hpp).
inline std::uint64_t lower_id(std::uint64_t key) { return key >> 32; }

/// Ages and accounts of the contacts, carried from sample to sample by the pair of ids.
class Lifetimes {
 public:
  /// What is carried of one; the same as in moment.py.
  struct Contact {
    std::uint64_t key = 0;
    double age = 0.0;
    Heat account{}, held{};
    bool goes_on = false;  // whether the next sample has seen it
  };

  /// interval: between samples, in binary contact times; threshold: in the same.
  Lifetimes(double interval, double threshold);

  /// A contact that stands at the release: enduring, whatever follows.
  void standing(std::uint64_t key, const Heat& held);
  /// A contact of this sample: what it took in during the interval, and what of its account it
  /// holds.
  void seen(std::uint64_t key, const Heat& intake, const Heat& held);
  /// Ends a sample: contacts that were not seen have ended.
  void sampled();
  /// The contacts still standing at the end go to the class of their age.
  void finish();
  /// Ages and accounts between two samples.
  void state(State& of);

  /// Between two samples, of ranks: the contacts whose grain of the lower id is another's now, by
  /// the owner of each id, which go; and those that come.
  std::vector<Contact> leave(std::span<const std::int32_t> owners, std::int32_t self);
  void join(std::span<const Contact> contacts);

  using ByThreshold = std::array<double, kMultiples.size()>;
  /// Dissipated since the release by contacts older than each threshold [J].
  ByThreshold enduring() const;
  const std::array<Heat, kEdges.size() + 1>& heat() const { return heat_; }
  const std::array<std::int64_t, kEdges.size() + 1>& count() const { return count_; }

 private:
  /// The contacts of one sample, in the order seen, and their places by key: a hash table without
  /// buckets, in which a search goes on to the next slot. With the standard one, whose
  /// entries lie apart, a sample's booking took 1.7 times as long.
  class Sample {
   public:
    Contact* find(std::uint64_t key);
    Contact& add(const Contact& contact);
    void clear();
    std::vector<Contact> contacts;

   private:
    std::size_t slot_of(std::uint64_t key) const;
    std::vector<std::int32_t> slots_ = std::vector<std::int32_t>(1024, -1);  // a power of two
  };
  Heat left(const Contact& contact) const;
  void book(double age, const Heat& heat);
  void add_enduring(double age, const Heat& heat, ByThreshold& to) const;

  double interval_;
  ByThreshold thresholds_{}, ended_{};
  Sample last_, next_;
  std::array<Heat, kEdges.size() + 1> heat_{};           // of ended contacts, per lifetime class
  std::array<std::int64_t, kEdges.size() + 1> count_{};  // likewise
};

}  // namespace grainpair::ledger
