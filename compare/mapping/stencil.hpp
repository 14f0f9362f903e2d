// Stencils: the sparse table of weights phi_kp between grid cells k and items p (points, or contact
// branches), and sums over it.
#pragma once

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>

#include "compare/mapping/rings.hpp"

namespace grainpair {

struct Weight {
  std::uint32_t item;
  std::array<std::int8_t, 3>
      image;     // periods by which the item's lattice cell was wrapped, per axis
  double value;  // phi_kp, integrates to one over the grid [1/m3]
};

/// Weights by cell. Items stand in the order of the cloud, so every sum has one order for any
/// number of threads.
class Stencils {
 public:
  std::span<const Weight> of_cell(std::size_t k) const {
    return {weights_.data() + begin_[k], weights_.data() + begin_[k + 1]};
  }
  std::size_t pairs() const { return weights_.size(); }

 private:
  template <int D, class Place>
  friend Stencils make_stencils(const SampleGrid<D>&, std::size_t, Place);
  std::vector<std::size_t> begin_;
  std::vector<Weight> weights_;
};

namespace stencil_detail {

/// Index inside 0 .. n-1 of lattice cell k, and how many periods away it was; index -1 beyond an
/// open edge.
struct Folded {
  int index;
  std::int8_t image;
};
inline Folded fold(int k, int n, Edge low, Edge high) {
  if (k >= 0 && k < n) return {k, 0};
  if (low == Edge::periodic) {
    const int image = k >= 0 ? k / n : -((n - 1 - k) / n);
    return {k - image * n, static_cast<std::int8_t>(image)};
  }
  if (k < 0) return {low == Edge::mirror ? std::min(-1 - k, n - 1) : -1, 0};
  return {high == Edge::mirror ? std::max(2 * n - 1 - k, 0) : -1, 0};
}

/// Of lattice cell k along grid axis `a`, its index in the part of the grid; -1 outside that.
template <int D>
Folded folded(const SampleGrid<D>& grid, int a, int k) {
  const auto i = static_cast<std::size_t>(a);
  Folded f = fold(k, grid.cells[i], grid.low_edge[i], grid.high_edge[i]);
  if (!grid.whole() && a == grid.part.axis) {
    f.index -= grid.part.first;
    if (f.index < 0 || f.index >= grid.part.count) f.index = -1;
  }
  return f;
}
/// The cell of the unbounded lattice that x lies in; of a place beyond all numbers of cells, the
/// last.
template <int D>
int lattice(const SampleGrid<D>& grid, int a, double x) {
  constexpr double last = 1e9;
  return static_cast<int>(
      std::clamp(std::floor((x - grid.lower[a]) / grid.spacing[a]), -last, last));
}

/// The weight of one item in one cell.
struct Node {
  std::uint32_t cell;
  std::array<std::int8_t, 3> image;
  double value;
};

/// Where cells lie to an item, one entry a cell. Of a point: `distance2`, squared distance. Of a
/// branch: `distance2` from the line it lies on, and `along` it, from the cell to the start.
struct Places {
  std::vector<double> distance2, along;
};

/// A row of lattice cells along the first axis: where it begins in the grid, if it lies there.
struct Row {
  bool here;
  int begin;
  std::int8_t image1, image2;
};

/// The weights of one item, and the room they are worked out in.
struct Nodes {
  std::span<const Node> list;  // of those in `room`
  std::vector<Node> room;
  Places places;
  std::vector<std::uint32_t> place;  // row and place in it, of the cells within reach
  std::vector<Row> rows;
  std::vector<Folded> row;  // the same cells of every row

