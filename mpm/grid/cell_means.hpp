// Means of points over the cells they lie in: points give, then points take. The sums pass through
// three hands, and each is a type of its own: cleared slice by slice (ClearingCells), given to
// (GivingCells), taken from (GivenCells). So no sweep can meet them out of order.
#pragma once

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "mpm/numbers/archive.hpp"
#include "mpm/numbers/rows.hpp"

namespace grainpair {

/// Two quantities of the points of a cell, each with its weight; divided by these, their means;
/// without, of no meaning.
template <class Real>
struct CellSums {
  Real weight = 0.0, value = 0.0, other_weight = 0.0, other_value = 0.0;

  CellSums& operator+=(const CellSums& more) {
    weight += more.weight, value += more.value;
    other_weight += more.other_weight, other_value += more.other_value;
    return *this;
  }
};

class GivenCells;

/// Sums that hold what is no longer asked for.
class ClearingCells {
 public:
  explicit ClearingCells(std::size_t cells = 0) : sums_(cells) {}
  ClearingCells(GivenCells&& old);

  void resize(std::size_t cells) { sums_.resize(cells); }
  /// `count` cells from `first` on; nothing where there are none.
  void clear(std::size_t first, std::size_t count) {
    if (sums_.empty()) return;
    std::fill_n(sums_.begin() + static_cast<std::ptrdiff_t>(first), count, CellSums<double>{});
  }
  void clear() { std::fill(sums_.begin(), sums_.end(), CellSums<double>{}); }

 private:
  friend class GivingCells;
  std::vector<CellSums<double>> sums_;
};

/// Sums that points give to.
class GivingCells {
 public:
  /// `cleared`: of every slice.
  explicit GivingCells(ClearingCells&& cleared) : sums_(std::move(cleared.sums_)) {}

  /// Adds what points bring to their cells, numbered `at`.
  void give(const Index<Wide>& at, const CellSums<Wide>& sums) {
    if (alike(at)) return add_sums<CellSums>(sums, [&](std::size_t) { return row(at[0]); });
    add_rows<CellSums>(sums, [&](std::size_t lane) { return row(at[lane]); });
  }

  /// Of `slices` alike: adds one to another, or puts one in place of another.
  void add_slice(std::size_t slice, std::size_t to, std::size_t slices) {
    const std::size_t cells = sums_.size() / slices;
    for (std::size_t c = 0; c < cells; ++c) sums_[to * cells + c] += sums_[slice * cells + c];
  }
  void copy_slice(std::size_t slice, std::size_t to, std::size_t slices) {
    const std::size_t cells = sums_.size() / slices;
    for (std::size_t c = 0; c < cells; ++c) sums_[to * cells + c] = sums_[slice * cells + c];
  }
  /// The cells of slices begin ... end - 1 of `slices` alike.
  std::span<CellSums<double>> cells_of(std::size_t begin, std::size_t end, std::size_t slices) {
    const std::size_t cells = sums_.size() / slices;
    return std::span(sums_).subspan(begin * cells, (end - begin) * cells);
  }

 private:
  friend class GivenCells;
  double* row(int cell) { return &sums_[static_cast<std::size_t>(cell)].weight; }
  std::vector<CellSums<double>> sums_;
};

/// Sums that every point has given to.
class GivenCells {
 public:
  GivenCells() = default;
  explicit GivenCells(GivingCells&& given) : sums_(std::move(given.sums_)) {}

  /// The sums of the cells of several points, numbered `at`.
  CellSums<Wide> take(const Index<Wide>& at) const {
    return alike(at) ? broadcast<CellSums>(&sums_[static_cast<std::size_t>(at[0])].weight)
                     : look_up<CellSums>(sums_.data(), at);
  }
  void archive(const std::string& name, Archive& to) { to.structs<double>(name, sums_); }

 private:
  friend class ClearingCells;
  std::vector<CellSums<double>> sums_;
};

inline ClearingCells::ClearingCells(GivenCells&& old) : sums_(std::move(old.sums_)) {}

}  // namespace grainpair
