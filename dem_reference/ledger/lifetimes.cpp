#include "dem_reference/ledger/lifetimes.hpp"

#include <algorithm>
#include <limits>

namespace grainpair::ledger {

Lifetimes::Lifetimes(double interval, double threshold) : interval_(interval) {
  for (std::size_t k = 0; k < kMultiples.size(); ++k) thresholds_[k] = threshold * kMultiples[k];
}

void Lifetimes::standing(std::uint64_t key, const Heat& held) {
  contacts_[key] = {std::numeric_limits<double>::infinity(), held, held, sample_ - 1};
}

void Lifetimes::seen(std::uint64_t key, const Heat& intake, const Heat& held) {
  Contact& contact = contacts_[key];
  contact.age += interval_;
  for (std::size_t k = 0; k < intake.size(); ++k) contact.account[k] += intake[k];
  contact.held = held;
  contact.sample = sample_;
}

void Lifetimes::sampled() {
  std::erase_if(contacts_, [this](const auto& entry) {
    const Contact& contact = entry.second;
    if (contact.sample == sample_) return false;
    book(contact.age, contact.account);
    return true;
  });
  ++sample_;
}

void Lifetimes::finish() {
  for (const auto& [key, contact] : contacts_)
    book(contact.age, {contact.account[0] - contact.held[0], contact.account[1] - contact.held[1]});
  contacts_.clear();
}

Lifetimes::ByThreshold Lifetimes::enduring() const {
  ByThreshold out = ended_;
  for (const auto& [key, contact] : contacts_)
    add_enduring(contact.age,
                 {contact.account[0] - contact.held[0], contact.account[1] - contact.held[1]}, out);
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
    if (age > thresholds_[k]) to[k] += heat[0] + heat[1];
}

}  // namespace grainpair::ledger
