// Shape functions on one axis; the grid's are their tensor products.
//
// A policy gives: `support`, the number of nodes that share a point; an Axis built for [0, n h]; and
// evaluate(axis, x) -> Weights. Positions of the nodes are such that sum_i w_i X_i = x everywhere (linear
// completeness), which the affine transfers and the patch test rely on.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace grainpair {

/// Values and slopes at one point of the `Support` functions that reach it.
template <int Support>
struct Weights {
  int first;                             // index of the first node
  std::array<double, Support> w, dw, xi; // value [-], slope [1/m], node position - point position [m]
};

/// Open uniform B-splines of degree P: knots on the cell faces, P + 1 of them on either end. The end function is
/// therefore interpolatory: a wall on a cell face is one layer of nodes, exactly, and no function reaches beyond it.
/// P = 1 is the linear hat, P = 2 the quadratic and P = 3 the cubic B-spline [Steffen2008].
template <int P>
struct BSpline {
  static constexpr int degree = P;
  static constexpr int support = P + 1;

  struct Axis {
    double h, inverse_h;
    int cells, nodes;
    std::vector<double> node_position;                                   // Greville abscissae [m]
    std::vector<std::array<std::array<double, P + 1>, support>> coefficients;  // per cell: w_k = sum_j c_kj t^j

    Axis(int cell_count, double spacing, double /*point_size*/)
        : h(spacing), inverse_h(1.0 / spacing), cells(cell_count), nodes(cell_count + P) {
      const auto knot = [&](int i) { return std::clamp(i - P, 0, cells); };  // in cells
      for (int i = 0; i < nodes; ++i) {
        double sum = 0.0;
        for (int j = 1; j <= P; ++j) sum += knot(i + j);
        node_position.push_back(h * sum / P);
      }
      // Cox-de Boor on polynomials in t = x/h - cell, one cell at a time.
      for (int cell = 0; cell < cells; ++cell) {
        std::array<std::array<double, P + 1>, support> n{};
        n[P][0] = 1.0;  // degree 0: the one function that is 1 on this cell has index cell + P
        for (int p = 1; p <= P; ++p) {
          auto next = decltype(n){};
          for (int k = P - p; k <= P; ++k) {
            const int i = cell + k;
            const auto add = [&](int source, double constant, double slope) {
              if (source > P) return;
              for (int j = 0; j < p; ++j) {
                next[k][j] += constant * n[source][j];
                next[k][j + 1] += slope * n[source][j];
              }
            };
            // N_i^p = (x - u_i)/(u_{i+p} - u_i) N_i^{p-1} + (u_{i+p+1} - x)/(u_{i+p+1} - u_{i+1}) N_{i+1}^{p-1}
            if (const double span = knot(i + p) - knot(i); span > 0.0)
              add(k, (cell - knot(i)) / span, 1.0 / span);
            if (const double span = knot(i + p + 1) - knot(i + 1); span > 0.0)
              add(k + 1, (knot(i + p + 1) - cell) / span, -1.0 / span);
          }
          n = next;
        }
        coefficients.push_back(n);
      }
    }
  };

  static Weights<support> evaluate(const Axis& axis, double x) {
    const double u = x * axis.inverse_h;
    const int cell = static_cast<int>(u);
    const double t = u - cell;
    const auto& c = axis.coefficients[static_cast<std::size_t>(cell)];
    Weights<support> out;
    out.first = cell;
    for (int k = 0; k < support; ++k) {
      double value = c[k][P], slope = 0.0;
      for (int j = P - 1; j >= 0; --j) {
        slope = slope * t + value;
        value = value * t + c[k][j];
      }
      out.w[k] = value;
      out.dw[k] = slope * axis.inverse_h;
      out.xi[k] = axis.node_position[static_cast<std::size_t>(cell + k)] - x;
    }
    return out;
  }
};

/// Linear hats averaged over the width 2 l of an undeformed point domain: uGIMP [Bardenhagen2004]. A domain that
/// would cross an end of the axis is cut there, so that no function reaches beyond a wall.
struct Gimp {
  static constexpr int degree = 1;
  static constexpr int support = 3;

  struct Axis {
    double h, inverse_h, half_size;
    int cells, nodes;
    std::vector<double> node_position;

    Axis(int cell_count, double spacing, double point_size)
        : h(spacing), inverse_h(1.0 / spacing), half_size(0.5 * point_size), cells(cell_count), nodes(std::max(cell_count + 1, support)) {
      for (int i = 0; i < nodes; ++i) node_position.push_back(i * h);
    }
  };

  static Weights<support> evaluate(const Axis& axis, double x) {
    const double end = axis.cells * axis.h;
    const double l = std::min({axis.half_size, x, end - x});  // the domain stays centred on the point
    const double a = x - l, b = x + l;
    // Three nodes from the cell that holds the domain's left end reach it all (2 l <= h).
    const int first = std::min(static_cast<int>(a * axis.inverse_h), std::max(axis.cells - 2, 0));
    Weights<support> out;
    out.first = first;
    const double width = b - a;
    for (int k = 0; k < support; ++k) {
      const double node = (first + k) * axis.h;
      out.xi[k] = node - x;
      if (width > 1e-9 * axis.h) {
        // mean and slope of the hat over [a, b]: differences of its integral and of itself
        out.w[k] = (integral(axis, b - node) - integral(axis, a - node)) / width;
        out.dw[k] = (hat(axis, b - node) - hat(axis, a - node)) / width;
      } else {
        out.w[k] = hat(axis, x - node);
        out.dw[k] = (std::abs(x - node) < axis.h ? (x < node || (k == 0 && x == node) ? 1.0 : -1.0) : 0.0) *
                    axis.inverse_h;
      }
    }
    return out;
  }

 private:
  static double hat(const Axis& axis, double r) { return std::max(0.0, 1.0 - std::abs(r) * axis.inverse_h); }
  static double integral(const Axis& axis, double r) {  // of the hat, from -h to r [m]
    const double s = std::clamp(r * axis.inverse_h, -1.0, 1.0);
    return axis.h * (s < 0.0 ? 0.5 * (1.0 + s) * (1.0 + s) : 0.5 + s - 0.5 * s * s);
  }
};

}  // namespace grainpair
