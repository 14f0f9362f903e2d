// Stencils: the sparse table of weights phi_kp between grid cells k and items p (points, or contact
// branches), and sums over it.
#pragma once

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "compare/coarse_grain.hpp"

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
  if (low == Edge::periodic) {
    const int image = k >= 0 ? k / n : -((n - 1 - k) / n);
    return {k - image * n, static_cast<std::int8_t>(image)};
  }
  if (k < 0) return {low == Edge::mirror ? std::min(-1 - k, n - 1) : -1, 0};
  if (k >= n) return {high == Edge::mirror ? std::max(2 * n - 1 - k, 0) : -1, 0};
  return {k, 0};
}

struct Loose {
  std::uint32_t cell;
  Weight weight;
};

/// Appends the weights of one item to `out`. `item` has `.low`, `.high`, corners of the box that
/// holds its support;
/// `.at(r)`, its kernel at r, zero outside; `.home`, the position whose cell takes the item when no
/// cell centre lies in its support.
template <int D>
void weigh(const SampleGrid<D>& grid, const auto& item, std::uint32_t number,
           std::vector<Loose>& out) {
  const auto lattice = [&](int a, double x) {
    return static_cast<int>(std::floor((x - grid.lower[a]) / grid.spacing[a]));
  };
  std::array<Folded, 3> f{};
  const auto push = [&](double phi) {
    std::size_t k = 0;
    for (int a = D - 1; a >= 0; --a) {
      if (f[a].index < 0) return;
      k = k * static_cast<std::size_t>(grid.cells[a]) + static_cast<std::size_t>(f[a].index);
    }
    out.push_back(
        {static_cast<std::uint32_t>(k), {number, {f[0].image, f[1].image, f[2].image}, phi}});
  };

  std::array<int, 3> lo{0, 0, 0}, hi{0, 0, 0};
  for (int a = 0; a < D; ++a) lo[a] = lattice(a, item.low[a]), hi[a] = lattice(a, item.high[a]);
  const std::size_t first = out.size();
  double sum = 0.0;
  typename SampleGrid<D>::Point r;
  for (int k2 = lo[2]; k2 <= hi[2]; ++k2) {
    if constexpr (D > 2)
      f[2] = fold(k2, grid.cells[2], grid.low_edge[2], grid.high_edge[2]),
      r[2] = grid.centre(2, k2);
    for (int k1 = lo[1]; k1 <= hi[1]; ++k1) {
      if constexpr (D > 1)
        f[1] = fold(k1, grid.cells[1], grid.low_edge[1], grid.high_edge[1]),
        r[1] = grid.centre(1, k1);
      for (int k0 = lo[0]; k0 <= hi[0]; ++k0) {
        r[0] = grid.centre(0, k0);
        const double phi = item.at(r);
        if (phi <= 0.0) continue;
        sum += phi;
        f[0] = fold(k0, grid.cells[0], grid.low_edge[0], grid.high_edge[0]);
        push(phi);
      }
    }
  }
  if (sum > 0.0) {
    const double norm = 1.0 / (sum * grid.cell_volume());
    for (std::size_t i = first; i < out.size(); ++i) out[i].weight.value *= norm;
  } else {
    for (int a = 0; a < D; ++a)
      f[a] = fold(lattice(a, item.home[a]), grid.cells[a], grid.low_edge[a], grid.high_edge[a]);
    push(1.0 / grid.cell_volume());
  }
}

}  // namespace stencil_detail

template <int D, class Place>
Stencils make_stencils(const SampleGrid<D>& grid, std::size_t items, Place place) {
  using stencil_detail::Loose;
  std::vector<std::vector<Loose>> found(static_cast<std::size_t>(omp_get_max_threads()));
#pragma omp parallel
  {
    // Contiguous shares in thread order, so that concatenation restores the order of the items.
    const auto threads = static_cast<std::size_t>(omp_get_num_threads());
    const auto t = static_cast<std::size_t>(omp_get_thread_num());
    auto& mine = found[t];
    const std::size_t begin = items * t / threads, end = items * (t + 1) / threads, sample = 256;
    for (std::size_t p = begin; p < end; ++p) {
      if (p == begin + sample) mine.reserve(mine.size() * (end - begin) / sample * 11 / 10);
      stencil_detail::weigh(grid, place(p), static_cast<std::uint32_t>(p), mine);
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
  std::array<Sums, shares> partial;
#pragma omp parallel for schedule(static, 1)
  for (std::size_t t = 0; t < shares; ++t) {
    partial[t].assign(grid.size(), Eigen::Matrix<double, N, 1>::Zero());
    std::vector<stencil_detail::Loose> weights;
    for (std::size_t p = items * t / shares; p < items * (t + 1) / shares; ++p) {
      weights.clear();
      stencil_detail::weigh(grid, place(p), static_cast<std::uint32_t>(p), weights);
      const Eigen::Matrix<double, N, 1> q = properties(p);
      for (const auto& w : weights) partial[t][w.cell] += w.weight.value * q;
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
    double c2;
    double at(const Point& r) const {
      const double r2 = (r - home).squaredNorm();
      return r2 < c2 ? kernel.at(r2) : 0.0;
    }
  };
  return [&grid, &kernel, position, c = kernel.cutoff()](std::size_t p) {
    const Point x = grid.project(position(p));
    return Item{x, (x.array() - c).matrix(), (x.array() + c).matrix(), kernel, c * c};
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
    double length, c2;
    const K& kernel;
    double at(const Point& r) const {
      const Point from_r = start - r;
      const double s2 = from_r.squaredNorm();
      if (length <= 1e-9 * std::sqrt(c2)) return s2 < c2 ? kernel.at(s2) : 0.0;
      const double t = from_r.dot(along);
      const double p2 = std::max(0.0, s2 - t * t);
      if (p2 >= c2) return 0.0;
      const double half = std::sqrt(c2 - p2);  // half the chord within the support
      const double t0 = std::max(t, -half), t1 = std::min(t + length, half);
      return t1 > t0 ? std::max(0.0, kernel.line(p2, t0, t1)) / length : 0.0;
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
                c * c,
                kernel};
  };
}

}  // namespace grainpair
