// From points to the nodes of a plane. Points stay side by side; what those that share their nodes
// give is summed before it goes to a node, else each node's share is turned into theirs.
#pragma once

#include "mpm/grid/interpolation.hpp"

namespace grainpair {

template <class Real>
struct PlaneGiven {
  VectorOf<2, Real> momentum, force;
};

/// add(offset from the first node, momentum and force it is given by each point), add_masses(offset
/// of a row of nodes, their masses)
template <int Support, class Real, class Add, class AddMasses>
void give_to_nodes(const Given<2, Real>& points, const Neighbours<2, Support, Real>& at,
                   const Add& add, const AddMasses& add_masses) {
  const auto& [x, y] = at.n;
  for (int i = 0; i < Support; ++i) {
    const auto momentum = x.w[i] * points.momentum + x.moment[i] * points.momentum_slope[0];
    const auto force = x.w[i] * points.force + x.dw[i] * points.force_slope[0];
    const auto momentum_slope = x.w[i] * points.momentum_slope[1],
               force_slope = x.w[i] * points.force_slope[1];
    const Real mass = x.w[i] * points.mass;
    std::array<Real, 4> masses;
    masses.fill(0);
#pragma GCC unroll 4
    for (int j = 0; j < Support; ++j) {
      const PlaneGiven<Real> given{y.w[j] * momentum + y.moment[j] * momentum_slope,
                                   y.w[j] * force + y.dw[j] * force_slope};
      add(i * at.stride[0] + j, given);
      masses[j] = y.w[j] * mass;
    }
    add_masses(i * at.stride[0], masses);
  }
}

template <int Support, class Real>
void give(const Given<2, Real>& points, const Neighbours<2, Support, Real>& at) {
  const auto first = at.first();
  const auto add_row = [](const Wide& masses, Node<2>* row) {
    for (int j = 0; j < Support; ++j) row[j].mass += masses[j];
  };
  if (shared(first)) {
    const auto nodes = shared_nodes(at.nodes, first);
    return give_to_nodes(
        points, at,
        [&](std::ptrdiff_t offset, const PlaneGiven<Real>& given) {
          add_sums<PlaneGiven, Real>(
              given, [&](std::size_t half) { return nodes[half][offset].motion.data(); });
        },
        [&](std::ptrdiff_t offset, const std::array<Real, 4>& m) {
          const auto masses = split(sums(m[0], m[1], m[2], m[3]));
          for (std::size_t h = 0; h < masses.size(); ++h) add_row(masses[h], nodes[h] + offset);
        });
  }
  const auto nodes = each_nodes(at.nodes, first);
  give_to_nodes(
      points, at,
      [&](std::ptrdiff_t offset, const PlaneGiven<Real>& given) {
        add_rows<PlaneGiven, Real>(
            given, [&](std::size_t point) { return nodes[point][offset].motion.data(); });
      },
      [&](std::ptrdiff_t offset, std::array<Real, 4> m) {
        transpose(m[0], m[1], m[2], m[3]);
        for (std::size_t lane = 0; lane < Wide::size(); ++lane) {
          const auto masses = split(m[lane]);
          for (std::size_t h = 0; h < masses.size(); ++h)
            add_row(masses[h], nodes[Wide::size() * h + lane] + offset);
        }
      });
}

}  // namespace grainpair
