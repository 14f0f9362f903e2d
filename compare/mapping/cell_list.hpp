// Cell list: points sorted into bins, so that those near a position lie in a few runs of memory, in
// fixed order. Directions follow SampleGrid; periodic where the grid is.
#pragma once

#include <numeric>

#include "compare/mapping/coarse_grain.hpp"

namespace grainpair {

template <int D>
class CellList {
 public:
  using Point = typename SampleGrid<D>::Point;

  CellList(const std::vector<Vec3>& positions, const SampleGrid<D>& grid, double cutoff)
      : cutoff_(cutoff) {
    lower_ = positions.empty() ? Point::Zero().eval() : grid.project(positions.front());
    Point upper = lower_;
    for (const auto& x : positions)
      lower_ = lower_.cwiseMin(grid.project(x)), upper = upper.cwiseMax(grid.project(x));
    const double least = 0.5 * cutoff;  // side of a bin: small ones leave fewer points in vain
    // Bins that would nearly all be empty (a point far away) cost memory for nothing.
    const double most = 1e6 + 8.0 * static_cast<double>(positions.size());
    double bins = 0.0;
    for (double coarser = 1.0; bins == 0.0 || bins > most; coarser *= 2.0) {
      bins = 1.0;
      for (int a = 0; a < D; ++a) {
        period_[a] = grid.low_edge[a] == Edge::periodic ? grid.cells[a] * grid.spacing[a] : 0.0;
        const double side = coarser * least;
        bins_[a] = std::max(1, static_cast<int>(std::min((upper[a] - lower_[a]) / side, 1e9)));
        side_[a] = std::max(side, (upper[a] - lower_[a]) / bins_[a] * (1.0 + 1e-12));
        bins *= bins_[a];
      }
    }
    begin_.assign(static_cast<std::size_t>(
                      std::accumulate(bins_.begin(), bins_.end(), 1, std::multiplies<>())) +
                      1,
                  0);
    for (const auto& x : positions) ++begin_[bin(grid.project(x)) + 1];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    order_.resize(positions.size());
    auto next = begin_;
    for (std::size_t p = 0; p < positions.size(); ++p)
      order_[next[bin(grid.project(positions[p]))]++] = p;
    for (int a = 0; a < D; ++a)
      for (const std::size_t p : order_) x_[a].push_back(grid.project(positions[p])[a]);
  }

  /// The points in the list's order, and their coordinate along grid axis `a`.
  const std::vector<std::size_t>& order() const { return order_; }
  const std::vector<double>& coordinate(int a) const { return x_[a]; }

  /// visit(r, begin, end) for runs of the order that together hold every point within the cutoff of
  /// r, where r is the given place or a periodic image of it.
  template <class Visit>
  void runs(const Point& r, Visit visit) const {
    // Images within reach: those shifts that bring p's ball onto the box of the points.
    std::array<int, 3> reach{0, 0, 0};
    for (int a = 0; a < D; ++a)
      if (period_[a] > 0.0) reach[a] = static_cast<int>(std::ceil(cutoff_ / period_[a])) + 1;
    Point shift = Point::Zero();
    for (int i2 = -reach[2]; i2 <= reach[2]; ++i2)
      for (int i1 = -reach[1]; i1 <= reach[1]; ++i1)
        for (int i0 = -reach[0]; i0 <= reach[0]; ++i0) {
          shift[0] = i0 * period_[0];
          if constexpr (D > 1) shift[1] = i1 * period_[1];
          if constexpr (D > 2) shift[2] = i2 * period_[2];
          near(r + shift, visit);
        }
  }

 private:
  /// Beside the bins, -1 or their number: an image of a place may lie any number of bins away.
  int index(int a, double x) const {
    return static_cast<int>(
        std::clamp(std::floor((x - lower_[a]) / side_[a]), -1.0, static_cast<double>(bins_[a])));
  }
  std::size_t bin(const Point& r) const {
    std::size_t k = 0;
    for (int a = D - 1; a >= 0; --a)
      k = k * static_cast<std::size_t>(bins_[a]) +
          static_cast<std::size_t>(std::clamp(index(a, r[a]), 0, bins_[a] - 1));
    return k;
  }
  template <class Visit>
  void near(const Point& r, Visit& visit) const {
    std::array<int, 3> lo{0, 0, 0}, hi{0, 0, 0};
    for (int a = 0; a < D; ++a) {
      lo[a] = std::max(0, index(a, r[a] - cutoff_)),
      hi[a] = std::min(bins_[a] - 1, index(a, r[a] + cutoff_));
      if (lo[a] > hi[a]) return;
    }
    const auto at = [&](int a) { return a < D ? static_cast<std::size_t>(bins_[a]) : 1; };
    for (int k2 = lo[2]; k2 <= hi[2]; ++k2)
      for (int k1 = lo[1]; k1 <= hi[1]; ++k1) {
        const std::size_t row =
            (static_cast<std::size_t>(k2) * at(1) + static_cast<std::size_t>(k1)) * at(0);
        visit(r, begin_[row + static_cast<std::size_t>(lo[0])],
              begin_[row + static_cast<std::size_t>(hi[0]) + 1]);
      }
  }

  double cutoff_;
  std::array<std::vector<double>, D> x_;
  Point lower_;
  std::array<double, D> side_, period_;
  std::array<int, D> bins_;
  std::vector<std::size_t> begin_, order_;
};

}  // namespace grainpair
