// From points to the nodes of space. What points that share their nodes give is summed before it
// goes to a node. Else each point goes by itself: a node's numbers fill two registers, and so do a
// point's own and their slopes along each axis.
#pragma once

#include "mpm/grid/interpolation.hpp"

namespace grainpair {

/// What goes through the same weights: momentum and mass, or force; four numbers to a register.
template <class Real>
struct SpaceQuad {
  VectorOf<3, Real> vector;
  Real rest;
};
template <class Real>
struct SpaceGiven {  // own, and slopes along each axis
  std::array<SpaceQuad<Real>, 4> motion, change;
};

template <class Real>
using SpaceNode = NodeOf<3, Real>;

/// Each half of the points to its common nodes.
template <int Support, class Real, class Nodes>
void give_together(const Given<3, Real>& points, const Neighbours<3, Support, Real>& at,
                   const Nodes& nodes) {
  const auto& [x, y, z] = at.n;
#pragma GCC unroll 1
  for (int i = 0; i < Support; ++i) {
    const auto momentum_i = x.w[i] * points.momentum + x.moment[i] * points.momentum_slope[0];
    const auto force_i = x.w[i] * points.force + x.dw[i] * points.force_slope[0];
    const auto momentum_y = x.w[i] * points.momentum_slope[1],
               momentum_zi = x.w[i] * points.momentum_slope[2];
    const auto force_y = x.w[i] * points.force_slope[1], force_zi = x.w[i] * points.force_slope[2];
    const Real mass_i = x.w[i] * points.mass;
#pragma GCC unroll 1
    for (int j = 0; j < Support; ++j) {
      const auto momentum = y.w[j] * momentum_i + y.moment[j] * momentum_y,
                 momentum_z = y.w[j] * momentum_zi;
      const auto force = y.w[j] * force_i + y.dw[j] * force_y, force_z = y.w[j] * force_zi;
      const Real mass = y.w[j] * mass_i;
      const std::ptrdiff_t row = i * at.stride[0] + j * at.stride[1];
#pragma GCC unroll 4
      for (int k = 0; k < Support; ++k) {
        NodeOf<3, Real> node;
        node.motion = z.w[k] * momentum + z.moment[k] * momentum_z;
        node.mass = z.w[k] * mass;
        node.change = z.w[k] * force + z.dw[k] * force_z;
        node.idle = 0;
        add_sums<SpaceNode, Real>(
            node, [&](std::size_t half) { return nodes[half][row + k].motion.data(); });
      }
    }
  }
}

template <int Support, class Real>
[[gnu::noinline]] GRAINPAIR_FLATTEN void give(const Given<3, Real>& points,
                                              const Neighbours<3, Support, Real>& at) {
  const auto first = at.first();
  if (shared(first)) return give_together(points, at, shared_nodes(at.nodes, first));
  const auto& [x, y, z] = at.n;
  SpaceGiven<Real> turned;
  turned.motion[0] = {points.momentum, points.mass};
  turned.change[0] = {points.force, 0};
  for (int d = 0; d < 3; ++d)
    turned.motion[d + 1] = {points.momentum_slope[d], 0},
                      turned.change[d + 1] = {points.force_slope[d], 0};
  const auto halves = split<SpaceGiven, Real>(turned);
  std::array<SpaceGiven<double>, Real::size()> each;
  for (std::size_t h = 0; h < halves.size(); ++h)
    store<SpaceGiven>(halves[h], each.data() + Wide::size() * h,
                      [](std::size_t lane) { return lane; });
  const auto nodes = each_nodes(at.nodes, first);
  for (std::size_t point = 0; point < each.size(); ++point) {
    const auto four = [](const SpaceQuad<double>& from) { return load_row(from.vector.data()); };
    const auto weight = [&](const Real& of_all) { return Wide(of_all[point]); };
    const auto& [m, f] = each[point];
    const Wide own = four(m[0]), m_x = four(m[1]), m_y = four(m[2]), m_z = four(m[3]);
    const Wide force = four(f[0]), f_x = four(f[1]), f_y = four(f[2]), f_z = four(f[3]);
#pragma GCC unroll 1
    for (int i = 0; i < Support; ++i) {
      const Wide w = weight(x.w[i]);
      const Wide own_i = w * own + weight(x.moment[i]) * m_x,
                 force_i = w * force + weight(x.dw[i]) * f_x;
      const Wide m_y_i = w * m_y, m_z_i = w * m_z, f_y_i = w * f_y, f_z_i = w * f_z;
#pragma GCC unroll 4
      for (int j = 0; j < Support; ++j) {
        const Wide w_j = weight(y.w[j]);
        const Wide own_j = w_j * own_i + weight(y.moment[j]) * m_y_i,
                   force_j = w_j * force_i + weight(y.dw[j]) * f_y_i;
        const Wide m_z_j = w_j * m_z_i, f_z_j = w_j * f_z_i;
        Node<3>* const row = nodes[point] + i * at.stride[0] + j * at.stride[1];
#pragma GCC unroll 4
        for (int k = 0; k < Support; ++k) {
          Wide motion = load_row(row[k].motion.data()), change = load_row(row[k].change.data());
          motion += weight(z.w[k]) * own_j, motion += weight(z.moment[k]) * m_z_j;
          change += weight(z.w[k]) * force_j, change += weight(z.dw[k]) * f_z_j;
          store_row(motion, row[k].motion.data());
          store_row(change, row[k].change.data());
        }
      }
    }
  }
}

}  // namespace grainpair
