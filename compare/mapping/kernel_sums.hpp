// Sums that depend on the kernel; compiled for each dimension of the grid in a unit of its own
// (kernel_sums.cpp.in).
#pragma once

#include <limits>

#include "compare/mapping/cell_list.hpp"
#include "compare/mapping/field_maps.hpp"
#include "compare/mapping/stencil.hpp"

namespace grainpair {

/// Squared fluctuation |v_i - V(r_i)|^2 / c_i of every point, V smoothed with the same kernel at
/// the point itself, and
///   c_i = 1 - 2 w_ii/S_i + sum_j w_ij^2/S_i^2,   w_ij = m_j phi_ij,  S_i = sum_j w_ij,
/// what that difference keeps of independent fluctuations, V containing v_i itself. NaN for a point
/// on its own.
template <int D, class K>
std::vector<double> two_step_fluctuation(const Cloud& cloud, const SampleGrid<D>& grid,
                                         const K& kernel) {
  const CellList<D> cells(cloud.x, grid, kernel.cutoff());
  const auto& order = cells.order();
  std::vector<double> mass;
  std::array<std::vector<double>, 3> v;
  for (const std::size_t p : order) {
    mass.push_back(cloud.mass[p]);
    for (std::size_t a = 0; a < 3; ++a) v[a].push_back(cloud.v[p][static_cast<Eigen::Index>(a)]);
  }
  std::vector<double> out(cloud.size(), std::numeric_limits<double>::quiet_NaN());
  const double c2 = kernel.cutoff() * kernel.cutoff();
#pragma omp parallel for schedule(dynamic, 256)
  for (std::size_t i = 0; i < order.size(); ++i) {
    double S = 0.0, S2 = 0.0, Vx = 0.0, Vy = 0.0, Vz = 0.0;
    const K phi = kernel;
    cells.runs(i, [&](const auto& r, std::size_t begin, std::size_t end) {
      std::array<const double*, D> x;
      for (int a = 0; a < D; ++a) x[a] = cells.coordinate(a).data();
      const double *m = mass.data(), *vx = v[0].data(), *vy = v[1].data(), *vz = v[2].data();
#pragma omp simd reduction(+ : S, S2, Vx, Vy, Vz)
      for (std::size_t j = begin; j < end; ++j) {
        double r2 = 0.0;
        for (int a = 0; a < D; ++a) r2 += (x[a][j] - r[a]) * (x[a][j] - r[a]);
        const bool inside = r2 < c2;
        const double value = m[j] * phi.at(inside ? r2 : c2), w = inside ? value : 0.0;
        S += w, S2 += w * w, Vx += w * vx[j], Vy += w * vy[j], Vz += w * vz[j];
      }
    });
    const double c = 1.0 - 2.0 * mass[i] * kernel.at(0.0) / S + S2 / (S * S);
    const Vec3 V(Vx / S, Vy / S, Vz / S);
    if (c > 0.05) out[order[i]] = (cloud.v[order[i]] - V).squaredNorm() / c;
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
