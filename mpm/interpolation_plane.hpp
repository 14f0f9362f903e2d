// From points to the nodes of a plane. Points stay side by side; what those that share their nodes give is summed before it goes
// to a node, else each node's share is turned into theirs.
#pragma once

#include "mpm/interpolation.hpp"

namespace grainpair {

template <class Real>
using PlaneNode = NodeOf<2, Real>;

/// add(offset from the first node, what it is given by each point)
template <int Support, class Add>
void give_to_nodes(const Given<2>& points, const Neighbours<2, Support>& at, const Add& add) {
  const auto& [x, y] = at.n;
  for (int i = 0; i < Support; ++i) {
    const auto momentum = x.w[i] * points.momentum + x.moment[i] * points.momentum_slope[0];
    const auto force = x.w[i] * points.force + x.dw[i] * points.force_slope[0];
    const auto momentum_slope = x.w[i] * points.momentum_slope[1], force_slope = x.w[i] * points.force_slope[1];
    const Wide mass = x.w[i] * points.mass;
#pragma GCC unroll 4
    for (int j = 0; j < Support; ++j) {
      PlaneNode<Wide> node;
      node.motion = y.w[j] * momentum + y.moment[j] * momentum_slope;
      node.change = y.w[j] * force + y.dw[j] * force_slope;
      node.mass = y.w[j] * mass;
      add(i * at.stride[0] + j, node);
    }
  }
}

template <int Support>
void give(const Given<2>& points, const Neighbours<2, Support>& at) {
  const auto numbers = [](Node<2>* node) { return node->motion.data(); };
  const Wide first = at.first();
  if (alike(first)) {
    Node<2>* const shared = at.nodes + static_cast<int>(first[0]);
    return give_to_nodes(points, at, [&](std::ptrdiff_t offset, const PlaneNode<Wide>& node) { add_sum<PlaneNode>(node, numbers(shared + offset)); });
  }
  const auto each = index_below(first);
  give_to_nodes(points, at, [&](std::ptrdiff_t offset, const PlaneNode<Wide>& node) {
    add_rows<PlaneNode>(node, [&](std::size_t lane) { return numbers(at.nodes + each[lane] + offset); });
  });
}

}  // namespace grainpair
