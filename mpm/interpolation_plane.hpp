// Sums over the nodes of a plane. Points stay side by side, and each node's numbers are turned into theirs.
#pragma once

#include "mpm/interpolation.hpp"

namespace grainpair {

template <class Real>
using PlaneNode = NodeOf<2, Real>;
template <class Real>
struct PlaneMotion {
  VectorOf<2, Real> v, dv;
};

template <int Support>
void give(const Given<2>& points, const Neighbours<2, Support>& at) {
  const auto& [x, y] = at.n;
  for (int i = 0; i < Support; ++i) {
    const auto momentum = x.w[i] * points.momentum + x.moment[i] * points.momentum_slope[0];
    const auto force = x.w[i] * points.force + x.dw[i] * points.force_slope[0];
    const auto momentum_slope = x.w[i] * points.momentum_slope[1], force_slope = x.w[i] * points.force_slope[1];
    const Wide mass = x.w[i] * points.mass;
    for (int j = 0; j < Support; ++j) {
      PlaneNode<Wide> node;
      node.motion = y.w[j] * momentum + y.moment[j] * momentum_slope;
      node.change = y.w[j] * force + y.dw[j] * force_slope;
      node.mass = y.w[j] * mass;
      add_rows<PlaneNode>(node, [&](std::size_t lane) { return at.first[lane][i * at.stride[0] + j].motion.data(); });
    }
  }
}

template <bool Moments, int Support>
Collected<2> collect(const Neighbours<2, Support>& at) {
  using Vec = VectorOf<2, Wide>;
  const Vec zero = Vec::Zero();
  const auto& [x, y] = at.n;
  Collected<2> out{zero, zero, {zero, zero}, {zero, zero}, {zero, zero}};
  for (int i = 0; i < Support; ++i) {
    Vec v = zero, dv = zero, slope = zero, moment = zero, moment_increment = zero;
#pragma GCC unroll 4
    for (int j = 0; j < Support; ++j) {
      const auto node = load_rows<PlaneMotion>([&](std::size_t lane) { return at.first[lane][i * at.stride[0] + j].motion.data(); });
      v += y.w[j] * node.v;
      dv += y.w[j] * node.dv;
      slope += y.dw[j] * node.v;
      if constexpr (Moments) {
        moment += y.moment[j] * node.v;
        moment_increment += y.moment[j] * node.dv;
      }
    }
    out.v += x.w[i] * v;
    out.dv += x.w[i] * dv;
    out.slope[0] += x.dw[i] * v;
    out.slope[1] += x.w[i] * slope;
    if constexpr (Moments) {
      out.moment[0] += x.moment[i] * v;
      out.moment[1] += x.w[i] * moment;
      out.moment_increment[0] += x.moment[i] * dv;
      out.moment_increment[1] += x.w[i] * moment_increment;
    }
  }
  return out;
}

}  // namespace grainpair
