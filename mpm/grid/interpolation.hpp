// Between points and their nodes: what nodes hold, what points give to them and collect of them,
// and the way back from the nodes. The ways there are those of interpolation_plane.hpp and
// interpolation_space.hpp.
#pragma once

#include <array>

#include "mpm/grid/shape.hpp"
#include "mpm/numbers/tensor.hpp"

namespace grainpair {

/// Motion and change are momentum [kg m/s] and force [N] on their way to the grid, velocity and its
/// increment [m/s] on their way back.
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

/// As much of nodes as their motion and change take, by fours.
template <int Dim, class Number>
struct Motion {
  static constexpr int room = Dim == 2 ? 2 : 4;
  std::array<Number, room> motion, change;
};

/// Of one node in single precision.
template <int Dim>
struct FloatNode : Motion<Dim, float> {
  FloatNode() : Motion<Dim, float>{} {}
  FloatNode(const VectorOf<Dim, double>& velocity, const VectorOf<Dim, double>& increment)
      : FloatNode() {
    for (std::size_t d = 0; d < Dim; ++d)
      this->motion[d] = static_cast<float>(velocity[d]),
      this->change[d] = static_cast<float>(increment[d]);
  }
};

/// Several points' momenta and forces, and how both change along each axis.
template <int Dim, class Real>
struct Given {
  using Vec = VectorOf<Dim, Real>;
  using Mat = MatrixOf<Dim, Real>;
  Real mass;
  Vec momentum, force;
  Mat momentum_slope, force_slope;
};

/// What comes back: velocity and its increment, the slope of the velocity along each axis, and the
/// first moments of both.
template <int Dim, class Real>
struct Collected {
  using Vec = VectorOf<Dim, Real>;
  using Mat = MatrixOf<Dim, Real>;
  Vec v, dv;
  Mat slope, moment, moment_increment;
};

/// Weights of several points along each axis, and the nodes that each shares.
template <int Dim, int Support, class Real>
struct Neighbours {
  std::array<Weights<Real, Support>, Dim> n;
  Node<Dim>* nodes;  // of the grid
  const std::conditional_t<std::is_same_v<Real, Wide>, Node<Dim>, FloatNode<Dim>>* velocities;
  std::array<std::ptrdiff_t, Dim> stride;  // 1 along the last axis

