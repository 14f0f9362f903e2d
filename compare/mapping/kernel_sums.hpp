// Sums that depend on the kernel; compiled for each dimension of the grid in a unit of its own
// (kernel_sums.cpp.in).
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numbers>

#include "compare/mapping/cell_list.hpp"
#include "compare/mapping/field_maps.hpp"
#include "compare/mapping/items.hpp"

namespace grainpair {

/// What a velocity is smoothed from, one entry per point or per lump of points: place, mass, sum of
/// squared masses over the square of their sum, velocity.
struct Sources {
  std::vector<Vec3> x;
  std::vector<double> m, share;
  std::array<std::vector<double>, 3> v;

  void add(const Vec3& place, double mass, double squares, const Vec3& velocity) {
    x.push_back(place), m.push_back(mass), share.push_back(squares);
    for (std::size_t a = 0; a < 3; ++a) v[a].push_back(velocity[static_cast<Eigen::Index>(a)]);
  }
};

// Neighbour sums beyond which deep clouds are lumped: 400 neighbours of a point, 2e8 in all.
constexpr double many_neighbours = 400.0, many_sums = 2e8;

/// The points of a cloud; those of a deep and large one lumped in bins of a twelfth of the cutoff
/// (a quarter of a Gaussian's w; in one dimension a sixteenth of it), each at its centre of mass.
/// What that leaves out is of second order in the bin: (1/4)^2/24 of the kernel's curvature.
template <int D>
Sources sources(const Cloud& cloud, const SampleGrid<D>& grid, double cutoff) {
  Sources out;
  const auto n = static_cast<double>(cloud.size());
  Vec3 lower = Vec3::Zero();
  double extent = 1.0, ball = D == 1 ? 2.0 * cutoff : std::numbers::pi * cutoff * cutoff;
  if (D == 3) ball *= 4.0 / 3.0 * cutoff;
  for (int a = 0; a < D; ++a) {
    const int i = grid.direction(a);
    const auto [low, high] = std::minmax_element(
        cloud.x.begin(), cloud.x.end(), [i](const Vec3& r, const Vec3& s) { return r[i] < s[i]; });
    if (low == cloud.x.end()) return out;
    lower[i] = (*low)[i], extent *= std::max((*high)[i] - (*low)[i], cutoff);
  }
  const double neighbours = n * std::min(1.0, ball / extent);
  if (neighbours < many_neighbours || n * neighbours < many_sums) {
    for (std::size_t p = 0; p < cloud.size(); ++p)
      out.add(cloud.x[p], cloud.mass[p], 1.0, cloud.v[p]);
    return out;
  }
  const double side = cutoff / (D == 1 ? 48.0 : 12.0);
  std::vector<std::pair<std::array<std::int32_t, D>, std::uint32_t>> order(cloud.size());
  for (std::size_t p = 0; p < cloud.size(); ++p) {
    order[p].second = static_cast<std::uint32_t>(p);
    for (int a = 0; a < D; ++a) {
      const int i = grid.direction(a);
      order[p].first[static_cast<std::size_t>(a)] =
          static_cast<std::int32_t>(std::min((cloud.x[p][i] - lower[i]) / side, 2e9));
    }
  }
  std::sort(order.begin(), order.end());
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    Vec3 mx = Vec3::Zero(), mv = Vec3::Zero();
    double m = 0.0, m2 = 0.0;
    for (; end < order.size() && order[end].first == order[begin].first; ++end) {
      const std::size_t p = order[end].second;
      const double mass = cloud.mass[p];
      m += mass, m2 += mass * mass, mx += mass * cloud.x[p], mv += mass * cloud.v[p];
    }
    out.add(mx / m, m, m2 / (m * m), mv / m);
  }
  return out;
}

/// The points of a cell list within reach of a place: places in the list, and squared distances.
struct Near {
  std::vector<std::uint32_t> index;
  std::vector<double> distance2;
  int count = 0;

  template <int D>
  void find(const CellList<D>& cells, const typename SampleGrid<D>::Point& place, double reach2) {
    std::array<const double*, D> x;
    for (int a = 0; a < D; ++a) x[a] = cells.coordinate(a).data();
    std::size_t found = 0;
    cells.runs(place, [&, reach2](const auto& r, std::size_t begin, std::size_t end) {
      const std::size_t most = found + end - begin + 1;
      if (index.size() < most) index.resize(2 * most), distance2.resize(2 * most);
      auto *to = index.data(), *const start = to;
      to += found;
      double* squared = distance2.data() + found;
      const typename SampleGrid<D>::Point from = r;
      for (std::size_t j = begin; j < end; ++j) {  // what is out of reach is overwritten: no branch
        double r2 = 0.0;
        for (int a = 0; a < D; ++a) r2 += (x[a][j] - from[a]) * (x[a][j] - from[a]);
        *to = static_cast<std::uint32_t>(j), *squared = r2;
        const bool inside = r2 < reach2;
        to += inside, squared += inside;
      }
      found = static_cast<std::size_t>(to - start);
    });
    count = static_cast<int>(found);
  }
};

