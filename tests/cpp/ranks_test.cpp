// A scene that ranks share is that of one process, to round-off: here the ranks are threads.
#include <gtest/gtest.h>
#include <omp.h>

#include <barrier>
#include <mutex>
#include <thread>

#include "mpm/step/simulation.hpp"

namespace grainpair {
namespace {

/// What threads of one process say to each other, each at its place.
class Table {
 public:
  explicit Table(int ranks) : places_(static_cast<std::size_t>(ranks)), all_(ranks) {}
  int count() const { return static_cast<int>(places_.size()); }
  /// Lays `mine` down, and lets `read` look at every place once all have done so.
  template <class F>
  void meet(int here, Bytes mine, F&& read) {
    places_[static_cast<std::size_t>(here)] = std::move(mine);
    all_.arrive_and_wait();
    read(std::as_const(places_));
    all_.arrive_and_wait();
  }
  /// Of a rank that goes: nobody waits for it any more.
  void leave() { all_.arrive_and_drop(); }

 private:
  std::vector<Bytes> places_;
  std::barrier<> all_;
};

/// A thread's rank; a `deaf` one hears nothing from its neighbours but silence.
class ThreadRanks final : public Ranks {
 public:
  ThreadRanks(Table& table, int here, bool deaf) : table_(table), here_(here), deaf_(deaf) {}
  int here() const override { return here_; }
  int count() const override { return table_.count(); }
  bool balance() const override { return true; }
  using Ranks::swap;
  void swap(std::span<const std::byte> to_left, std::span<const std::byte> to_right,
            std::span<std::byte> from_left, std::span<std::byte> from_right) const override {
    Bytes both(to_left.begin(), to_left.end());
    both.insert(both.end(), to_right.begin(), to_right.end());
    const bool sums = to_left.size() + to_right.size() > 2 * sizeof(std::size_t);
    table_.meet(here_, std::move(both), [&](const std::vector<Bytes>& places) {
      if (deaf_ && sums) {
        std::ranges::fill(from_left, std::byte{0}), std::ranges::fill(from_right, std::byte{0});
        return;
      }
      const auto at = static_cast<std::size_t>(here_);
      if (has_left())
        std::copy_n(places[at - 1].end() - length(from_left), from_left.size(), from_left.begin());
      if (has_right()) std::copy_n(places[at + 1].begin(), from_right.size(), from_right.begin());
    });
  }

 protected:
  void gather_all(const void* mine, void* all, std::size_t size) const override {
    const auto* const own = static_cast<const std::byte*>(mine);
    table_.meet(here_, {own, own + size}, [&](const std::vector<Bytes>& places) {
      auto* to = static_cast<std::byte*>(all);
      for (const Bytes& place : places) to = std::ranges::copy(place, to).out;
    });
  }
  Bytes gather(std::span<const std::byte> mine) const override {
    Bytes out;
    table_.meet(here_, {mine.begin(), mine.end()}, [&](const std::vector<Bytes>& places) {
      if (here_ == 0)
        for (const Bytes& place : places) out.insert(out.end(), place.begin(), place.end());
    });
    return out;
  }

