// Where the cells lie: one grid for all runs and frames, that fits walls and periods. A domain that
// changes its size from frame to frame keeps its number of cells, whose size follows it.
#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "compare/mapping/run_file.hpp"

namespace grainpair {

struct MapOptions {
  std::vector<std::string> runs;
  std::string output, kernel, walls = "mirror", along = "y";
  double width = 0.0, spacing = 0.0;                          // [d]; 0: the case's
  double density = std::numeric_limits<double>::quiet_NaN();  // of grains without a mass [kg/m3]
  int dimension = 2, threads = 0;
  std::array<std::vector<double>, 3> ranges;  // of x, y, z that is averaged over [m]; empty: all
  std::vector<std::size_t> frames;            // all when empty
  bool average = false, quiet = false, progress = false;
  std::vector<double> span;  // of times that are averaged [s]
};

constexpr double largest_grid =
    5e7;  // cells; a run that needs more has lost a point or mistaken a unit

constexpr double most_periods = 20.0;  // that a kernel reaches over: each is an image of all points

constexpr double widest_contact = 1e6;  // cells that a contact reaches over
constexpr double most_rows = 65536;     // of them, and most cells in a row: the table has no more

/// What all frames of all runs need.
struct Extent {
  Vec3 lower, upper, grains_lower, grains_upper;
};
Extent extent(const std::vector<RunFile>& runs);
/// Refuses runs whose domains have no grid in common.
void refuse_strangers(const std::vector<RunFile>& runs);

/// Cells along one axis.
struct Cells {
  double lower, spacing, count;
  Edge low_edge, high_edge;
};
/// Along an axis that does not repeat: walls (NaN where there is none) are faces between cells, and
/// kernels are folded there if it is `mirror`; other ends lie a kernel's reach beyond the points.
Cells cells_between(double wall_low, double wall_high, bool mirror, double lower, double upper,
                    double h, double reach);

template <int D>
class Layout {
 public:
  /// h: spacing, w: width of the kernel, reach: its support [m].
  Layout(const std::vector<RunFile>& runs, const MapOptions& o, double h, double w, double reach)
      : options_(o), scene_(runs.front().scene()), extent_(extent(runs)), reach_(reach) {
    refuse_strangers(runs);
    common_.along = static_cast<int>(o.along.front() - 'x');
    if (scene_.angle > 0.0) {
      if (D != 2 || !o.ranges[2].empty())
        throw std::runtime_error(runs.front().file().path() +
                                 ": a run about an axis is mapped over radius and height alone "
                                 "leave --dimension and --range-z out");
      common_.angle = scene_.angle, common_.width = w;
    }
    const Box box = runs.front().box(first(o));
    double cells = 1.0;
    for (int a = 0; a < D; ++a) {
      const int i = common_.direction(a);
      const auto j = static_cast<std::size_t>(a);
      if (!o.ranges[static_cast<std::size_t>(i)].empty())
        throw std::runtime_error(fmt::format("--range-{0}: {0} is mapped, not averaged", "xyz"[i]));
      const Cells c =
          periodic(i) ? cells_of_period(box.lower[i], box.upper[i], h) : cells_of_axis(i, h, reach);
      const double span = (extent_.upper[i] - extent_.lower[i]) / h;
      if (!(cells * c.count < largest_grid && span < largest_grid))
        throw std::runtime_error(
            fmt::format("{}: the points span {:.3g} m in {}, {:.3g} cells (a point has escaped, or "
                        "the spacing is too fine)",
                        runs.front().file().path(), extent_.upper[i] - extent_.lower[i], "xyz"[i],
                        cells * std::max(c.count, span)));
      if (c.low_edge == Edge::mirror && c.high_edge == Edge::mirror)
        refuse_images(runs.front(), i, c.count * c.spacing);
      common_.cells[j] = std::max(1, static_cast<int>(c.count));
      common_.lower[a] = c.lower, common_.spacing[a] = c.spacing;
      common_.low_edge[j] = c.low_edge, common_.high_edge[j] = c.high_edge;
      cells *= common_.cells[j];
    }
  }

  SampleGrid<D> grid(const RunFile& run, std::size_t frame) const {
    SampleGrid<D> g = common_;
    const Box box = run.box(frame);
    std::array<bool, 3> mapped{};
    for (int a = 0; a < D; ++a) {
      const int i = g.direction(a);
      mapped[static_cast<std::size_t>(i)] = true;
      if (!periodic(i)) continue;
      refuse_images(run, i, box.upper[i] - box.lower[i]);
      g.lower[a] = box.lower[i];
      g.spacing[a] = (box.upper[i] - box.lower[i]) / g.cells[static_cast<std::size_t>(a)];
    }
    if (g.of_rings()) return g;
    g.depth = 1.0;
    for (int i = 2; i >= 0; --i)
      if (!mapped[static_cast<std::size_t>(i)]) g.depth *= depth(i, box);
    return g;
  }

