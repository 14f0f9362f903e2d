#pragma once

#include <vector>

#include "mpm/transfer/pic.hpp"

namespace grainpair {

/// PIC from grid velocities sharpened by the truncated series v + (I - S+ S) v + ... of `order`
/// terms, in which S takes the grid to the points and S+ the points to the grid: XPIC(m)/FMPM(k)
/// [Hammerquist2017, Nairn2021]. Order 1 is PIC; each further term lets shorter waves through
/// undamped.
struct Xpic : Pic {
  /// v <- sum_{l < m} (I - S+ S)^l v on the nodes. `on` sweeps over nodes and points (the solver);
  /// `change` of the nodes holds the running term. constrained(v, node) is what walls make of it.
  template <class Vec, class Sweeps, class Constrained>
  static void sharpen(Sweeps& on, int order, const Constrained& constrained) {
    const auto* const first = &on.grid_.nodes[on.first_node_];
    std::vector<Vec> term(on.points_.size()), sum(on.grid_.nodes.size());
    const auto index_of = [&](const auto& node) { return static_cast<std::size_t>(&node - first); };
    on.for_each_node([&](auto& node, const auto&) { sum[index_of(node)] = node.motion; });
    for (int l = 1; l < order; ++l) {
      on.for_each_point([&](std::size_t p) {  // S: the term at the points
        term[p].setZero();
        on.for_each_weight(p, [&](const auto& node, double w) { term[p] += w * node.motion; });
      });
      on.for_each_node([&](auto& node, const auto&) { node.change.setZero(); });
      on.for_each_point([&](std::size_t p) {  // S+: back to the nodes, mass-weighted
        on.for_each_weight(
            p, [&](auto& node, double w) { node.change += (w * on.points_.mass[p]) * term[p]; });
      });
      on.fold(Sweeps::Folded::changes);
      on.for_each_node([&](auto& node, const auto& index) {
        if (node.mass <= 0.0) return;
        node.motion = constrained(Vec(node.motion - node.change / node.mass), index);
        sum[index_of(node)] += node.motion;
      });
    }
    on.for_each_node([&](auto& node, const auto&) {
      node.motion = sum[index_of(node)];
      node.change.setZero();
      on.hand_out(node, Vec(node.motion), Vec(node.change));
    });
  }
};

}  // namespace grainpair
