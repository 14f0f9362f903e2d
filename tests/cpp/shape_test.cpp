// What every shape function must do, whatever its degree, inside the grid and against its ends.
#include "mpm/grid/shape.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace grainpair {
namespace {

template <class Shape>
Weights<double, Shape::support> weights(const typename Shape::Axis& axis, double x) {
  Weights<double, Shape::support> out;
  Shape::evaluate(axis, x, out);
  return out;
}

template <class Shape>
class ShapeFunctions : public testing::Test {
 protected:
  static constexpr double h = 0.25;
  static constexpr double eps = 2.3e-16;
  /// Calls f with weights at many places of grids from one cell (where only B-splines make sense)
  /// to seven.
  template <class F>
  static void everywhere(F&& f) {
    for (int cells : {2, 3, 7}) {
      const typename Shape::Axis axis(cells, h, 0.5 * h);
      for (int i = 1; i < 997; ++i) {
        const double x = cells * h * i / 997.0;
        f(axis, x, weights<Shape>(axis, x));
      }
    }
  }
};

using Shapes = testing::Types<BSpline<1>, BSpline<2>, BSpline<3>, Gimp>;
TYPED_TEST_SUITE(ShapeFunctions, Shapes);

// Tolerances: a handful of operations on numbers of order one (weights) or 1/h (slopes). GIMP
// divides a difference by the width of its domain, which a wall may cut to 1/500 of a cell.
template <class Shape>
constexpr double tolerance = std::is_same_v<Shape, Gimp> ? 1e-12 : 32 * 2.3e-16;

TYPED_TEST(ShapeFunctions, PartitionOfUnity) {
  this->everywhere([this](const auto&, double, const auto& n) {
    double sum = 0.0, slope = 0.0;
    for (std::size_t k = 0; k < n.w.size(); ++k) sum += n.w[k], slope += n.dw[k];
    EXPECT_NEAR(sum, 1.0, tolerance<TypeParam>);
    EXPECT_NEAR(slope, 0.0, tolerance<TypeParam> / this->h);
  });
}

TYPED_TEST(ShapeFunctions, LinearCompleteness) {
  this->everywhere([this](const auto& axis, double x, const auto& n) {
    double moment = 0.0, slope = 0.0, inertia = 0.0;
    for (std::size_t k = 0; k < n.w.size(); ++k) {
      const double xi = axis.node_position[static_cast<std::size_t>(n.first) + k] - x;
      moment += n.w[k] * xi, slope += n.dw[k] * xi, inertia += n.w[k] * xi * xi;
      EXPECT_NEAR(n.moment[k], n.w[k] * xi, tolerance<TypeParam> * this->h);
    }
    EXPECT_NEAR(n.inertia, inertia, tolerance<TypeParam> * this->h * this->h);
    EXPECT_NEAR(moment, 0.0, tolerance<TypeParam> * this->h);
    EXPECT_NEAR(slope, 1.0, 10 * tolerance<TypeParam>);
  });
}

TYPED_TEST(ShapeFunctions, WeightsAreNotNegative) {
  this->everywhere([this](const auto&, double, const auto& n) {
    for (double w : n.w) EXPECT_GE(w, -4e-16);
  });
}

TYPED_TEST(ShapeFunctions, SlopeIsDerivativeOfValue) {
  if constexpr (std::is_same_v<TypeParam, Gimp>) {
    GTEST_SKIP() << "a GIMP slope is the mean slope over the domain, not the slope of the mean "
                    "where a wall cuts it";
  } else {
    this->everywhere([this](const auto& axis, double x, const auto& n) {
      const double d = 1e-6 * this->h;
      const auto lower = weights<TypeParam>(axis, x - d), upper = weights<TypeParam>(axis, x + d);
      if (lower.first != upper.first) return;  // straddles a knot
      for (std::size_t k = 0; k < n.w.size(); ++k)
        EXPECT_NEAR((upper.w[k] - lower.w[k]) / (2 * d), n.dw[k], 1e-8 / this->h);
    });
  }
}

TYPED_TEST(ShapeFunctions, OnlyTheWallNodeCountsAtAWall) {
  const typename TypeParam::Axis axis(4, this->h, 0.5 * this->h);
  const auto n = weights<TypeParam>(axis, 1e-12 * this->h);
  EXPECT_EQ(n.first, 0);
  EXPECT_NEAR(n.w[0], 1.0, 1e-11);
}

TEST(QuadraticBSpline, FirstCellIsTheOpenKnotBasis) {
  // (1-t)^2, 2t - 3t^2/2, t^2/2 with nodes at 0, h/2, 3h/2
  const BSpline<2>::Axis axis(5, 2.0, 1.0);
  const double t = 0.3;
  const auto n = weights<BSpline<2>>(axis, 2.0 * t);
  EXPECT_DOUBLE_EQ(n.w[0], (1 - t) * (1 - t));
  EXPECT_DOUBLE_EQ(n.w[1], 2 * t - 1.5 * t * t);
  EXPECT_DOUBLE_EQ(n.w[2], 0.5 * t * t);
  EXPECT_DOUBLE_EQ(axis.node_position[1], 1.0);
  EXPECT_DOUBLE_EQ(axis.node_position[2], 3.0);
}

}  // namespace
}  // namespace grainpair
