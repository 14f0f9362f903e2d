// Stencils: the sparse table of weights phi_kp between grid cells k and items p (points, or contact
// branches), and sums over it.
#pragma once

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "compare/mapping/coarse_grain.hpp"

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
template <int D>
int lattice(const SampleGrid<D>& grid, int a, double x) {
  return static_cast<int>(std::floor((x - grid.lower[a]) / grid.spacing[a]));
}

/// The weight of one item in one cell.
struct Node {
  std::uint32_t cell;
  std::array<std::int8_t, 3> image;
  double value;
};

/// The weights of one item, and the room they are worked out in.
struct Nodes {
  std::vector<Node> list;
  std::vector<double> row;
  std::vector<Folded> along;  // of the cells of a row
};

/// Replaces `out` by the weights of one item. `item` has `.low`, `.high`, corners of the box that
/// holds its support, which is convex; `.row(r, h, phi)`, its kernel at r and every h further along
/// the first axis, zero outside; `.home`, the position whose cell takes the item when no cell
/// centre lies in its support.
template <int D>
void weigh(const SampleGrid<D>& grid, const auto& item, Nodes& out) {
  const auto lattice = [&](int a, double x) { return stencil_detail::lattice(grid, a, x); };
  const auto folded = [&](int a, int k) { return stencil_detail::folded(grid, a, k); };
  std::array<int, 3> lo{0, 0, 0}, hi{0, 0, 0};
  for (int a = 0; a < D; ++a) lo[a] = lattice(a, item.low[a]), hi[a] = lattice(a, item.high[a]);
  const int n = (hi[0] - lo[0] + 4) / 4 * 4;  // whole vectors; what lies beyond is zero
  out.row.resize(static_cast<std::size_t>(n));
  out.list.clear();
  out.along.clear();
  for (int i = 0; i < n; ++i) out.along.push_back(folded(0, lo[0] + i));
  double sum = 0.0;
  typename SampleGrid<D>::Point r;
  r[0] = grid.centre(0, lo[0]);
  Folded f1{0, 0}, f2{0, 0};
  for (int k2 = lo[2]; k2 <= hi[2]; ++k2) {
    if constexpr (D > 2) f2 = folded(2, k2), r[2] = grid.centre(2, k2);
    for (int k1 = lo[1]; k1 <= hi[1]; ++k1) {
      if constexpr (D > 1) f1 = folded(1, k1), r[1] = grid.centre(1, k1);
      const std::span<double> phi(out.row);
      item.row(r, grid.spacing[0], phi);
      int first = 0, last = n;
      while (first < n && !(phi[static_cast<std::size_t>(first)] > 0.0)) ++first;
      while (last > first && !(phi[static_cast<std::size_t>(last - 1)] > 0.0)) --last;
      for (int i = first; i < last; ++i) sum += phi[static_cast<std::size_t>(i)];
      if (f1.index < 0 || f2.index < 0) continue;
      int before = 0;
      if constexpr (D > 2) before = f2.index;
      if constexpr (D > 1) before = before * grid.count(1) + f1.index;
      before *= grid.count(0);
      for (int i = first; i < last; ++i) {
        const Folded f0 = out.along[static_cast<std::size_t>(i)];
        if (f0.index >= 0)
          out.list.push_back({static_cast<std::uint32_t>(before + f0.index),
                              {f0.image, f1.image, f2.image},
                              phi[static_cast<std::size_t>(i)]});
      }
    }
  }
  if (sum > 0.0) {
    const double norm = 1.0 / (sum * grid.cell_volume());
    for (Node& node : out.list) node.value *= norm;
    return;
  }
  Node whole{0, {0, 0, 0}, 1.0 / grid.cell_volume()};
  for (int a = D - 1; a >= 0; --a) {
    const Folded f = folded(a, lattice(a, item.home[a]));
    if (f.index < 0) return;
    whole.cell = whole.cell * static_cast<std::uint32_t>(grid.count(a)) +
                 static_cast<std::uint32_t>(f.index);
    whole.image[static_cast<std::size_t>(a)] = f.image;
  }
  out.list.push_back(whole);
}

