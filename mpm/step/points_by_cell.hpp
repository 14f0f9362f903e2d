// Points by the cells that they lie in.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

namespace grainpair {

/// Sorted by counting: where each cell begins, of those between the first and the last that has
/// points. Points of a cell keep their order.
class PointsByCell {
 public:
  /// `points`: a range of their numbers; `cell[p]`: of point p.
  template <class Range>
  PointsByCell(const Range& points, std::span<const std::int32_t> cell) {
    std::int32_t last = -1;
    first_ = std::numeric_limits<std::int32_t>::max();
    for (const std::size_t p : points)
      first_ = std::min(first_, cell[p]), last = std::max(last, cell[p]);
    if (last < 0) return;
    const auto at = [&](std::size_t p) { return static_cast<std::size_t>(cell[p] - first_); };
    begin_.resize(static_cast<std::size_t>(last - first_) + 2);
    for (const std::size_t p : points) ++begin_[at(p) + 1];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    points_.resize(begin_.back());
    for (const std::size_t p : points) points_[begin_[at(p)]++] = static_cast<std::uint32_t>(p);
    std::shift_right(begin_.begin(), begin_.end(), 1);  // each has moved on to the next
    begin_.front() = 0;
  }

  std::size_t size() const { return points_.size(); }
  /// f(cell, its points) of every cell that has any, in their order.
  template <class F>
  void for_each(F&& f) const {
    for (std::size_t c = 0; c + 1 < begin_.size(); ++c)
      if (begin_[c] < begin_[c + 1])
        f(static_cast<std::size_t>(first_) + c,
          std::span(points_).subspan(begin_[c], begin_[c + 1] - begin_[c]));
  }

 private:
  std::int32_t first_ = 0;
  std::vector<std::uint32_t> begin_, points_;
};

}  // namespace grainpair
