#include "dem_reference/ledger/lifetimes.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace grainpair::ledger {

Lifetimes::Lifetimes(double interval, double threshold) : interval_(interval) {
  for (std::size_t k = 0; k < kMultiples.size(); ++k) thresholds_[k] = threshold * kMultiples[k];
}

void Lifetimes::standing(std::uint64_t key, const Heat& held) {
  last_.add({key, std::numeric_limits<double>::infinity(), held, held});
}

void Lifetimes::seen(std::uint64_t key, const Heat& intake, const Heat& held) {
  Contact* before = last_.find(key);
  if (before) before->goes_on = true;
  Contact& contact = next_.add(before ? *before : Contact{key});
  contact.goes_on = false;
  contact.age += interval_;
  for (std::size_t k = 0; k < intake.size(); ++k) contact.account[k] += intake[k];
  contact.held = held;
}

void Lifetimes::sampled() {
  for (const Contact& contact : last_.contacts)
    if (!contact.goes_on) book(contact.age, contact.account);
  std::swap(last_, next_);
  next_.clear();
}

void Lifetimes::finish() {
  for (const Contact& contact : last_.contacts) book(contact.age, left(contact));
  last_.clear();
}

void Lifetimes::state(State& of) {
  of(ended_);
  of(heat_);
  of(count_);
  std::vector<Contact> contacts = last_.contacts;
  of(contacts);
  if (!of.gives()) return;
  last_.clear();
  for (const Contact& contact : contacts) last_.add(contact);
}

std::vector<Lifetimes::Contact> Lifetimes::leave(std::span<const std::int32_t> owners,
                                                 std::int32_t self) {
  std::vector<Contact> all, gone;
  std::swap(all, last_.contacts);
  last_.clear();
  for (const Contact& contact : all)
    if (owners[lower_id(contact.key)] == self)
      last_.add(contact);
    else
      gone.push_back(contact);
  return gone;
}

void Lifetimes::join(std::span<const Contact> contacts) {
  for (const Contact& contact : contacts) last_.add(contact);
}

Lifetimes::ByThreshold Lifetimes::enduring() const {
  ByThreshold out = ended_;
  for (const Contact& contact : last_.contacts) add_enduring(contact.age, left(contact), out);
  return out;
}

/// Of the account, what the contact does not hold.
Heat Lifetimes::left(const Contact& contact) const {
  Heat out;
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = contact.account[k] - contact.held[k];
  return out;
}

void Lifetimes::book(double age, const Heat& heat) {
  add_enduring(age, heat, ended_);
  const auto bin = std::lower_bound(kEdges.begin(), kEdges.end(), age) - kEdges.begin();
  for (std::size_t k = 0; k < heat.size(); ++k) heat_[bin][k] += heat[k];
  ++count_[bin];
}

void Lifetimes::add_enduring(double age, const Heat& heat, ByThreshold& to) const {
  for (std::size_t k = 0; k < to.size(); ++k)
    if (age > thresholds_[k]) to[k] += heat[0] + heat[1] + heat[2];
}

Lifetimes::Contact* Lifetimes::Sample::find(std::uint64_t key) {
  const std::int32_t found = slots_[slot_of(key)];
  return found < 0 ? nullptr : &contacts[found];
}

Lifetimes::Contact& Lifetimes::Sample::add(const Contact& contact) {
  if (2 * contacts.size() >= slots_.size()) {  // half full: searches would become long
    slots_.assign(2 * slots_.size(), -1);
    for (std::size_t k = 0; k < contacts.size(); ++k)
      slots_[slot_of(contacts[k].key)] = static_cast<std::int32_t>(k);
  }
  slots_[slot_of(contact.key)] = static_cast<std::int32_t>(contacts.size());
  return contacts.emplace_back(contact);
}

void Lifetimes::Sample::clear() {
  contacts.clear();
  std::fill(slots_.begin(), slots_.end(), -1);
}

/// Where a key is, or has its place.
std::size_t Lifetimes::Sample::slot_of(std::uint64_t key) const {
  // Fibonacci hashing: the high bits of the product depend on all of the key's
  std::size_t slot = (key * 0x9E3779B97F4A7C15u) >> 32 & (slots_.size() - 1);
  while (slots_[slot] >= 0 && contacts[slots_[slot]].key != key)
    slot = (slot + 1) & (slots_.size() - 1);
  return slot;
}

}  // namespace grainpair::ledger
