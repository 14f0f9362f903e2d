// A scene that ranks share is that of one process, to round-off: here the ranks are threads.
#include <gtest/gtest.h>
#include <omp.h>

#include <mutex>

#include "mpm/step/simulation.hpp"
#include "thread_ranks.hpp"

namespace grainpair {
namespace {

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

End followed(const Case& scene, int ranks, double until, Deaf deaf = Deaf::nowhere) {
  End end;
  std::mutex one;
  if (ranks == 1) {
    follow(scene, alone(), until, end, one);
    return end;
  }
  with_ranks(
      ranks, [&](const Ranks& own) { follow(scene, own, until, end, one); }, deaf);
  return end;
}

/// The largest distance between where points are [m], infinite where one is missing; where the
/// scene repeats along x, between the nearest images.
double apart(const End& a, const End& b, double period = std::numeric_limits<double>::infinity()) {
  double out = a.places.size() == b.places.size() ? 0.0 : std::numeric_limits<double>::infinity();
  for (const auto& [id, x] : a.places) {
    if (!b.places.contains(id)) return std::numeric_limits<double>::infinity();
    Vec3 between = b.places.at(id) - x;
    if (std::abs(between[0]) > 0.5 * period) between[0] -= std::copysign(period, between[0]);
    out = std::max(out, between.norm());
  }
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
  const double period = scene.chute() ? length : std::numeric_limits<double>::infinity();
  const End one = followed(scene, 1, until), many = followed(scene, of.ranks, until);
  const End other = followed(load("grains.density=2532.0000000001"), 1, until);
  const auto allowed = [](double a, double b, double least) {
    return 10.0 * std::abs(a - b) + least;
  };
  const double of_ranks = apart(one, many, period), of_density = apart(one, other, period);
  EXPECT_LT(of_ranks, 10.0 * of_density + 1e-13 * length);
  EXPECT_LT(of_density, 1e-4 * length);  // or it would tell nothing
  EXPECT_GT(many.moved, 0u);             // some have changed hands
  const double held = one.ledger.held();
  EXPECT_NEAR(one.ledger.kinetic, many.ledger.kinetic,
              allowed(one.ledger.kinetic, other.ledger.kinetic, 1e-12 * held));
  EXPECT_NEAR(one.ledger.total(), many.ledger.total(),
              allowed(one.ledger.total(), other.ledger.total(), 1e-12 * held));
  EXPECT_NEAR(one.ledger.transfer, many.ledger.transfer,
              allowed(one.ledger.transfer, other.ledger.transfer, 1e-12 * held));
  RecordProperty("apart", fmt::format("{:.3g} of {:.3g}", of_ranks, of_density));
  fmt::print("{}: {:.3g} m apart, {:.3g} m of the other density\n", of.name, of_ranks, of_density);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, RanksShare,
    testing::Values(
        Shared{"two", "column_ci", {"mpm.cell_size=0.001"}, 2, 1.2},
        Shared{"three", "column_small", {"mpm.cell_size=0.0016"}, 3, 0.6},
        Shared{"own", "column_ci", {"mpm.volumetric_averaging=none"}, 2, 1.0},
        Shared{"xpic", "column_ci", {"mpm.transfer=xpic", "mpm.shape=gimp"}, 2, 1.2},
        Shared{"musl", "column_ci", {"mpm.stress_update=musl"}, 2, 1.0},
        Shared{"heat", "column_small", {"mpm.cell_size=0.003", "material.conduction=true"}, 2, 0.7},
        Shared{"space",
               "column_ci",
               {"geometry.dimension=three_dimensional", "mpm.cell_size=0.001",
                "geometry.thickness=0.002"},
               2,
               1.0},
        // the surface passes some six periods
        Shared{"chute",
               "chute_ci",
               {"mpm.cell_size=0.00075", "initial.velocity=1", "mpm.jitter=0.3"},
               2,
               1.0},
        Shared{"ring",
               "chute_ci",
               {"mpm.cell_size=0.0005", "initial.velocity=1", "mpm.jitter=0.3", "mpm.shape=gimp"},
               3,
               0.5},
        Shared{"cubic",
               "chute_ci",
               {"mpm.cell_size=0.00075", "initial.velocity=1", "mpm.jitter=0.3",
                "mpm.shape=cubic_bspline", "material.conduction=true"},
               2,
               0.15},
        Shared{"crowd",
               "chute_ci",
               {"mpm.cell_size=0.0005", "initial.velocity=1", "mpm.jitter=0.3",
                "mpm.volume_relaxation=1"},
               3,
               0.5},
        Shared{
            "slope",
            "chute_ci",
            {"geometry.dimension=three_dimensional", "mpm.cell_size=0.001", "initial.velocity=1",
             "geometry.length=0.016", "geometry.thickness=0.002", "mpm.volumetric_averaging=none"},
            2,
            0.5}),
    [](const auto& instance) { return std::string(instance.param.name); });

/// The controls.
TEST(Ranks, WithoutTheirNeighboursSumsTheyHaveAnotherColumn) {
  const Case scene = Case::load(GRAINPAIR_SOURCE "/cases/column_ci", {"mpm.precision=double"});
  const double until = 0.3 * time_scale(scene);
  EXPECT_GT(apart(followed(scene, 1, until), followed(scene, 2, until, Deaf::everywhere)),
            1e-6 * scene.number("geometry.length"));
}

TEST(Ranks, WithoutSumsBetweenTheLastAndTheFirstTheyHaveAnotherChute) {
  const Case scene = Case::load(GRAINPAIR_SOURCE "/cases/chute_ci",
                                {"mpm.precision=double", "mpm.cell_size=0.00075"});
  const double until = 0.3 * time_scale(scene), length = scene.number("geometry.length");
  const End one = followed(scene, 1, until);
  EXPECT_LT(apart(one, followed(scene, 2, until), length), 1e-12 * length);
  EXPECT_GT(apart(one, followed(scene, 2, until, Deaf::between_last_and_first), length),
            1e-6 * length);
}

TEST(Ranks, TooManyAreRefused) {
  const Case scene = Case::load(GRAINPAIR_SOURCE "/cases/column_ci", {});
  Table table(1);
  class Many final : public Ranks {
    int count() const override { return 3; }
  } const many;
  EXPECT_THROW(make_simulation(scene, {}, many), CaseError);
}

}  // namespace
}  // namespace grainpair
