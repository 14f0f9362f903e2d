// Means of points over the cells they lie in: points give, then points take.
#pragma once

#include <algorithm>
#include <vector>

#include "mpm/numbers/rows.hpp"

namespace grainpair {

/// Two quantities of the points of a cell, each with its weight; divided by these, their means;
/// without, of no meaning.
template <class Real>
struct CellSums {
  Real weight = 0.0, value = 0.0, other_weight = 0.0, other_value = 0.0;
};

class CellMeans {
 public:
  void resize(std::size_t cells) { sums_.assign(cells, {}); }
  void clear() { std::fill(sums_.begin(), sums_.end(), CellSums<double>{}); }
  /// Column `i` of `columns` alike, the cells of which follow each other.
  void clear_column(std::size_t i, std::size_t columns) {
    const std::size_t cells = sums_.size() / columns;
    std::fill_n(sums_.begin() + static_cast<std::ptrdiff_t>(i * cells), cells, CellSums<double>{});
  }
  /// Adds what points bring to their cells, `cell` [number].
  void give(const Wide& cell, const CellSums<Wide>& sums) {
    const auto at = index_below(cell);
    if (alike(cell))
      return add_sums<CellSums>(
          sums, [&](std::size_t) { return &sums_[static_cast<std::size_t>(at[0])].weight; });
    add_rows<CellSums>(
        sums, [&](std::size_t lane) { return &sums_[static_cast<std::size_t>(at[lane])].weight; });
  }
  /// The sums of their cells.
  CellSums<Wide> take(const Wide& cell) const {
    const auto at = index_below(cell);
    return alike(cell) ? broadcast<CellSums>(&sums_[static_cast<std::size_t>(at[0])].weight)
                       : look_up<CellSums>(sums_.data(), at);
  }

 private:
  std::vector<CellSums<double>> sums_;
};

}  // namespace grainpair
