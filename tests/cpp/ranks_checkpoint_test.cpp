// Ranks that go on from a checkpoint end with the bits of those that nobody stopped; they agree on
// which one that is, and take none that one of them lacks.
#include <gtest/gtest.h>

#include <fstream>

#include "cases/digest.hpp"
#include "mpm/output/checkpoint.hpp"
#include "mpm/step/simulation.hpp"
#include "thread_ranks.hpp"

namespace grainpair {
namespace {

namespace fs = std::filesystem;

/// Keeps numbers in memory, and puts them back, but for those of one name.
class Kept final : public Archive {
 public:
  void put_back(const std::string& but) { back_ = true, but_ = but; }
  /// Of all that is kept.
  std::string digest() const {
    Digest out;
    for (const auto& [name, record] : records_)
      out.add(name).add({reinterpret_cast<const char*>(record.bytes.data()), record.bytes.size()});
    return out.text();
  }

 private:
  struct Record {
    Bytes bytes;
    std::size_t count;
  };
  std::size_t length(const std::string& name, std::size_t now) override {
    return back_ && name != but_ ? records_.at(name).count : now;
  }
  void pass(const std::string& name, Type type, void* values, std::size_t count) override {
    const bool half = type == Type::f32 || type == Type::i32 || type == Type::u32;
    auto* const own = static_cast<std::byte*>(values);
    if (!back_)
      records_[name] = {Bytes(own, own + count * (half ? 4 : 8)), count};
    else if (name != but_)
      std::ranges::copy(records_.at(name).bytes, own);
  }
  std::map<std::string, Record> records_;
  bool back_ = false;
  std::string but_;
};

void advance(Simulation& simulation, int steps) {
  for (int k = 0; k < steps; ++k) simulation.step(simulation.stable_step().dt);
}

std::string digest_of(Simulation& simulation) {
  Kept kept;
  simulation.archive(kept);
  return kept.digest();
}

// By the first of these steps columns of cells have been dealt out anew, and points have moved.
constexpr int older = 500, newer = 560, last = 620;

class RanksKeep : public testing::Test {
 protected:
  RanksKeep() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~RanksKeep() override { fs::remove_all(folder_); }

  fs::path unfinished() const { return result_.string() + ".unfinished"; }
  fs::path part(int step, int rank) const {
    const std::string name = fmt::format("checkpoint-{}", step);
    return unfinished() / (rank == 0 ? name : fmt::format("{}.{}", name, rank));
  }
  /// f(simulation, checkpoints, passes) on each of them.
  template <class F>
  void on(int count, F&& f) const {
    with_ranks(count, [&](const Ranks& ranks) {
      const auto simulation = make_simulation(scene_, {}, ranks);
      const Passes all = [&](Archive& to) { simulation->archive(to); };
      Checkpoints checkpoints(result_.string(), nullptr, scene_, all, ranks);
      f(*simulation, checkpoints, all);
    });
  }
  /// Three ranks, which keep themselves twice and are gone; what they would have come to.
  std::vector<std::string> keep_and_stop() const {
    std::vector<std::string> out(3);
    on(3, [&](Simulation& simulation, Checkpoints& checkpoints, const Passes& all) {
      Output output(nullptr, scene_, {});
      const std::size_t before = simulation.size();
      for (const int step : {older / 2, older, newer}) {  // of which the first goes again
        advance(simulation, step == older / 2 ? step : step == older ? older / 2 : newer - older);
        checkpoints.keep(output, step, all);
        EXPECT_TRUE(step < older || simulation.size() != before);  // dealt out anew
      }
      advance(simulation, last - newer);
      out[static_cast<std::size_t>(simulation.ranks().here())] = digest_of(simulation);
    });
    return out;
  }
  /// What they come to from the checkpoint of `step`, if that is what they find; 0: from none.
  std::vector<std::string> go_on(int step, int count = 3) const {
    std::vector<std::string> out(static_cast<std::size_t>(count));
    on(count, [&](Simulation& simulation, Checkpoints& checkpoints, const Passes& all) {
      EXPECT_EQ(checkpoints.restore(all), step > 0);
      advance(simulation, last - step);
      out[static_cast<std::size_t>(simulation.ranks().here())] = digest_of(simulation);
    });
    return out;
  }