/// The kernel at a row of cells h apart, the first at x beside the centre along the row, all at the
/// squared distance `rest2` across it. Values outside the support are worked out and thrown away,
/// so that the loop has no branch.
template <class K>
void kernel_row(const K kernel, double x, double rest2, double h, std::span<double> phi) {
  const double c2 = kernel.cutoff() * kernel.cutoff();
#pragma omp simd
  for (int i = 0; i < static_cast<int>(phi.size()); ++i) {
    const double xi = x + i * h, r2 = rest2 + xi * xi;
    const bool inside = r2 < c2;
    const double value = kernel.at(inside ? r2 : c2);
    phi[static_cast<std::size_t>(i)] = inside ? value : 0.0;
  }
}

/// The mean of the kernel along a line of `length` at a row of cells h apart. From the first cell
/// the start lies at x along the row and at the squared distance `rest2` across it, and at t along
/// the line; `slope` is the line's component along the row.
template <class K>
void line_row(const K kernel, double x, double rest2, double t, double slope, double length,
              double h, std::span<double> phi) {
  const double c2 = kernel.cutoff() * kernel.cutoff(), inverse = 1.0 / length;
#pragma omp simd
  for (int i = 0; i < static_cast<int>(phi.size()); ++i) {
    const double xi = x - i * h, ti = t - i * h * slope, beside = rest2 + xi * xi - ti * ti;
    const double above = beside > 0.0 ? beside : 0.0, p2 = above < c2 ? above : c2;
    const double half = std::sqrt(c2 - p2);  // half the chord within the support
    const double t0 = ti > -half ? ti : -half, t1 = ti + length < half ? ti + length : half;
    const bool inside = t1 > t0;
    const double value = kernel.line(p2, inside ? t0 : 0.0, inside ? t1 : 0.0) * inverse;
    phi[static_cast<std::size_t>(i)] = value > 0.0 ? value : 0.0;
  }
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

  // Counting sort by cell.
  Stencils out;
  out.begin_.assign(grid.size() + 1, 0);
  for (const auto& part : found)
    for (const auto& w : part) ++out.begin_[w.cell + 1];
  for (std::size_t k = 0; k < grid.size(); ++k) out.begin_[k + 1] += out.begin_[k];
  out.weights_.resize(out.begin_.back());
  auto next = out.begin_;
  for (const auto& part : found)
    for (const auto& w : part) out.weights_[next[w.cell]++] = w.weight;
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

/// Places points for `make_stencils` and `scatter`.
template <int D, class K>
auto place_points(const SampleGrid<D>& grid, const K& kernel, auto position) {
  using Point = typename SampleGrid<D>::Point;
  struct Item {
    Point home, low, high;
    const K& kernel;
    void row(const Point& r, double h, std::span<double> phi) const {
      const Point from = r - home;
      stencil_detail::kernel_row(kernel, from[0], from.template tail<D - 1>().squaredNorm(), h,
                                 phi);
    }
  };
  return [&grid, &kernel, position, c = kernel.cutoff()](std::size_t p) {
    const Point x = grid.project(position(p));
    return Item{x, (x.array() - c).matrix(), (x.array() + c).matrix(), kernel};
  };
}

/// Places the branches of contacts: psi(r) = integral over s in [0, 1] of phi(r - start + s
/// branch), exact.
template <int D, class K>
auto place_branches(const SampleGrid<D>& grid, const K& kernel, std::span<const Contact> contacts) {
  using Point = typename SampleGrid<D>::Point;
  struct Item {
    Point home, low, high;  // home is the middle of the branch
    Point start, along;     // along: unit vector from start to the other end
    double length;
    const K& kernel;
    void row(const Point& r, double h, std::span<double> phi) const {
      const Point from = start - r;
      const double rest2 = from.template tail<D - 1>().squaredNorm();
      if (length > 1e-9 * kernel.cutoff())
        stencil_detail::line_row(kernel, from[0], rest2, from.dot(along), along[0], length, h, phi);
      else
        stencil_detail::kernel_row(kernel, -from[0], rest2, h, phi);
    }
  };
  return [&grid, &kernel, contacts, c = kernel.cutoff()](std::size_t i) {
    const Point a = grid.project(contacts[i].start), b = grid.project(contacts[i].branch),
                end = a - b;
    const double length = b.norm();
    Point along = Point::Zero();
    if (length > 0.0) along = -b / length;
    return Item{0.5 * (a + end),
                (a.cwiseMin(end).array() - c).matrix(),
                (a.cwiseMax(end).array() + c).matrix(),
                a,
                along,
                length,
                kernel};
  };
}

}  // namespace grainpair
