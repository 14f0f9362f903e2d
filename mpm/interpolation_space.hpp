// Sums over the nodes of space. Side by side, points would need more sums than there are registers; so each goes alone, and
// what goes through the same weights lies in one of two registers, as it does in a node: motion and mass, or change.
#pragma once

#include "mpm/interpolation.hpp"

namespace grainpair {

/// A node's numbers in registers.
struct Packet {
  Quad motion, change;

  static Packet zero() { return {0.0, 0.0}; }
  static Packet load(const double* from) {
    return {Quad(from, std::experimental::element_aligned), Quad(from + 4, std::experimental::element_aligned)};
  }
  void store(double* to) const {
    motion.copy_to(to, std::experimental::element_aligned);
    change.copy_to(to + 4, std::experimental::element_aligned);
  }
  void add(const Quad& w, const Packet& a) { motion += w * a.motion, change += w * a.change; }
};

/// The numbers of such packets, four to a register.
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
struct SpaceCollected {
  SpaceQuad<Real> v, dv;
  std::array<SpaceQuad<Real>, 3> slope;
};
template <class Real>
struct SpaceMoments {
  std::array<SpaceQuad<Real>, 3> moment, moment_increment;
};

template <int Support>
void give(const Given<3>& points, const Neighbours<3, Support>& at) {
  const auto& [x, y, z] = at.n;
  SpaceGiven<Wide> turned;
  turned.motion[0].vector = points.momentum, turned.motion[0].rest = points.mass;
  turned.change[0].vector = points.force, turned.change[0].rest = 0.0;
  for (int d = 0; d < 3; ++d) {
    turned.motion[d + 1].vector = points.momentum_slope[d], turned.motion[d + 1].rest = 0.0;
    turned.change[d + 1].vector = points.force_slope[d], turned.change[d + 1].rest = 0.0;
  }
  std::array<SpaceGiven<double>, Wide::size()> each;
  store<SpaceGiven>(turned, each.data(), [](std::size_t lane) { return lane; });
  for (std::size_t lane = 0; lane < Wide::size(); ++lane) {
    const auto quad = [](const SpaceQuad<double>& from) { return Quad(from.vector.data(), std::experimental::element_aligned); };
    const auto& [m, f] = each[lane];
    const Quad own = quad(m[0]), m_x = quad(m[1]), m_y = quad(m[2]), m_z = quad(m[3]);
    const Quad force = quad(f[0]), f_x = quad(f[1]), f_y = quad(f[2]), f_z = quad(f[3]);
#pragma GCC unroll 1
    for (int i = 0; i < Support; ++i) {
      const Quad w = x.w[i][lane];
      const Quad own_i = w * own + Quad(x.moment[i][lane]) * m_x, force_i = w * force + Quad(x.dw[i][lane]) * f_x;
      const Quad m_y_i = w * m_y, m_z_i = w * m_z, f_y_i = w * f_y, f_z_i = w * f_z;
#pragma GCC unroll 4
      for (int j = 0; j < Support; ++j) {
        const Quad w_j = y.w[j][lane];
        const Quad own_j = w_j * own_i + Quad(y.moment[j][lane]) * m_y_i, force_j = w_j * force_i + Quad(y.dw[j][lane]) * f_y_i;
        const Quad m_z_j = w_j * m_z_i, f_z_j = w_j * f_z_i;
        Node<3>* const row = at.first[lane] + i * at.stride[0] + j * at.stride[1];
#pragma GCC unroll 4
        for (int k = 0; k < Support; ++k) {
          Packet node = Packet::load(row[k].motion.data());
          node.motion += Quad(z.w[k][lane]) * own_j + Quad(z.moment[k][lane]) * m_z_j;
          node.change += Quad(z.w[k][lane]) * force_j + Quad(z.dw[k][lane]) * f_z_j;
          node.store(row[k].motion.data());
        }
      }
    }
  }
}

template <bool Moments, int Support>
Collected<3> collect(const Neighbours<3, Support>& at) {
  const auto& [x, y, z] = at.n;
  std::array<SpaceCollected<double>, Wide::size()> each;
  [[maybe_unused]] std::array<SpaceMoments<double>, Wide::size()> each_moments;
  for (std::size_t lane = 0; lane < Wide::size(); ++lane) {
    Packet all = Packet::zero(), moment[3] = {Packet::zero(), Packet::zero(), Packet::zero()};
    Quad slope[3] = {0.0, 0.0, 0.0};
#pragma GCC unroll 1
    for (int i = 0; i < Support; ++i) {
      Packet plane = Packet::zero(), plane_moment[2] = {Packet::zero(), Packet::zero()};
      Quad plane_slope[2] = {0.0, 0.0};
#pragma GCC unroll 4
      for (int j = 0; j < Support; ++j) {
        Packet row = Packet::zero(), row_moment = Packet::zero();
        Quad row_slope = 0.0;
        const Node<3>* const nodes = at.first[lane] + i * at.stride[0] + j * at.stride[1];
#pragma GCC unroll 4
        for (int k = 0; k < Support; ++k) {
          const Packet node = Packet::load(nodes[k].motion.data());
          row.add(z.w[k][lane], node);
          row_slope += Quad(z.dw[k][lane]) * node.motion;
          if constexpr (Moments) row_moment.add(z.moment[k][lane], node);
        }
        const Quad w = y.w[j][lane];
        plane.add(w, row);
        plane_slope[0] += Quad(y.dw[j][lane]) * row.motion;
        plane_slope[1] += w * row_slope;
        if constexpr (Moments) {
          plane_moment[0].add(y.moment[j][lane], row);
          plane_moment[1].add(w, row_moment);
        }
      }
      const Quad w = x.w[i][lane];
      all.add(w, plane);
      slope[0] += Quad(x.dw[i][lane]) * plane.motion;
      slope[1] += w * plane_slope[0];
      slope[2] += w * plane_slope[1];
      if constexpr (Moments) {
        moment[0].add(x.moment[i][lane], plane);
        moment[1].add(w, plane_moment[0]);
        moment[2].add(w, plane_moment[1]);
      }
    }
    const auto put = [](const Quad& quad, SpaceQuad<double>& to) { quad.copy_to(to.vector.data(), std::experimental::element_aligned); };
    put(all.motion, each[lane].v);
    put(all.change, each[lane].dv);
#pragma GCC unroll 3
    for (int d = 0; d < 3; ++d) {
      put(slope[d], each[lane].slope[d]);
      if constexpr (Moments) {
        put(moment[d].motion, each_moments[lane].moment[d]);
        put(moment[d].change, each_moments[lane].moment_increment[d]);
      }
    }
  }
  const auto in_order = [](std::size_t lane) { return lane; };
  const auto turned = load<SpaceCollected>(each.data(), in_order);
  Collected<3> out;
  out.v = turned.v.vector, out.dv = turned.dv.vector;
  for (int d = 0; d < 3; ++d) out.slope[d] = turned.slope[d].vector;
  if constexpr (Moments) {
    const auto moments = load<SpaceMoments>(each_moments.data(), in_order);
    for (int d = 0; d < 3; ++d)
      out.moment[d] = moments.moment[d].vector, out.moment_increment[d] = moments.moment_increment[d].vector;
  }
  return out;
}

}  // namespace grainpair
