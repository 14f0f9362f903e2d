// What single precision between points and grid does to a collapse: every account of the energy
// ledger against the same run in double precision. It must do less than a hundredth of a relaxation
// time does, which nobody can give that well; and a tenth of it must show.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "mpm/step/simulation.hpp"

namespace grainpair {
namespace {

class Precision : public testing::TestWithParam<const char*> {
 protected:
  std::unique_ptr<Simulation> column(const std::vector<std::string>& keys) const {
    std::vector<std::string> all{std::string("material.law=") + GetParam(), "mpm.cell_size=0.01"};
    all.insert(all.end(), keys.begin(), keys.end());
    return make_simulation(Case::load(GRAINPAIR_SOURCE "/cases/column", all), {});
  }
  /// The largest difference of an account, over the energy released [-].
  static double difference(const Simulation& a, const Simulation& b, double released) {
    const auto accounts = [](const EnergyLedger& l) {
      return std::array{l.kinetic,         l.potential, l.stored,   l.fluctuation,
                        l.plastic,         l.regime_4,  l.contact,  l.wall,
                        l.mixing,          l.detached,  l.transfer, l.conduction,
                        l.time_integration};
    };
    const auto one = accounts(a.ledger()), other = accounts(b.ledger());
    double worst = 0.0;
    for (std::size_t i = 0; i < one.size(); ++i)
      worst = std::max(worst, std::abs(one[i] - other[i]) / released);
    return worst;
  }
};

TEST_P(Precision, SingleBetweenPointsAndGridIsHarmless) {
  const auto exact = column({"mpm.precision=double"}), single = column({"mpm.precision=single"});
  const auto hundredth = column({"mpm.precision=double", "mpm.velocity_relaxation=0.0303"});
  const auto tenth = column({"mpm.precision=double", "mpm.velocity_relaxation=0.033"});
  const double before = exact->ledger().potential;
  while (exact->time() <
         0.05) {  // half a sqrt(H/g): later Lade-Duncan has forgotten what it began with
    const double dt = exact->stable_step().dt;
    for (Simulation* simulation : {exact.get(), single.get(), hundredth.get(), tenth.get()})
      simulation->step(dt);
  }
  const double released = before - exact->ledger().potential;
  const double bound = difference(*exact, *hundredth, released),
               found = difference(*exact, *single, released);
  RecordProperty("single", fmt::format("{:.2g}", found));
  EXPECT_LT(found, bound);
  EXPECT_GT(found, 1e-12);  // it was single precision
  EXPECT_LT(bound, 0.01);
  EXPECT_GT(difference(*exact, *tenth, released), bound);
}

INSTANTIATE_TEST_SUITE_P(Laws, Precision,
                         testing::Values("drucker_prager", "mu_i", "lade_duncan", "solid_fluid",
                                         "contact_share"));

}  // namespace
}  // namespace grainpair
