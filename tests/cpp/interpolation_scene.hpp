// Several points between their nodes, and the same by sums over one point and one node at a time.
#pragma once

#include <gtest/gtest.h>

#include <random>

#include "mpm/grid/grid.hpp"
#include "mpm/grid/interpolation_plane.hpp"
#include "mpm/grid/interpolation_space.hpp"

namespace grainpair {
namespace test {

/// Of sums of 27 numbers of order one, and their weights: some dozens of roundings.
template <class Real>
constexpr double round_off = std::is_same_v<Real, WideFloat> ? 64.0 * 0x1p-24 : 1e-13;

template <class Shape, int Dim, class Real>
struct Scene {
  using Vec = Eigen::Matrix<double, Dim, 1>;
  static constexpr int cells = 6;

  std::vector<typename Shape::Axis> axes;
  Grid<Dim> grid;
  std::array<Vec, Real::size()> x;
  std::vector<FloatNode<Dim>> velocities;
  std::mt19937_64 random{7};

  static std::array<GridAxis, Dim> along(const std::vector<typename Shape::Axis>& axes) {
    std::array<GridAxis, Dim> out;
    std::copy(axes.begin(), axes.end(), out.begin());
    return out;
  }
  /// As many points as `together` in a cell, the cells anywhere, near walls, too.
  explicit Scene(std::size_t together)
      : axes(Dim, typename Shape::Axis(cells, 0.1, 0.05)), grid(along(axes)) {
    Vec corner;
    for (std::size_t point = 0; point < x.size(); ++point)
      for (int d = 0; d < Dim; ++d) {
        if (point % together == 0) corner[d] = std::floor(cells * unit());
        x[point][d] = 0.1 * (corner[d] + unit());
      }
  }
  double unit() { return std::uniform_real_distribution<double>(0.001, 0.999)(random); }
  double number() { return std::normal_distribution<double>()(random); }
  Real of_each(auto&& f) {
    return Real([&](auto point) { return static_cast<typename Real::value_type>(f(point)); });
  }
  VectorOf<Dim, Real> vector() {
    VectorOf<Dim, Real> out;
    for (int d = 0; d < Dim; ++d) out[d] = of_each([&](auto) { return number(); });
    return out;
  }
  Neighbours<Dim, Shape::support, Real> neighbours() {
    Neighbours<Dim, Shape::support, Real> out;
    out.nodes = grid.nodes.data();
    if constexpr (std::is_same_v<Real, Wide>) {
      out.velocities = out.nodes;
    } else {
      velocities.clear();
      for (const Node<Dim>& node : grid.nodes) velocities.emplace_back(node.motion, node.change);
      out.velocities = velocities.data();
    }
    for (int d = 0; d < Dim; ++d) {
      out.stride[d] = grid.stride[d];
      const auto half = [&](std::size_t first) {
        return Wide([&](auto lane) { return x[first + lane][d]; });
      };
      if constexpr (std::is_same_v<Real, Wide>)
        Shape::evaluate(axes[static_cast<std::size_t>(d)], half(0), out.n[d]);
      else
        Shape::evaluate(axes[static_cast<std::size_t>(d)], {half(0), half(Wide::size())}, out.n[d]);
    }
    return out;
  }
  /// f(node, weight, its slopes, node's place - point's) over the nodes of one point.
  template <class F>
  void each_node(std::size_t lane, F&& f) {
    std::array<Weights<double, Shape::support>, Dim> n;
    for (int d = 0; d < Dim; ++d)
      Shape::evaluate(axes[static_cast<std::size_t>(d)], x[lane][d], n[d]);
    constexpr int layers = Dim == 3 ? Shape::support : 1;
    for (int i = 0; i < Shape::support; ++i)
      for (int j = 0; j < Shape::support; ++j)
        for (int k = 0; k < layers; ++k) {
          const int index[3] = {i, j, k};
          std::size_t node = 0;
          double w = 1.0;
          Vec slope = Vec::Ones(), arm;
          for (int d = 0; d < Dim; ++d) {
            const std::size_t along =
                static_cast<std::size_t>(n[d].first) + static_cast<std::size_t>(index[d]);
            node += along * static_cast<std::size_t>(grid.stride[d]);
            w *= n[d].w[index[d]];
            for (int e = 0; e < Dim; ++e) slope[e] *= d == e ? n[d].dw[index[d]] : n[d].w[index[d]];
            arm[d] = grid.axes[d].node_position[along] - x[lane][d];
          }
          f(grid.nodes[node], w, slope, arm);
        }
  }
};

template <class Shape, int Dim, class Real>
void gives_as_alone(std::size_t together) {
  constexpr double bound = round_off<Real>;
  Scene<Shape, Dim, Real> scene(together);
  Given<Dim, Real> given;
  given.mass = scene.of_each([&](auto) { return scene.unit(); });
  given.momentum = scene.vector(), given.force = scene.vector();
  for (int d = 0; d < Dim; ++d)
    given.momentum_slope[d] = scene.vector(), given.force_slope[d] = scene.vector();
  for (auto& node : scene.grid.nodes) node.motion.setZero(), node.change.setZero(), node.mass = 0.0;
  give(given, scene.neighbours());
  const auto nodes = scene.grid.nodes;
  for (auto& node : scene.grid.nodes) node.motion.setZero(), node.change.setZero(), node.mass = 0.0;
  for (std::size_t lane = 0; lane < Real::size(); ++lane)
    scene.each_node(lane, [&](auto& node, double w, const auto& slope, const auto& arm) {
      node.mass += w * given.mass[lane];
      for (int c = 0; c < Dim; ++c) {
        node.motion[c] += w * given.momentum[c][lane], node.change[c] += w * given.force[c][lane];
        for (std::size_t d = 0; d < Dim; ++d) {
          node.motion[c] += w * arm[static_cast<int>(d)] * given.momentum_slope[d][c][lane];
          node.change[c] += slope[static_cast<int>(d)] * given.force_slope[d][c][lane];
        }
      }
    });
  double given_mass = 0.0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto& expected = scene.grid.nodes[i];
    given_mass += nodes[i].mass;
    ASSERT_NEAR(nodes[i].mass, expected.mass, bound);
    ASSERT_LT((nodes[i].motion - expected.motion).norm(), bound);
    ASSERT_LT((nodes[i].change - expected.change).norm(), 10.0 * bound);  // slopes are of order 1/h
  }
  EXPECT_NEAR(given_mass, reduce(given.mass), bound);
}

template <class Shape, int Dim, class Real>
void collects_as_alone(std::size_t together) {
  constexpr double bound = round_off<Real>;
  Scene<Shape, Dim, Real> scene(together);
  for (auto& node : scene.grid.nodes)
    for (int c = 0; c < Dim; ++c) node.motion[c] = scene.number(), node.change[c] = scene.number();
  const auto all = collect<true>(scene.neighbours());
  for (std::size_t lane = 0; lane < Real::size(); ++lane) {
    using Vec = typename Scene<Shape, Dim, Real>::Vec;
    using Mat = Eigen::Matrix<double, Dim, Dim>;
    Vec v = Vec::Zero(), dv = Vec::Zero();
    Mat gradient = Mat::Zero(), moment = Mat::Zero(), increment = Mat::Zero();
    scene.each_node(lane, [&](const auto& node, double w, const Vec& slope, const Vec& arm) {
      v += w * node.motion, dv += w * node.change;
      gradient += node.motion * slope.transpose();
      moment += w * node.motion * arm.transpose(), increment += w * node.change * arm.transpose();
    });
    for (int c = 0; c < Dim; ++c) {
      ASSERT_NEAR(all.v[c][lane], v[c], bound);
      ASSERT_NEAR(all.dv[c][lane], dv[c], bound);
      for (std::size_t d = 0; d < Dim; ++d) {
        const int axis = static_cast<int>(d);
        ASSERT_NEAR(all.slope[d][c][lane], gradient(c, axis), 10.0 * bound);
        ASSERT_NEAR(all.moment[d][c][lane], moment(c, axis), bound);
        ASSERT_NEAR(all.moment_increment[d][c][lane], increment(c, axis), bound);
      }
    }
  }
}

}  // namespace test
}  // namespace grainpair