  /// For rows of `n` cells.
  void make_room(std::size_t rows_, std::size_t n) {
    const std::size_t most = rows_ * n + 1;
    if (rows.size() < rows_) rows.resize(rows_);
    if (row.size() < n) row.resize(n);
    if (place.size() >= most) return;
    place.resize(most), room.resize(most);
    places.distance2.resize(most), places.along.resize(most);
  }
};

/// The cells within reach of an item, in the box that holds its support, and where they lie to it.
template <int D>
std::size_t lay_out(const SampleGrid<D>& grid, const auto& item, Nodes& out) {
  std::array<int, 3> lo{0, 0, 0}, hi{0, 0, 0};
  std::size_t rows = 1, count = 0;
  std::uint32_t row = 0;
  for (int a = 0; a < D; ++a) {
    lo[a] = lattice(grid, a, item.low[a]), hi[a] = lattice(grid, a, item.high[a]);
    if (a > 0) rows *= static_cast<std::size_t>(hi[a] - lo[a] + 1);
  }
  const auto n = static_cast<std::uint32_t>(hi[0] - lo[0] + 1);
  out.make_room(rows, n);
  for (std::uint32_t i = 0; i < n; ++i) out.row[i] = folded(grid, 0, lo[0] + static_cast<int>(i));
  typename SampleGrid<D>::Point r;
  r[0] = grid.centre(0, lo[0]);
  Folded f1{0, 0}, f2{0, 0};
  for (int k2 = lo[2]; k2 <= hi[2]; ++k2) {
    if constexpr (D > 2) f2 = folded(grid, 2, k2), r[2] = grid.centre(2, k2);
    for (int k1 = lo[1]; k1 <= hi[1]; ++k1) {
      if constexpr (D > 1) f1 = folded(grid, 1, k1), r[1] = grid.centre(1, k1);
      int begin = 0;
      if constexpr (D > 2) begin = f2.index;
      if constexpr (D > 1) begin = begin * grid.count(1) + f1.index;
      out.rows[row] = {f1.index >= 0 && f2.index >= 0, begin * grid.count(0), f1.image, f2.image};
      const auto cells = item.row(r);
      for (std::uint32_t i = 0; i < n; ++i) {  // what is out of reach is overwritten: no branch
        out.place[count] = row << 16 | i;
        count += cells(i * grid.spacing[0], out.places, count);
      }
      ++row;
    }
  }
  return count;
}

/// Makes the kernel in the plane that about the axis, of `count` cells; returns the integral over
/// them [m3].
template <int D>
double over_rings(const SampleGrid<D>& grid, const auto& item, std::size_t count, Nodes& out) {
  const int first = lattice(grid, 0, item.low[0]);
  double sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const int k = first + static_cast<int>(out.place[i] & 0xffff);
    double& phi = out.places.distance2[i];
    phi *= ring_factor(grid, grid.centre(0, k), item.home[0]);
    sum += phi * grid.cell_volume(k);
  }
  return sum;
}

/// Replaces `out` by the weights of one item. `item` has `.low`, `.high`, corners of the box that
/// holds its support; `.row(r)`, of the cells along the first axis from r on, which notes where the
/// one at a distance x lies to the item, and returns whether that is within reach;
/// `.values(places, n)`, which makes the kernel there of `places.distance2`; `.home`, the position
/// whose cell takes the item when no cell centre lies in its support.
template <int D>
void weigh(const SampleGrid<D>& grid, const auto& item, Nodes& out) {
  const std::size_t count = lay_out(grid, item, out);
  const std::vector<double>& phi = out.places.distance2;
  item.values(out.places, static_cast<int>(count));
  const auto last = phi.begin() + static_cast<long>(count);
  const double integral = grid.of_rings()
                              ? over_rings(grid, item, count, out)
                              : std::accumulate(phi.begin(), last, 0.0) * grid.cell_volume();
  out.list = {};
  if (integral > 0.0) {
    const double norm = 1.0 / integral;
    Node* next = out.room.data();
    for (std::size_t i = 0; i < count; ++i) {
      const Row& row = out.rows[out.place[i] >> 16];
      const Folded& f0 = out.row[out.place[i] & 0xffff];
      *next = {static_cast<std::uint32_t>(row.begin + f0.index),
               {f0.image, row.image1, row.image2},
               phi[i] * norm};
      next += row.here && f0.index >= 0 && phi[i] > 0.0;
    }
    out.list = {out.room.data(), next};
    return;
  }
  Node whole{0, {0, 0, 0}, 1.0 / grid.cell_volume(lattice(grid, 0, item.home[0]))};
  for (int a = D - 1; a >= 0; --a) {
    const Folded f = folded(grid, a, lattice(grid, a, item.home[a]));
    if (f.index < 0) return;
    whole.cell = whole.cell * static_cast<std::uint32_t>(grid.count(a)) +
                 static_cast<std::uint32_t>(f.index);
    whole.image[static_cast<std::size_t>(a)] = f.image;
  }
  out.room.front() = whole, out.list = {out.room.data(), 1};
}

/// Makes the kernel of n squared distances. Values outside the support are worked out and thrown
/// away, so that the loop has no branch.
template <class K>
void kernel_values(const K kernel, int n, double* distance2) {
  const double c2 = kernel.cutoff() * kernel.cutoff();
#pragma omp simd
  for (int i = 0; i < n; ++i) {
    const double r2 = distance2[i];
    const bool inside = r2 < c2;
    const double value = kernel.at(inside ? r2 : c2);
    distance2[i] = inside ? value : 0.0;
  }
}

/// The mean of the kernel along a line of `length` that starts at t and lies at a squared distance
/// from the centre, n times.
template <class K>
void line_values(const K kernel, double length, int n, double* distance2, const double* t) {
  const double c2 = kernel.cutoff() * kernel.cutoff(), inverse = 1.0 / length;
#pragma omp simd
  for (int i = 0; i < n; ++i) {
    const double above = distance2[i] > 0.0 ? distance2[i] : 0.0, p2 = above < c2 ? above : c2;
    const double half = std::sqrt(c2 - p2);  // half the chord within the support
    const double t0 = t[i] > -half ? t[i] : -half, t1 = t[i] + length < half ? t[i] + length : half;
    const bool inside = t1 > t0;
    const double value = kernel.line(p2, inside ? t0 : 0.0, inside ? t1 : 0.0) * inverse;
    distance2[i] = value > 0.0 ? value : 0.0;
  }
}

/// Squared distance of two places but for the first axis.
template <int D>
double across2(const auto& r, const auto& s) {
  double sum = 0.0;
  for (int a = 1; a < D; ++a) sum += (r[a] - s[a]) * (r[a] - s[a]);
  return sum;
}

struct Loose {
  std::uint32_t cell;
  Weight weight;
};

/// The items, in their order, whose support reaches the part of the grid.
template <int D>
std::vector<std::uint32_t> touching(const SampleGrid<D>& grid, std::size_t items, auto& place) {
  std::vector<std::uint32_t> out;
  for (std::uint32_t p = 0; p < items; ++p) {
    bool reaches = grid.whole();
    if (!reaches) {
      const auto item = place(p);
      const int a = grid.part.axis, last = lattice(grid, a, item.high[a]);
      for (int k = lattice(grid, a, item.low[a]); k <= last && !reaches; ++k)
        reaches = folded(grid, a, k).index >= 0;
    }
    if (reaches) out.push_back(p);
  }
  return out;
}

}  // namespace stencil_detail

