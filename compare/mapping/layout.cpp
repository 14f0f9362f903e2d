#include "compare/mapping/layout.hpp"

#include <cmath>

namespace grainpair {

Extent extent(const std::vector<RunFile>& runs) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  Extent e{Vec3::Constant(infinite), Vec3::Constant(-infinite), Vec3::Constant(infinite),
           Vec3::Constant(-infinite)};
  for (const auto& run : runs)
    for (std::size_t f = 0; f < run.frames(); ++f)
      if (const auto reach = run.reach(f)) {
        e.lower = e.lower.cwiseMin(reach->lower), e.upper = e.upper.cwiseMax(reach->upper);
        e.grains_lower = e.grains_lower.cwiseMin(reach->grains_lower);
        e.grains_upper = e.grains_upper.cwiseMax(reach->grains_upper);
      }
  if (!e.lower.allFinite())
    throw std::runtime_error(runs.front().file().path() + ": nothing moves in any frame");
  return e;
}

void refuse_strangers(const std::vector<RunFile>& runs) {
  const RunFile& one = runs.front();
  const Scene& s = one.scene();
  const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  for (const RunFile& other : runs) {
    const Scene& t = other.scene();
    bool alike = s.has_case == t.has_case;
    for (int a = 0; a < 3 && alike && !s.has_case; ++a) {
      const auto i = static_cast<std::size_t>(a);
      alike = s.periodic[i] == t.periodic[i] && same(s.wall_low[a], t.wall_low[a]) &&
              same(s.wall_high[a], t.wall_high[a]);
      if (!alike || !s.periodic[i]) continue;
      const Box p = one.box(0), q = other.box(0);
      const double near = 1e-9 * (p.upper[a] - p.lower[a]);
      alike = std::abs(p.lower[a] - q.lower[a]) < near && std::abs(p.upper[a] - q.upper[a]) < near;
    }
    if (!alike)
      throw std::runtime_error(other.file().path() + ": not of the domain of " + one.file().path() +
                               " (walls, periods or a case differ) map them one at a time");
  }
}

Cells cells_between(double wall_low, double wall_high, bool mirror, double lower, double upper,
                    double h, double reach) {
  const Edge edge = mirror ? Edge::mirror : Edge::open;
  const bool low = !std::isnan(wall_low), high = !std::isnan(wall_high);
  if (low && high) {
    const double inside = std::max(1.0, std::round((wall_high - wall_low) / h)),
                 spacing = (wall_high - wall_low) / inside;
    if (mirror) return {wall_low, spacing, inside, edge, edge};
    const double below = std::ceil((reach + std::max(0.0, wall_low - lower)) / spacing),
                 above = std::ceil((reach + std::max(0.0, upper - wall_high)) / spacing);
    return {wall_low - below * spacing, spacing, below + inside + above, edge, edge};
  }
  // Whole cells on either side of a wall, so that it is always a face between cells.
  if (low) {
    const double below =
        mirror ? 0.0 : std::ceil((reach - (std::min(wall_low, lower) - wall_low)) / h);
    const double count = below + std::ceil((std::max(wall_low, upper) - wall_low + reach) / h);
    return {wall_low - below * h, h, count, edge, Edge::open};
  }
  if (high) {
    const double above =
        mirror ? 0.0 : std::ceil((reach + std::max(wall_high, upper) - wall_high) / h);
    const double count = above + std::ceil((wall_high - std::min(wall_high, lower) + reach) / h);
    return {wall_high + above * h - count * h, h, count, Edge::open, edge};
  }
  const double below = std::ceil(reach / h), count = below + std::ceil((upper - lower + reach) / h);
  return {lower - below * h, h, count, Edge::open, Edge::open};
}

}  // namespace grainpair