  /// Refuses contacts that reach over more cells than fit the table of weights.
  void refuse_wide(const RunFile& run, std::size_t frame, const Cloud& cloud) const {
    if (cloud.contacts.empty()) return;
    const SampleGrid<D> g = grid(run, frame);
    for (std::size_t n = 0; n < cloud.contacts.size(); ++n) {
      const Contact& c = cloud.contacts[n];
      const Vec3 size = c.branch.cwiseAbs().cwiseMax((c.point - c.start).cwiseAbs());
      double row = 1.0, rows = 1.0;
      for (int a = 0; a < D; ++a)
        (a == 0 ? row : rows) *= (size[g.direction(a)] + 2.0 * reach_) / g.spacing[a] + 2.0;
      if (row < most_rows && rows < most_rows && row * rows < widest_contact) continue;
      throw std::runtime_error(
          fmt::format("{}: contact {} of frame {}, {:.3g} m long, reaches over {:.3g} cells "
                      "(units? a grain far larger than the others, or too fine a spacing?)",
                      run.file().path(), n, frame, size.norm(), row * rows));
    }
  }

  /// The ranges that a frame's cloud has to be cut to.
  std::vector<Range> cuts(const RunFile& run, std::size_t frame) const {
    const Box box = run.box(frame);
    std::vector<Range> out;
    for (int i = 0; i < 3; ++i) {
      const auto& range = options_.ranges[static_cast<std::size_t>(i)];
      const double period = periodic(i) ? box.upper[i] - box.lower[i] : 0.0;
      if (range.empty()) continue;
      if (periodic(i) && range[1] - range[0] > period * (1.0 + 1e-9))
        throw std::runtime_error(
            fmt::format("--range-{}: longer than the period of {:.4g} m", "xyz"[i], period));
      out.push_back({i, range[0], range[1], period});
    }
    return out;
  }

  /// What is to be said of the grid: "" or a line.
  const std::string& notes() const { return notes_; }

 private:
  /// A domain of `size` that repeats, or lies between mirrors, is an image as often as the kernel
  /// reaches over it.
  void refuse_images(const RunFile& run, int i, double size) const {
    if (reach_ <= most_periods * size) return;
    throw std::runtime_error(
        fmt::format("{}: the kernel reaches {:.3g} m in {}, where all repeats after {:.3g} m "
                    "(units? a box or walls that are not the grains'?)",
                    run.file().path(), reach_, "xyz"[i], size));
  }
  static std::size_t first(const MapOptions& o) { return o.frames.empty() ? 0 : o.frames.front(); }
  bool periodic(int i) const { return scene_.periodic[static_cast<std::size_t>(i)]; }

  static Cells cells_of_period(double lower, double upper, double h) {
    const double count = std::max(1.0, std::round((upper - lower) / h));
    return {lower, (upper - lower) / count, count, Edge::periodic, Edge::periodic};
  }
  Cells cells_of_axis(int i, double h, double reach) {
    if (scene_.angle > 0.0 && i == 0)
      return {0.0, h, std::ceil((extent_.upper[0] + reach) / h), Edge::axis, Edge::open};
    double low = scene_.wall_low[i], high = scene_.wall_high[i];
    // Nothing is folded at a plane that grains lie behind.
    const double d = scene_.grain.diameter;
    if (!scene_.has_case && extent_.lower[i] < low - d) unwall(i, "below", low);
    if (!scene_.has_case && extent_.upper[i] > high + d) unwall(i, "above", high);
    const bool mirror = options_.walls == "mirror" || (scene_.has_case && i == 2);
    return cells_between(low, high, mirror, extent_.lower[i], extent_.upper[i], h, reach);
  }
  void unwall(int i, const char* side, double& wall) {
    notes_ += fmt::format("grains lie {} the wall at {} = {:.4g} m, which is none to the kernel; ",
                          side, "xyz"[i], wall);
    wall = std::numeric_limits<double>::quiet_NaN();
  }
  double depth(int i, const Box& box) const {
    const auto& range = options_.ranges[static_cast<std::size_t>(i)];
    if (!range.empty()) return range[1] - range[0];
    if (periodic(i)) return box.upper[i] - box.lower[i];
    const double low = scene_.wall_low[i], high = scene_.wall_high[i];
    return (std::isnan(high) ? extent_.grains_upper[i] : high) -
           (std::isnan(low) ? extent_.grains_lower[i] : low);
  }

  const MapOptions& options_;
  Scene scene_;
  Extent extent_;
  double reach_;  // of the kernel [m]
  SampleGrid<D> common_;
  std::string notes_;
};

}  // namespace grainpair