  Case scene_ = Case::load(GRAINPAIR_SOURCE "/cases/column_ci", {"mpm.cell_size=0.0008"});
  // of this test alone: others run at the same time
  fs::path folder_ =
      fs::path(testing::TempDir()) /
      fmt::format("ranks_keep_{}", testing::UnitTest::GetInstance()->current_test_info()->name());
  fs::path result_ = folder_ / "r.h5";
};

TEST_F(RanksKeep, TheNewestIsGoneOnFromToTheLastBit) {
  const auto undisturbed = keep_and_stop();
  EXPECT_FALSE(fs::exists(part(older / 2, 0)) || fs::exists(part(older / 2, 2)));
  EXPECT_EQ(go_on(newer), undisturbed);
  EXPECT_EQ(go_on(newer), undisturbed);  // it is there still
  EXPECT_NE(go_on(newer)[0], undisturbed[1]);
}

TEST_F(RanksKeep, OneThatARankLacksGivesWayToTheOneBefore) {
  const auto undisturbed = keep_and_stop();
  fs::remove(part(newer, 1));
  EXPECT_EQ(go_on(older), undisturbed);
  EXPECT_FALSE(fs::exists(part(newer, 0)) || fs::exists(part(newer, 2)));  // of no use
  EXPECT_EQ(go_on(older), undisturbed);
}

TEST_F(RanksKeep, OneThatIsSpoiltGivesWayToTheOneBefore) {
  const auto undisturbed = keep_and_stop();
  std::fstream file(part(newer, 2), std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(5000);
  file.put('\x5a').put('\x33');
  file.close();
  EXPECT_EQ(go_on(older), undisturbed);
}

TEST_F(RanksKeep, WithoutAnyTheyBeginAnew) {
  const auto undisturbed = keep_and_stop();
  fs::remove(part(newer, 1)), fs::remove(part(older, 2));
  EXPECT_EQ(go_on(0), undisturbed);
  EXPECT_FALSE(fs::exists(unfinished()));
}

TEST_F(RanksKeep, OtherNumbersOfRanksBeginAnew) {
  keep_and_stop();
  go_on(0, 2);
  EXPECT_FALSE(fs::exists(unfinished()));
  keep_and_stop();
  const auto one = make_simulation(scene_, {});
  const Passes all = [&](Archive& to) { one->archive(to); };
  EXPECT_FALSE(Checkpoints(result_.string(), nullptr, scene_, all, alone()).restore(all));
  EXPECT_FALSE(fs::exists(unfinished()));
}

TEST_F(RanksKeep, WhatTheyDoNotOwnStays) {
  keep_and_stop();
  const fs::path other = unfinished() / "checkpoint-7.1.old";
  std::ofstream(other) << "of somebody";
  on(3, [&](Simulation&, Checkpoints& checkpoints, const Passes&) { checkpoints.remove(); });
  EXPECT_EQ(std::distance(fs::directory_iterator(unfinished()), {}), 1);
  EXPECT_TRUE(fs::exists(other));
}

/// Without a place for it on one rank: all go on without, and what is there already stays whole.
TEST_F(RanksKeep, WhereOneCannotKeepNoneDoes) {
  const auto undisturbed = keep_and_stop();
  fs::create_directory(unfinished() / "part.1");
  on(3, [&](Simulation& simulation, Checkpoints& checkpoints, const Passes& all) {
    ASSERT_TRUE(checkpoints.restore(all));
    advance(simulation, 10);
    Output output(nullptr, scene_, {});
    checkpoints.keep(output, newer + 10, all);
    EXPECT_FALSE(checkpoints.due());
    EXPECT_EQ(simulation.ranks().all(fs::exists(part(newer + 10, 0)) ? 1 : 0)[0], 0);
  });
  for (const int rank : {0, 1, 2}) {
    EXPECT_FALSE(fs::exists(part(newer + 10, rank)));
    EXPECT_TRUE(fs::exists(part(newer, rank)));
  }
  EXPECT_EQ(go_on(newer), undisturbed);
}

/// The control: each of what ranks alone have is missed. (Cuts are not left out: ranks that do not
/// agree on them would take each other's sums for something else.)
TEST_F(RanksKeep, WhatIsLeftOutIsMissed) {
  std::array<Kept, 2> kept;
  std::array<std::string, 2> undisturbed;
  const auto own = [](auto& of, const Simulation& simulation) -> auto& {
    return of[static_cast<std::size_t>(simulation.ranks().here())];
  };
  const auto told = [](Simulation& simulation) {  // at once, and of 60 steps
    const double energy = simulation.ledger().kinetic;
    advance(simulation, 60);
    return fmt::format("{:a} {}", energy, digest_of(simulation));
  };
  on(2, [&](Simulation& simulation, Checkpoints&, const Passes&) {
    advance(simulation, older);
    simulation.archive(own(kept, simulation));
    own(undisturbed, simulation) = told(simulation);
  });
  for (const std::string but : {"", "here", "unequal", "agreed", "all", "drift", "ledger"}) {
    std::array<std::string, 2> found;
    on(2, [&](Simulation& simulation, Checkpoints&, const Passes&) {
      own(kept, simulation).put_back(but);
      simulation.archive(own(kept, simulation));
      own(found, simulation) = told(simulation);
    });
    EXPECT_EQ(found == undisturbed, but.empty()) << but;
  }
}

}  // namespace
}  // namespace grainpair
