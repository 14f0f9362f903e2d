#include "dem_reference/ledger/accounts.hpp"

#include <algorithm>

namespace grainpair::ledger {

Accounts::Accounts(const Moment& start, double interval, bool every_step, double unit,
                   double threshold)
    : interval_(interval), every_step_(every_step), lifetimes_(interval / unit, threshold) {
  begun_ = held(start);
  for (const Pair& pair : start.pairs())
    if (pair.counts) lifetimes_.standing(pair.key, held(pair));
}

void Accounts::add(const Moment& moment) {
  book(
      moment, interval_,
      [this](const auto& contact) { return every_step_ ? contact.work_rate : contact.power; },
      taken_);
  for (const Pair& pair : moment.pairs()) {
    if (!pair.counts) continue;
    const Heat& rate = every_step_ ? pair.work_rate : pair.power;
    lifetimes_.seen(pair.key, {rate[0] * interval_, rate[1] * interval_, rate[2] * interval_},
                    held(pair));
  }
  for (const Touch& wall : moment.touches()) taken_.totals[5] += interval_ * wall.driven;
  lifetimes_.sampled();
  torque_error_ = std::max(torque_error_, moment.held().torque_error);
  force_error_ = std::max(force_error_, moment.held().force_error);
}

// What is held is taken off as a sum, the same as at the release: then both are equal to the bit.
Totals Accounts::dissipated(const Moment& moment) const {
  const Sums now = held(moment);
  Totals out{};
  for (std::size_t k = 0; k < out.size(); ++k)
    out[k] = taken_.totals[k] - now.totals[k] + begun_.totals[k];
  return out;
}

void Accounts::by_grain(const Moment& moment, double* out) const {
  const Sums now = held(moment);
  for (std::int64_t k = 0; k < moment.atoms().count; ++k) {
    const std::int32_t id = moment.atoms().id[k];
    out[k] = taken_.of(id) - now.of(id) + begun_.of(id);
  }
}

void Accounts::by_id(const Moment& moment, std::span<double> out) const {
  const Sums now = held(moment);
  for (std::size_t k = 0; k < out.size(); ++k) {
    const auto id = static_cast<std::int32_t>(k);
    out[k] = taken_.of(id) - now.of(id) + begun_.of(id);
  }
}

void Accounts::state(State& of) {
  for (Sums* sums : {&taken_, &begun_}) {
    of(sums->totals);
    of(sums->grains);
  }
  of(force_error_);
  of(torque_error_);
  lifetimes_.state(of);
}

template <class Value>
void Accounts::book(const Moment& moment, double weight, Value&& value, Sums& sums) {
  const Atoms& atoms = moment.atoms();
  const auto to = [&](std::int64_t grain) -> double& {
    const auto id = static_cast<std::size_t>(atoms.id[grain]);
    if (id >= sums.grains.size()) sums.grains.resize(id + 1, 0.0);
    return sums.grains[id];
  };
  for (const Pair& pair : moment.pairs()) {
    if (!pair.counts) continue;
    const Heat rate = value(pair);
    const double sum = weight * (rate[0] + rate[1] + rate[2]);
    const bool first = moment.mobile(pair.first), second = moment.mobile(pair.second);
    sums.totals[0] += weight * rate[0];
    sums.totals[1] += weight * rate[1];
    sums.totals[4] += weight * rate[2];
    if (!first || !second) sums.totals[2] += sum;
    const double share = first && second ? sum / 2 : sum;
    if (first) to(pair.first) += share;
    if (second) to(pair.second) += share;
  }
  for (const Touch& wall : moment.touches()) {
    const double amount = weight * value(wall);
    sums.totals[3] += amount;
    to(wall.grain) += amount;
  }
}

/// Elastic energy, which is to be taken off the work done on contacts; of sampled powers nothing
/// is.
Accounts::Sums Accounts::held(const Moment& moment) const {
  Sums out;
  if (every_step_)
    book(
        moment, 1.0, [](const auto& contact) { return contact.elastic; }, out);
  return out;
}

Heat Accounts::held(const Pair& pair) const { return every_step_ ? pair.elastic : Heat{}; }

}  // namespace grainpair::ledger