/// Squared fluctuation |v_i - V(r_i)|^2 / c_i of every point, V smoothed with the same kernel at
/// the point itself, and
///   c_i = 1 - 2 w_ii/S_i + sum_j w_ij^2/S_i^2,   w_ij = m_j phi_ij,  S_i = sum_j w_ij,
/// what that difference keeps of independent fluctuations, V containing v_i itself. NaN for a point
/// on its own.
template <int D, class K>
std::vector<double> two_step_fluctuation(const Cloud& cloud, const SampleGrid<D>& grid,
                                         const K& kernel) {
  const Sources near = sources(cloud, grid, kernel.cutoff());
  const CellList<D> cells(near.x, grid, kernel.cutoff());
  const auto sorted = [&](const std::vector<double>& values) {
    std::vector<double> out;
    for (const std::size_t p : cells.order()) out.push_back(values[p]);
    return out;
  };
  const auto mass = sorted(near.m), share = sorted(near.share);
  const std::array v{sorted(near.v[0]), sorted(near.v[1]), sorted(near.v[2])};
  std::vector<double> out(cloud.size(), std::numeric_limits<double>::quiet_NaN());
  const double c2 = kernel.cutoff() * kernel.cutoff();
#pragma omp parallel
  {
    Near here;
#pragma omp for schedule(dynamic, 256)
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      here.find(cells, grid.project(cloud.x[i]), c2);
      double S = 0.0, S2 = 0.0, Vx = 0.0, Vy = 0.0, Vz = 0.0;
      stencil_detail::kernel_values(kernel, here.count, here.distance2.data());
      double own = kernel.at(0.0);
      if (grid.of_rings()) {
        const double r = cloud.x[i][0];
        for (int k = 0; k < here.count; ++k)
          here.distance2[static_cast<std::size_t>(k)] *=
              ring_factor(grid, r, cells.coordinate(0)[here.index[static_cast<std::size_t>(k)]]);
        own *= ring_factor(grid, r, r);
      }
      const double *m = mass.data(), *q = share.data(), *vx = v[0].data(), *vy = v[1].data(),
                   *vz = v[2].data();
#pragma omp simd reduction(+ : S, S2, Vx, Vy, Vz)
      for (int k = 0; k < here.count; ++k) {
        const std::uint32_t j = here.index[static_cast<std::size_t>(k)];
        const double w = m[j] * here.distance2[static_cast<std::size_t>(k)];
        S += w, S2 += w * w * q[j], Vx += w * vx[j], Vy += w * vy[j], Vz += w * vz[j];
      }
      const double c = 1.0 - 2.0 * cloud.mass[i] * own / S + S2 / (S * S);
      const Vec3 V(Vx / S, Vy / S, Vz / S);
      if (c > 0.05) out[i] = (cloud.v[i] - V).squaredNorm() / c;
    }
  }
  return out;
}

template <int D, class K>
KernelSums sums_with(const Cloud& cloud, const SampleGrid<D>& grid, const K& kernel) {
  KernelSums sums;
  sums.points = make_stencils(
      grid, cloud.size(), place_points(grid, kernel, [&](std::size_t p) { return cloud.x[p]; }));
  if (!cloud.has_contacts) return sums;
  const auto& contacts = cloud.contacts;
  // Along the branches: f (x) b, n (x) n, 1. At the contact points: wall force, power.
  sums.along = scatter<19>(
      grid, contacts.size(), place_branches(grid, kernel, std::span(contacts)), [&](std::size_t i) {
        const Contact& c = contacts[i];
        Eigen::Matrix<double, 19, 1> q = Eigen::Matrix<double, 19, 1>::Zero();
        const double b2 = c.branch.squaredNorm();
        Eigen::Map<Mat3>(q.data()) = c.force * c.branch.transpose();
        if (b2 > 0.0) {
          Eigen::Map<Mat3>(q.data() + 9) = c.branch * c.branch.transpose() / b2;
          q[18] = 1.0;
        }
        return q;
      });
  const auto at_point = [&](std::size_t i) { return contacts[i].point; };
  sums.at =
      scatter<4>(grid, contacts.size(), place_points(grid, kernel, at_point), [&](std::size_t i) {
        const Contact& c = contacts[i];
        const Vec3 wall = c.wall ? c.force : Vec3::Zero();
        return Eigen::Vector4d(wall.x(), wall.y(), wall.z(), c.dissipation);
      });
  return sums;
}

}  // namespace grainpair