template <int D, class Place>
Stencils make_stencils(const SampleGrid<D>& grid, std::size_t items, Place place) {
  using stencil_detail::Loose;
  const auto near = stencil_detail::touching(grid, items, place);
  std::vector<std::vector<Loose>> found(static_cast<std::size_t>(omp_get_max_threads()));
#pragma omp parallel
  {
    // Contiguous shares in thread order, so that concatenation restores the order of the items.
    const auto threads = static_cast<std::size_t>(omp_get_num_threads());
    const auto t = static_cast<std::size_t>(omp_get_thread_num());
    auto& mine = found[t];
    stencil_detail::Nodes nodes;
    const std::size_t begin = near.size() * t / threads, end = near.size() * (t + 1) / threads,
                      sample = 256;
    for (std::size_t i = begin; i < end; ++i) {
      if (i == begin + sample) mine.reserve(mine.size() * (end - begin) / sample * 11 / 10);
      stencil_detail::weigh(grid, place(near[i]), nodes);
      for (const auto& n : nodes.list) mine.push_back({n.cell, {near[i], n.image, n.value}});
    }
  }

  // Counting sort by cell. What a thread found begins where the one before it ends.
  Stencils out;
  out.begin_.assign(grid.size() + 1, 0);
  std::vector<std::vector<std::size_t>> next(found.size());
#pragma omp parallel for schedule(static, 1)
  for (std::size_t t = 0; t < found.size(); ++t) {
    next[t].assign(grid.size(), 0);
    for (const auto& w : found[t]) ++next[t][w.cell];
  }
  for (std::size_t k = 0; k < grid.size(); ++k) {
    out.begin_[k + 1] = out.begin_[k];
    for (auto& counts : next) {
      const std::size_t count = counts[k];
      counts[k] = out.begin_[k + 1], out.begin_[k + 1] += count;
    }
  }
  out.weights_.resize(out.begin_.back());
#pragma omp parallel for schedule(static, 1)
  for (std::size_t t = 0; t < found.size(); ++t)
    for (const auto& w : found[t]) out.weights_[next[t][w.cell]++] = w.weight;
  return out;
}

/// Sums of N properties of the items times their weights, per cell, without keeping the weights:
/// `properties(p)` is a vector of N. The items are shared among a fixed number of partial sums, so
/// the result is the same for any number of threads.
template <int N, int D, class Place>
std::vector<Eigen::Matrix<double, N, 1>> scatter(const SampleGrid<D>& grid, std::size_t items,
                                                 Place place, auto properties) {
  using Sums = std::vector<Eigen::Matrix<double, N, 1>>;
  constexpr std::size_t shares = 4;
  const auto near = stencil_detail::touching(grid, items, place);
  std::array<Sums, shares> partial;
#pragma omp parallel for schedule(static, 1)
  for (std::size_t t = 0; t < shares; ++t) {
    partial[t].assign(grid.size(), Eigen::Matrix<double, N, 1>::Zero());
    stencil_detail::Nodes nodes;
    for (std::size_t i = near.size() * t / shares; i < near.size() * (t + 1) / shares; ++i) {
      stencil_detail::weigh(grid, place(near[i]), nodes);
      const Eigen::Matrix<double, N, 1> q = properties(near[i]);
      for (const auto& n : nodes.list) partial[t][n.cell] += n.value * q;
    }
  }
  for (std::size_t t = 1; t < shares; ++t)
    for (std::size_t k = 0; k < grid.size(); ++k) partial[0][k] += partial[t][k];
  return std::move(partial[0]);
}

}  // namespace grainpair
