// The split of dissipation by contact lifetime, on contacts whose history is known.
#include <gtest/gtest.h>

#include <numeric>
#include <utility>

#include "dem_reference/ledger/lifetimes.hpp"

namespace grainpair::ledger {
namespace {

using Contacts = std::vector<std::pair<std::uint64_t, Heat>>;

void sample(Lifetimes& lifetimes, const Contacts& contacts) {
  for (const auto& [key, heat] : contacts) lifetimes.seen(key, heat, {});
  lifetimes.sampled();
}

double whole(const Lifetimes& lifetimes) {
  double sum = 0.0;
  for (const Heat& heat : lifetimes.heat()) sum += heat[0] + heat[1];
  return sum;
}

TEST(Lifetimes, TellShortAndEnduringContactsApart) {
  Lifetimes lifetimes(1.0, 2.0);
  lifetimes.standing(98, {});  // at the release: enduring
  for (int k = 0; k < 5; ++k) {
    Contacts contacts{{98, {0.0, 1.0}}, {12, {1.0, 0.0}}};
    if (k < 2) contacts.push_back({34, {10.0, 0.0}});
    sample(lifetimes, contacts);
  }
  // 98 gave 5 from the first sample on; 12 is five units old and gave 5; 34 lasted two, stays short
  EXPECT_DOUBLE_EQ(lifetimes.enduring()[1], 10.0);
  lifetimes.finish();
  EXPECT_DOUBLE_EQ(whole(lifetimes), 30.0);
  EXPECT_EQ(lifetimes.heat()[3], (Heat{20.0, 0.0}));  // lasted two units: up to the face at 2
  EXPECT_EQ(std::accumulate(lifetimes.count().begin(), lifetimes.count().end(), 0), 3);
}

TEST(Lifetimes, AContactThatPartsAndMeetsAgainIsYoungAgain) {
  Lifetimes lifetimes(1.0, 2.0);
  for (const Contacts& contacts : {Contacts{{12, {1.0, 0.0}}}, Contacts{{12, {1.0, 0.0}}},
                                   Contacts{{34, {0.0, 0.0}}}, Contacts{{12, {1.0, 0.0}}}})
    sample(lifetimes, contacts);
  EXPECT_EQ(lifetimes.enduring()[1], 0.0);
}

// Work goes in while a contact is squeezed and comes back when it ends: nothing is left of an
// elastic one.
TEST(Lifetimes, ElasticEnergyHeldIsNoDissipation) {
  Lifetimes lifetimes(1.0, 0.5);
  for (const auto& [work, held] : {std::pair{2.0, 2.0}, {1.0, 3.0}, {-3.0, 0.0}}) {
    lifetimes.seen(12, {work, 0.0}, {held, 0.0});
    lifetimes.sampled();
    EXPECT_NEAR(lifetimes.enduring()[1], 0.0, 1e-15);
  }
  lifetimes.finish();
  EXPECT_NEAR(whole(lifetimes), 0.0, 1e-15);
}

}  // namespace
}  // namespace grainpair::ledger
