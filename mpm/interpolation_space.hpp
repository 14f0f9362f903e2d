// From points to the nodes of space. What points that share their nodes give is summed before it goes to a node. Else each point
// goes by itself: a node's numbers fill two registers, and so do a point's own and their slopes along each axis.
#pragma once

#include "mpm/interpolation.hpp"

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

/// All points to their common nodes.
template <int Support>
void give_together(const Given<3>& points, const std::array<Weights<Wide, Support>, 3>& n, const std::array<std::ptrdiff_t, 3>& stride, Node<3>* nodes) {
  const auto& [x, y, z] = n;
#pragma GCC unroll 1
  for (int i = 0; i < Support; ++i) {
    const auto momentum_i = x.w[i] * points.momentum + x.moment[i] * points.momentum_slope[0];
    const auto force_i = x.w[i] * points.force + x.dw[i] * points.force_slope[0];
    const auto momentum_y = x.w[i] * points.momentum_slope[1], momentum_zi = x.w[i] * points.momentum_slope[2];
    const auto force_y = x.w[i] * points.force_slope[1], force_zi = x.w[i] * points.force_slope[2];
    const Wide mass_i = x.w[i] * points.mass;
#pragma GCC unroll 1
    for (int j = 0; j < Support; ++j) {
      const auto momentum = y.w[j] * momentum_i + y.moment[j] * momentum_y, momentum_z = y.w[j] * momentum_zi;
      const auto force = y.w[j] * force_i + y.dw[j] * force_y, force_z = y.w[j] * force_zi;
      const Wide mass = y.w[j] * mass_i;
      Node<3>* const row = nodes + i * stride[0] + j * stride[1];
#pragma GCC unroll 4
      for (int k = 0; k < Support; ++k) {
        NodeOf<3, Wide> node;
        node.motion = z.w[k] * momentum + z.moment[k] * momentum_z;
        node.mass = z.w[k] * mass;
        node.change = z.w[k] * force + z.dw[k] * force_z;
        node.idle = 0.0;
        add_sum<SpaceMotion>(node, row[k].motion.data());
      }
    }
  }
}

template <int Support>
void give(const Given<3>& points, const Neighbours<3, Support>& at) {
  const Wide at_first = at.first();
  if (alike(at_first)) return give_together(points, at.n, at.stride, at.nodes + static_cast<int>(at_first[0]));
  const auto& [x, y, z] = at.n;
  SpaceGiven<Wide> turned;
  turned.motion[0] = {points.momentum, points.mass};
  turned.change[0] = {points.force, 0.0};
  for (int d = 0; d < 3; ++d) turned.motion[d + 1] = {points.momentum_slope[d], 0.0}, turned.change[d + 1] = {points.force_slope[d], 0.0};
  std::array<SpaceGiven<double>, Wide::size()> each;
  store<SpaceGiven>(turned, each.data(), [](std::size_t lane) { return lane; });
  const auto first = index_below(at_first);
  for (std::size_t lane = 0; lane < Wide::size(); ++lane) {
    const auto quad = [](const SpaceQuad<double>& from) { return load_row(from.vector.data()); };
    const auto& [m, f] = each[lane];
    const Wide own = quad(m[0]), m_x = quad(m[1]), m_y = quad(m[2]), m_z = quad(m[3]);
    const Wide force = quad(f[0]), f_x = quad(f[1]), f_y = quad(f[2]), f_z = quad(f[3]);
#pragma GCC unroll 1
    for (int i = 0; i < Support; ++i) {
      const Wide w = x.w[i][lane];
      const Wide own_i = w * own + Wide(x.moment[i][lane]) * m_x, force_i = w * force + Wide(x.dw[i][lane]) * f_x;
      const Wide m_y_i = w * m_y, m_z_i = w * m_z, f_y_i = w * f_y, f_z_i = w * f_z;
#pragma GCC unroll 4
      for (int j = 0; j < Support; ++j) {
        const Wide w_j = y.w[j][lane];
        const Wide own_j = w_j * own_i + Wide(y.moment[j][lane]) * m_y_i, force_j = w_j * force_i + Wide(y.dw[j][lane]) * f_y_i;
        const Wide m_z_j = w_j * m_z_i, f_z_j = w_j * f_z_i;
        Node<3>* const row = at.nodes + first[lane] + i * at.stride[0] + j * at.stride[1];
#pragma GCC unroll 4
        for (int k = 0; k < Support; ++k) {
          Wide motion = load_row(row[k].motion.data()), change = load_row(row[k].change.data());
          motion += Wide(z.w[k][lane]) * own_j, motion += Wide(z.moment[k][lane]) * m_z_j;
          change += Wide(z.w[k][lane]) * force_j, change += Wide(z.dw[k][lane]) * f_z_j;
          store_row(motion, row[k].motion.data());
          store_row(change, row[k].change.data());
        }
      }
    }
  }
}

}  // namespace grainpair
