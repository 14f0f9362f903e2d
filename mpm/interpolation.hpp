// Between points and their nodes: what nodes hold, what points give to them and collect of them, and the way back from the
// nodes. The ways there are those of interpolation_plane.hpp and interpolation_space.hpp.
#pragma once

#include <array>

#include "mpm/shape.hpp"
#include "mpm/tensor.hpp"

namespace grainpair {

/// Motion and change are momentum [kg m/s] and force [N] on their way to the grid, velocity and its increment [m/s] on their
/// way back.
template <int Dim, class Real>
struct NodeOf;
template <class Real>
struct NodeOf<2, Real> {
  VectorOf<2, Real> motion, change;
  Real mass;  // [kg]
};
template <class Real>
struct NodeOf<3, Real> {
  VectorOf<3, Real> motion;
  Real mass;
  VectorOf<3, Real> change;
  Real idle;  // fills up the second four
};

/// One cache line.
template <int Dim>
struct alignas(64) Node : NodeOf<Dim, double> {};

/// As much of nodes as their motion and change take, of several points.
template <class Real>
struct PlaneMotion {
  VectorOf<2, Real> motion, change;
};
template <class Real>
using SpaceMotion = NodeOf<3, Real>;
template <int Dim, class Row>
auto load_motion(const Row& row) {
  if constexpr (Dim == 2)
    return load_rows<PlaneMotion>(row);
  else
    return load_rows<SpaceMotion>(row);
}

/// Several points' momenta and forces, and how both change along each axis.
template <int Dim>
struct Given {
  using Vec = VectorOf<Dim, Wide>;
  using Mat = std::array<Vec, Dim>;
  Wide mass;
  Vec momentum, force;
  Mat momentum_slope, force_slope;

  explicit Given(const Wide& m) : mass(m), force(Vec::Zero()) {
    momentum_slope.fill(Vec::Zero());
    force_slope.fill(Vec::Zero());
  }
};

/// What comes back: velocity and its increment, the slope of the velocity along each axis, and the first moments of both.
template <int Dim>
struct Collected {
  using Vec = VectorOf<Dim, Wide>;
  using Mat = std::array<Vec, Dim>;
  Vec v, dv;
  Mat slope, moment, moment_increment;
};

/// Weights of several points along each axis, and the nodes that each shares.
template <int Dim, int Support>
struct Neighbours {
  std::array<Weights<Wide, Support>, Dim> n;
  Node<Dim>* nodes;  // of the grid
  std::array<std::ptrdiff_t, Dim> stride;  // 1 along the last axis

  /// Number of each point's first node.
  Wide first() const {
    Wide out = n[Dim - 1].first;
    for (int d = 0; d < Dim - 1; ++d) out += n[d].first * static_cast<double>(stride[d]);
    return out;
  }
};

/// Of one number of the nodes: its mean, and its slope and first moment along each axis.
template <int Axes>
struct WeightedSums {
  Wide value = 0.0;
  std::array<Wide, Axes> slope, moment;
  WeightedSums() { slope.fill(0.0), moment.fill(0.0); }
};

/// Sums over the nodes along the last `Axes` axes; number(offset) is that of a node, `stride` what the offset gains along an axis.
template <int Axes, bool Slopes, bool Moments, int Dim, int Support, class Number>
WeightedSums<Axes> weighted_sums(const std::array<Weights<Wide, Support>, Dim>& weights, const std::array<std::ptrdiff_t, Dim>& stride,
                                 const Number& number, std::ptrdiff_t offset = 0) {
  WeightedSums<Axes> out;
  if constexpr (Axes == 0) {
    out.value = number(offset);
  } else {
    constexpr int axis = Dim - Axes;
    const auto& n = weights[axis];
#pragma GCC unroll 4
    for (int i = 0; i < Support; ++i) {
      const std::ptrdiff_t step = axis == Dim - 1 ? 1 : stride[axis];  // known before the run where it can be
      const auto part = weighted_sums<Axes - 1, Slopes, Moments, Dim, Support>(weights, stride, number, offset + i * step);
      out.value += n.w[i] * part.value;
      if constexpr (Slopes) out.slope[0] += n.dw[i] * part.value;
      if constexpr (Moments) out.moment[0] += n.moment[i] * part.value;
      for (std::size_t k = 1; k < Axes; ++k) {
        if constexpr (Slopes) out.slope[k] += n.w[i] * part.slope[k - 1];
        if constexpr (Moments) out.moment[k] += n.w[i] * part.moment[k - 1];
      }
    }
  }
  return out;
}

/// From the nodes to the points, which stay side by side; each number of the nodes goes alone, so that its sums fit in the
/// registers. node[offset] holds a node's motion and change.
template <bool Moments, int Dim, int Support, class Nodes>
Collected<Dim> collect_from(const std::array<Weights<Wide, Support>, Dim>& weights, const std::array<std::ptrdiff_t, Dim>& stride, const Nodes& node) {
  Collected<Dim> out;
  for (int c = 0; c < Dim; ++c) {
    const auto v = weighted_sums<Dim, true, Moments, Dim, Support>(weights, stride, [&](std::ptrdiff_t offset) { return Wide(node[offset].motion[c]); });
    const auto dv = weighted_sums<Dim, false, Moments, Dim, Support>(weights, stride, [&](std::ptrdiff_t offset) { return Wide(node[offset].change[c]); });
    out.v[c] = v.value, out.dv[c] = dv.value;
    for (std::size_t d = 0; d < Dim; ++d)
      out.slope[d][c] = v.slope[d], out.moment[d][c] = v.moment[d], out.moment_increment[d][c] = dv.moment[d];
  }
  return out;
}

/// Nodes that all points share are read as they are; else every point's are turned into columns first.
template <bool Moments, int Dim, int Support>
Collected<Dim> collect(const Neighbours<Dim, Support>& at) {
  const Wide first = at.first();
  if (alike(first)) return collect_from<Moments, Dim, Support>(at.n, at.stride, at.nodes + static_cast<int>(first[0]));
  const auto each = index_below(first);
  constexpr int layers = Dim == 3 ? Support : 1;
  std::array<std::conditional_t<Dim == 2, PlaneMotion<Wide>, SpaceMotion<Wide>>, Support * Support * layers> turned;
  auto* to = turned.data();
  for (int i = 0; i < Support; ++i)
    for (int j = 0; j < Support; ++j)
      for (int k = 0; k < layers; ++k, ++to) {
        const std::ptrdiff_t offset = i * at.stride[0] + j * at.stride[1] + k;
        *to = load_motion<Dim>([&](std::size_t lane) { return reinterpret_cast<const double*>(at.nodes + each[lane] + offset); });
      }
  if constexpr (Dim == 2)
    return collect_from<Moments, Dim, Support>(at.n, {Support, 1}, turned.data());
  else
    return collect_from<Moments, Dim, Support>(at.n, {Support * Support, Support, 1}, turned.data());
}

}  // namespace grainpair
