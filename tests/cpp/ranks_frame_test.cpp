// A frame of ranks has every point's row, in however many pieces its rows are brought together.
#include <gtest/gtest.h>

#include <mutex>

#include "mpm/output/output.hpp"
#include "mpm/step/simulation.hpp"
#include "thread_ranks.hpp"

namespace grainpair {
namespace {

class RanksWrite : public testing::TestWithParam<std::size_t> {};

TEST_P(RanksWrite, EachPointIntoItsRow) {
  const Case scene = Case::load(GRAINPAIR_SOURCE "/cases/column_ci", {"mpm.cell_size=0.0008"});
  const std::string path = testing::TempDir() + fmt::format("ranks_frame_{}.h5", GetParam());
  std::map<std::uint32_t, Vec3> places;
  std::map<std::uint32_t, double> regimes;
  std::mutex one;
  with_ranks(3, [&](const Ranks& ranks) {
    std::optional<Draft> draft;
    if (ranks.here() == 0) draft.emplace(path);
    const auto simulation = make_simulation(scene, {}, ranks);
    for (int k = 0; k < 400; ++k) simulation->step(simulation->stable_step().dt);
    {
      const std::lock_guard lock(one);
      simulation->visit_points([&](const auto& points) {
        for (const std::size_t p : points.occupied())
          places[points.id[p]] = simulation->position(p), regimes[points.id[p]] = points.regime[p];
      });
    }
    Output output(draft ? &*draft : nullptr, scene, {}, GetParam());
    output.frame(*simulation, 400, 1e-5);
    output.energies(*simulation, {});
    output.finish("maximum", {}, 0.0, 400, {});
  });
  const auto file = hdf5::open_file(path);
  const auto of = [&](const std::string& name) {
    return hdf5::read_dataset<double>(file, "data/400/particles/cloud/" + name);
  };
  const auto id = of("id"), x = of("position/x"), y = of("position/y"), regime = of("regime");
  ASSERT_EQ(id.size(), places.size());
  bool moved = false;
  for (std::size_t row = 0; row < id.size(); ++row) {
    const auto number = static_cast<std::uint32_t>(row);
    EXPECT_EQ(id[row], number);
    EXPECT_EQ(x[row], places[number][0]);
    EXPECT_EQ(y[row], places[number][1]);
    EXPECT_EQ(regime[row], regimes[number]);
    moved = moved || x[row] != places[0][0];  // the control: rows differ
  }
  EXPECT_TRUE(moved);
  std::filesystem::remove(path);
}

// One piece; some, of which the last is shorter; many.
INSTANTIATE_TEST_SUITE_P(Pieces, RanksWrite,
                         testing::Values(Output::rows_at_once, std::size_t{300}, std::size_t{7}));

}  // namespace
}  // namespace grainpair