  /// Number of each point's first node.
  Halves<Real> first() const {
    Halves<Real> out;
    for (std::size_t h = 0; h < out.size(); ++h) {
      const auto along = [&](std::size_t d) {
        if constexpr (out.size() == 1)
          return n[d].first;
        else
          return n[d].first[h];
      };
      out[h] = along(Dim - 1);
      for (std::size_t d = 0; d < Dim - 1; ++d) out[h] += along(d) * static_cast<double>(stride[d]);
    }
    return out;
  }
};

/// Whether the points of each half have the same.
template <std::size_t count>
bool shared(const std::array<Wide, count>& first) {
  bool out = true;
  for (const Wide& half : first) out = out && alike(half);
  return out;
}
/// The node that the first point of each half begins at.
template <class Nodes, std::size_t count>
std::array<Nodes*, count> shared_nodes(Nodes* nodes, const std::array<Wide, count>& first) {
  std::array<Nodes*, count> out;
  for (std::size_t h = 0; h < count; ++h) out[h] = nodes + static_cast<int>(first[h][0]);
  return out;
}
/// The same of each point.
template <class Nodes, std::size_t count>
std::array<Nodes*, count * Wide::size()> each_nodes(Nodes* nodes,
                                                    const std::array<Wide, count>& first) {
  std::array<Nodes*, count * Wide::size()> out;
  for (std::size_t point = 0; point < out.size(); ++point)
    out[point] = nodes + static_cast<int>(first[point / Wide::size()][point % Wide::size()]);
  return out;
}

/// Of one number of the nodes: its mean, and its slope and first moment along each axis.
template <int Axes, class Real>
struct WeightedSums {
  Real value;
  std::array<Real, Axes> slope, moment;
};

/// Sums over the nodes along the last `Axes` axes; number(offset) is that of a node, `stride` what
/// the offset gains along an axis.
template <int Axes, bool Slopes, bool Moments, int Dim, int Support, class Real, class Number>
WeightedSums<Axes, Real> weighted_sums(const std::array<Weights<Real, Support>, Dim>& weights,
                                       const std::array<std::ptrdiff_t, Dim>& stride,
                                       const Number& number, std::ptrdiff_t offset = 0) {
  WeightedSums<Axes, Real> out;
  if constexpr (Axes == 0) {
    out.value = number(offset);
  } else {
    constexpr int axis = Dim - Axes;
    const auto& n = weights[axis];
#pragma GCC unroll 4
    for (int i = 0; i < Support; ++i) {
      const std::ptrdiff_t step =
          axis == Dim - 1 ? 1 : stride[axis];  // known before the run where it can be
      const auto part = weighted_sums<Axes - 1, Slopes, Moments, Dim, Support, Real>(
          weights, stride, number, offset + i * step);
      const auto add = [&](Real& sum, const Real& weight, const Real& x) {
        sum = i == 0 ? weight * x : sum + weight * x;
      };
      add(out.value, n.w[i], part.value);
      if constexpr (Slopes) add(out.slope[0], n.dw[i], part.value);
      if constexpr (Moments) add(out.moment[0], n.moment[i], part.value);
      for (std::size_t k = 1; k < Axes; ++k) {
        if constexpr (Slopes) add(out.slope[k], n.w[i], part.slope[k - 1]);
        if constexpr (Moments) add(out.moment[k], n.w[i], part.moment[k - 1]);
      }
    }
  }
  return out;
}

/// From the nodes to the points, which stay side by side; each number of the nodes goes alone, so
/// that its sums fit in the registers. node[offset] holds a node's motion and change.
template <bool Moments, int Dim, int Support, class Real, class Nodes>
Collected<Dim, Real> collect_from(const std::array<Weights<Real, Support>, Dim>& weights,
                                  const std::array<std::ptrdiff_t, Dim>& stride,
                                  const Nodes& node) {
  Collected<Dim, Real> out;
  for (int c = 0; c < Dim; ++c) {
    const auto v = weighted_sums<Dim, true, Moments, Dim, Support, Real>(
        weights, stride, [&](std::ptrdiff_t offset) { return Real(node[offset].motion[c]); });
    const auto dv = weighted_sums<Dim, false, Moments, Dim, Support, Real>(
        weights, stride, [&](std::ptrdiff_t offset) { return Real(node[offset].change[c]); });
    out.v[c] = v.value, out.dv[c] = dv.value;
    for (std::size_t d = 0; d < Dim; ++d)
      out.slope[d][c] = v.slope[d], out.moment[d][c] = v.moment[d],
      out.moment_increment[d][c] = dv.moment[d];
  }
  return out;
}

/// Nodes that all points share are read as they are; else every point's are turned into columns
/// first.
template <bool Moments, int Dim, int Support, class Real>
Collected<Dim, Real> collect(const Neighbours<Dim, Support, Real>& at) {
  const auto first = at.first();
  const bool by_halves = shared(first);
  if (by_halves && first.front()[0] == first.back()[0])
    return collect_from<Moments, Dim, Support, Real>(at.n, at.stride,
                                                     shared_nodes(at.velocities, first)[0]);
  constexpr int layers = Dim == 3 ? Support : 1;
  constexpr std::size_t around = std::size_t{Support} * Support * layers;  // nodes of a point
  std::array<Motion<Dim, Real>, around> turned;
  const auto turn = [&](const auto& motion_at) {
    auto* to = turned.data();
    for (int i = 0; i < Support; ++i)
      for (int j = 0; j < Support; ++j)
        for (int k = 0; k < layers; ++k, ++to)
          *to = motion_at(i * at.stride[0] + (Dim == 2 ? j : j * at.stride[1] + k));
  };
  if (by_halves) {
    const auto nodes = shared_nodes(at.velocities, first);
    turn([&](std::ptrdiff_t offset) {
      return load_shared<Motion<Dim, Real>, Real>(
          [&](std::size_t half) { return nodes[half][offset].motion.data(); });
    });
  } else {
    const auto nodes = each_nodes(at.velocities, first);
    turn([&](std::ptrdiff_t offset) {
      return load_fours<Motion<Dim, Real>, Real>(
          [&](std::size_t point) { return nodes[point][offset].motion.data(); });
    });
  }
  if constexpr (Dim == 2)
    return collect_from<Moments, Dim, Support, Real>(at.n, {Support, 1}, turned.data());
  else
    return collect_from<Moments, Dim, Support, Real>(at.n, {Support * Support, Support, 1},
                                                     turned.data());
}

/// In space a function of its own: beside the sums over 27 nodes a call is nothing, and the
/// compiler meets them but once.
template <bool Moments, int Support, class Real>
[[gnu::noinline]] GRAINPAIR_FLATTEN Collected<3, Real> collect_in_space(
    const Neighbours<3, Support, Real>& at) {
  return collect<Moments>(at);
}
template <bool Moments, int Dim, int Support, class Real>
Collected<Dim, Real> collected(const Neighbours<Dim, Support, Real>& at) {
  if constexpr (Dim == 3)
    return collect_in_space<Moments>(at);
  else
    return collect<Moments>(at);
}

}  // namespace grainpair
