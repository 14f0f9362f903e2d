#include "dem_reference/ledger/accounts.hpp"

#include <algorithm>

namespace grainpair::ledger {

Accounts::Accounts(const Moment& start, double interval, bool every_step, double unit,
                   double threshold)
    : interval_(interval), every_step_(every_step), lifetimes_(interval / unit, threshold) {
  book_held(start, 1.0, taken_, grains_);
  for (const Pair& pair : start.pairs())
    if (pair.counts) lifetimes_.standing(pair.key, held(pair));
}

void Accounts::add(const Moment& moment) {
  book(
      moment, interval_,
      [this](const auto& contact) { return every_step_ ? contact.work_rate : contact.power; },
      taken_, grains_);
  for (const Pair& pair : moment.pairs()) {
    if (!pair.counts) continue;
    const Heat& rate = every_step_ ? pair.work_rate : pair.power;
    lifetimes_.seen(pair.key, {rate[0] * interval_, rate[1] * interval_}, held(pair));
  }
  lifetimes_.sampled();
  force_error_ = std::max(force_error_, moment.held().force_error);
}

Totals Accounts::dissipated(const Moment& moment) const {
  Totals out = taken_;
  std::vector<double> grains = grains_;
  book_held(moment, -1.0, out, grains);
  return out;
}

void Accounts::by_grain(const Moment& moment, double* out) const {
  Totals totals = taken_;
  std::vector<double> grains = grains_;
  book_held(moment, -1.0, totals, grains);
  for (std::int64_t k = 0; k < moment.atoms().count; ++k) {
    const auto id = static_cast<std::size_t>(moment.atoms().id[k]);
    out[k] = id < grains.size() ? grains[id] : 0.0;
  }
}

template <class Value>
void Accounts::book(const Moment& moment, double weight, Value&& value, Totals& totals,
                    std::vector<double>& grains) const {
  const Atoms& atoms = moment.atoms();
  const auto to = [&](std::int64_t grain) -> double& {
    const auto id = static_cast<std::size_t>(atoms.id[grain]);
    if (id >= grains.size()) grains.resize(id + 1, 0.0);
    return grains[id];
  };
  for (const Pair& pair : moment.pairs()) {
    if (!pair.counts) continue;
    const Heat rate = value(pair);
    const double sum = weight * (rate[0] + rate[1]);
    const bool first = moment.mobile(pair.first), second = moment.mobile(pair.second);
    totals[0] += weight * rate[0];
    totals[1] += weight * rate[1];
    if (!first || !second) totals[2] += sum;
    const double share = first && second ? sum / 2 : sum;
    if (first) to(pair.first) += share;
    if (second) to(pair.second) += share;
  }
  for (const Touch& wall : moment.touches()) {
    const double amount = weight * value(wall);
    totals[3] += amount;
    to(wall.grain) += amount;
  }
}

/// Elastic energy, which is to be taken off the work done on contacts; of sampled powers nothing
/// is.
void Accounts::book_held(const Moment& moment, double weight, Totals& totals,
                         std::vector<double>& grains) const {
  if (!every_step_) return;
  book(
      moment, weight, [](const auto& contact) { return contact.elastic; }, totals, grains);
}

Heat Accounts::held(const Pair& pair) const { return every_step_ ? pair.elastic : Heat{}; }

}  // namespace grainpair::ledger