 private:
  static std::ptrdiff_t length(std::span<std::byte> bytes) {
    return static_cast<std::ptrdiff_t>(bytes.size());
  }
  Table& table_;
  int here_;
  bool deaf_;
};

/// Where points are after some steps, and what their energies are.
struct End {
  std::map<std::uint32_t, Vec3> places;
  EnergyLedger ledger;
  std::size_t moved = 0;  // points that are with another rank than at the start
};

std::set<std::uint32_t> ids(const Simulation& simulation) {
  std::set<std::uint32_t> out;
  simulation.visit_points([&](const auto& points) {
    for (const std::size_t p : points.occupied()) out.insert(points.id[p]);
  });
  return out;
}

/// Follows a column, or a rank's part of it, and adds its points to `end`.
void follow(const Case& scene, const Ranks& ranks, double until, End& end, std::mutex& one) {
  omp_set_num_threads(1);
  const auto simulation = make_simulation(scene, {}, ranks);
  const auto begin = ids(*simulation);
  while (simulation->time() < until)
    simulation->step(std::min(simulation->stable_step().dt, until - simulation->time() + 1e-12));
  const std::lock_guard lock(one);
  end.ledger = simulation->ledger();
  for (const auto id : ids(*simulation)) end.moved += !begin.contains(id);
  simulation->visit_points([&](const auto& points) {
    for (const std::size_t p : points.occupied())
      end.places[points.id[p]] = simulation->position(p);
  });
}

End followed(const Case& scene, int ranks, double until, bool deaf = false) {
  End end;
  std::mutex one;
  if (ranks == 1) {
    follow(scene, alone(), until, end, one);
    return end;
  }
  Table table(ranks);
  std::vector<std::jthread> threads;
  for (int r = 0; r < ranks; ++r)
    threads.emplace_back([&, r] {
      try {
        follow(scene, ThreadRanks(table, r, deaf), until, end, one);
      } catch (const SolverError&) {  // all of them throw it
      }
      table.leave();
    });
  threads.clear();
  return end;
}

/// The largest distance between where points are [m], infinite where one is missing.
double apart(const End& a, const End& b) {
  double out = a.places.size() == b.places.size() ? 0.0 : std::numeric_limits<double>::infinity();
  for (const auto& [id, x] : a.places)
    out = b.places.contains(id) ? std::max(out, (b.places.at(id) - x).norm())
                                : std::numeric_limits<double>::infinity();
  return out;
}

struct Shared {
  const char* name;
  const char* of;  // a case
  std::vector<std::string> keys;
  int ranks;
  double until;  // [sqrt(H/g)]
};

class RanksShare : public testing::TestWithParam<Shared> {};

// Sums at nodes that two ranks share are taken in another order. What such round-off grows to, a
// column tells whose density differs in the fourteenth digit; ten times that is allowed, and 1e-13
// of the column.
TEST_P(RanksShare, AColumnAsOneProcessHasIt) {
  const Shared& of = GetParam();
  const auto load = [&](const char* density) {
    std::vector<std::string> keys{"mpm.precision=double", density};
    keys.insert(keys.end(), of.keys.begin(), of.keys.end());
    return Case::load(std::string(GRAINPAIR_SOURCE "/cases/") + of.of, keys);
  };
  const Case scene = load("grains.density=2532");
  const double until = of.until * time_scale(scene), length = scene.number("geometry.length");
  const End one = followed(scene, 1, until), many = followed(scene, of.ranks, until);
  const End other = followed(load("grains.density=2532.0000000001"), 1, until);
  const auto allowed = [](double a, double b, double least) {
    return 10.0 * std::abs(a - b) + least;
  };
  EXPECT_LT(apart(one, many), 10.0 * apart(one, other) + 1e-13 * length);
  EXPECT_LT(apart(one, other), 1e-4 * length);  // or it would tell nothing
  EXPECT_GT(many.moved, 0u);                    // some have changed hands
  const double held = one.ledger.held();
  EXPECT_NEAR(one.ledger.kinetic, many.ledger.kinetic,
              allowed(one.ledger.kinetic, other.ledger.kinetic, 1e-12 * held));
  EXPECT_NEAR(one.ledger.total(), many.ledger.total(),
              allowed(one.ledger.total(), other.ledger.total(), 1e-12 * held));
  EXPECT_NEAR(one.ledger.transfer, many.ledger.transfer,
              allowed(one.ledger.transfer, other.ledger.transfer, 1e-12 * held));
  RecordProperty("apart", fmt::format("{:.3g} of {:.3g}", apart(one, many), apart(one, other)));
  fmt::print("{}: {:.3g} m apart, {:.3g} m of the other density\n", of.name, apart(one, many),
             apart(one, other));
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, RanksShare,
    testing::Values(
        Shared{"two", "column_ci", {"mpm.cell_size=0.001"}, 2, 1.2},
        Shared{"three", "column_small", {"mpm.cell_size=0.0016"}, 3, 0.6},
        Shared{"nodal", "column_ci", {"mpm.volumetric_averaging=nodal"}, 2, 1.0},
        Shared{"xpic", "column_ci", {"mpm.transfer=xpic", "mpm.shape=gimp"}, 2, 1.2},
        Shared{"musl", "column_ci", {"mpm.stress_update=musl"}, 2, 1.0},
        Shared{"heat", "column_small", {"mpm.cell_size=0.003", "material.conduction=true"}, 2, 0.7},
        Shared{"space",
               "column_ci",
               {"geometry.dimension=three_dimensional", "mpm.cell_size=0.001",
                "geometry.thickness=0.002"},
               2,
               1.0}),
    [](const auto& instance) { return std::string(instance.param.name); });

/// The control.
TEST(Ranks, WithoutTheirNeighboursSumsTheyHaveAnotherColumn) {
  const Case scene = Case::load(GRAINPAIR_SOURCE "/cases/column_ci", {"mpm.precision=double"});
  const double until = 0.3 * time_scale(scene);
  EXPECT_GT(apart(followed(scene, 1, until), followed(scene, 2, until, true)),
            1e-6 * scene.number("geometry.length"));
}

TEST(Ranks, TooManyAreRefused) {
  const Case scene = Case::load(GRAINPAIR_SOURCE "/cases/column_ci", {});
  Table table(1);
  class Many final : public Ranks {
    int count() const override { return 3; }
  } const many;
  EXPECT_THROW(make_simulation(scene, {}, many), CaseError);
  EXPECT_THROW(make_simulation(Case::load(GRAINPAIR_SOURCE "/cases/chute_ci", {}), {}, many),
               CaseError);
}

}  // namespace
}  // namespace grainpair
