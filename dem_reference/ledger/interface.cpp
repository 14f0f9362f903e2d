// What Python calls (dem_reference/moment.py): handles, and pointers to what lies elsewhere.
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "dem_reference/ledger/accounts.hpp"
#include "dem_reference/ledger/fluctuation.hpp"

namespace {

using namespace grainpair::ledger;

/// What Python reads of the contacts of a moment; valid until it looks again.
struct View {
  const Pair* pairs;
  const Touch* touches;
  std::int64_t pair_count, touch_count;
  Held held;
};

/// A row of the history, of what is not held. The same as in moment.py.
struct Row {
  Totals dissipated;
  Lifetimes::ByThreshold enduring;
  double force_error, torque_error;
};

struct Classes {
  const double *edges, *multiples, *heat;
  const std::int64_t* count;
  std::int64_t faces, thresholds;
};

}  // namespace

extern "C" {

Moment* moment_new(const Scene* scene) { return new Moment(*scene); }
void moment_delete(Moment* moment) { delete moment; }

/// rows: `count` contacts; false where one is of a grain that was not handed over.
bool moment_look(Moment* moment, const Atoms* atoms, const double* rows, std::int64_t count,
                 const Plane* planes, std::int64_t plane_count, View* view) {
  try {
    moment->look(*atoms, {rows, static_cast<std::size_t>(moment->scene().columns() * count)},
                 {planes, static_cast<std::size_t>(plane_count)});
  } catch (const std::out_of_range&) {
    return false;
  }
  *view = {moment->pairs().data(), moment->touches().data(),
           static_cast<std::int64_t>(moment->pairs().size()),
           static_cast<std::int64_t>(moment->touches().size()), moment->held()};
  return true;
}

/// Rows of the engine's contacts whose first ids add up to `total`: it does not tell their number.
/// Ids are positive integers, so their running sum meets the engine's own sum at the last row and
/// nowhere before, and no row beyond it is read.
std::int64_t contact_count(const double* rows, double total, std::int64_t columns) {
  std::int64_t count = 0;
  for (double found = 0.0; found < total; ++count) found += rows[columns * count];
  return count;
}

double fluctuation(const Atoms* atoms, double diameter, double mass, bool radial) {
  return fluctuation_energy(*atoms, diameter, mass, radial);
}

Accounts* accounts_new(const Moment* start, double interval, bool every_step, double unit,
                       double threshold) {
  return new Accounts(*start, interval, every_step, unit, threshold);
}
void accounts_delete(Accounts* accounts) { delete accounts; }
void accounts_add(Accounts* accounts, const Moment* moment) { accounts->add(*moment); }
void accounts_row(Accounts* accounts, const Moment* moment, Row* row) {
  *row = {accounts->dissipated(*moment), accounts->lifetimes().enduring(), accounts->force_error(),
          accounts->torque_error()};
}
/// out: of each grain in the moment's order.
void accounts_by_grain(const Accounts* accounts, const Moment* moment, double* out) {
  accounts->by_grain(*moment, out);
}
/// out: of each id below `size`.
void accounts_by_id(const Accounts* accounts, const Moment* moment, double* out,
                    std::int64_t size) {
  accounts->by_id(*moment, {out, static_cast<std::size_t>(size)});
}
/// Takes out what another rank owns now, by the owner of each of `size` ids; how many. They lie at
/// `out` until the next call.
std::int64_t accounts_leave(Accounts* accounts, const std::int32_t* owners, std::int64_t size,
                            std::int32_t self, const Lifetimes::Contact** out) {
  thread_local std::vector<Lifetimes::Contact> gone;
  gone = accounts->lifetimes().leave({owners, static_cast<std::size_t>(size)}, self);
  *out = gone.data();
  return static_cast<std::int64_t>(gone.size());
}
void accounts_join(Accounts* accounts, const Lifetimes::Contact* contacts, std::int64_t count) {
  accounts->lifetimes().join({contacts, static_cast<std::size_t>(count)});
}
/// Puts the state of the accounts to `out`, if that is given; its size [bytes].
std::int64_t accounts_state(Accounts* accounts, void* out) {
  State state;
  accounts->state(state);
  const std::vector<std::byte>& bytes = state.collected();
  if (out) std::memcpy(out, bytes.data(), bytes.size());
  return static_cast<std::int64_t>(bytes.size());
}
/// Takes up such a state; false where these bytes are none.
bool accounts_take_up(Accounts* accounts, const std::byte* bytes, std::int64_t count) {
  State state({bytes, static_cast<std::size_t>(count)});
  try {
    accounts->state(state);
  } catch (const std::length_error&) {
    return false;
  }
  return state.ended();
}
void accounts_finish(Accounts* accounts) { accounts->lifetimes().finish(); }
void accounts_classes(Accounts* accounts, Classes* out) {
  const Lifetimes& lifetimes = accounts->lifetimes();
  *out = {kEdges.data(),
          kMultiples.data(),
          lifetimes.heat().front().data(),
          lifetimes.count().data(),
          static_cast<std::int64_t>(kEdges.size()),
          static_cast<std::int64_t>(kMultiples.size())};
}

}  // extern "C"
