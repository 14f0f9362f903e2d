// Shape functions on one axis; the grid's are their tensor products.
//
// A policy gives: `support`, the number of nodes that share a point; `reach`, of those that share
// any point of a cell; an Axis built for [0, n h]; and evaluate(axis, x, weights), of one point
// (Real = double) or of several at once (Real = Wide). Positions of the nodes are such that sum_i
// w_i X_i = x everywhere (linear completeness), which the affine transfers and the patch test rely
// on.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "mpm/numbers/rows.hpp"

namespace grainpair {

/// The `Support` functions that reach one point.
template <class Real, int Support>
struct Weights {
  static constexpr int support = Support;
  using First = std::conditional_t<std::is_same_v<Real, WideFloat>, Halves<Real>, Real>;
  First first;  // number of the first node
  std::array<Real, Support> w, dw,
      moment;  // value [-], slope [1/m], value times (node's position - point's) [m]
  Real inertia, inverse_inertia;  // D = sum_k w_k (X_k - x)^2, kept away from zero [m2]; 1/D [1/m2]

  void set(int k, const Real& value, const Real& slope, const Real& xi) {
    w[k] = value, dw[k] = slope, moment[k] = value * xi;
    inertia += moment[k] * xi;
  }
  void invert(double h) {
    inertia = larger(inertia, constant<Real>(1e-12 * h * h));
    inverse_inertia = 1 / inertia;
  }
};

/// An axis of the grid, [0, n h], and the nodes along it.
struct GridAxis {
  double h = 0.0, inverse_h = 0.0;
  int cells = 0, nodes = 0;
  std::vector<double> node_position;  // [m]

  GridAxis() = default;
  GridAxis(int cell_count, double spacing, int node_count)
      : h(spacing), inverse_h(1.0 / spacing), cells(cell_count), nodes(node_count) {}
};

/// Open uniform B-splines of degree P: knots on the cell faces, P + 1 of them on either end. The
/// end function is therefore interpolatory: a wall on a cell face is one layer of nodes, exactly,
/// and no function reaches beyond it. P = 1 is the linear hat, P = 2 the quadratic and P = 3 the
/// cubic B-spline [Steffen2008].
template <int P>
struct BSpline {
  static constexpr int degree = P;
  static constexpr int support = P + 1;
  static constexpr int reach = support;  // nodes that the points of one cell share

  template <class Real>
  struct Cell {
    std::array<std::array<Real, P + 1>, support> c;  // w_k = sum_j c_kj t^j
    std::array<Real, support> node;                  // position [m]
  };

  struct Axis : GridAxis {  // nodes at the Greville abscissae
    std::vector<Cell<double>> cell_table;

    Axis(int cell_count, double spacing, double /*point_size*/)
        : GridAxis(cell_count, spacing, cell_count + P) {
      const auto knot = [&](int i) { return std::clamp(i - P, 0, cells); };  // in cells
      for (int i = 0; i < nodes; ++i) {
        double sum = 0.0;
        for (int j = 1; j <= P; ++j) sum += knot(i + j);
        node_position.push_back(h * sum / P);
      }
      // Cox-de Boor on polynomials in t = x/h - cell, one cell at a time.
      for (int cell = 0; cell < cells; ++cell) {
        decltype(Cell<double>::c) n{};
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
            // N_i^p = (x - u_i)/(u_{i+p} - u_i) N_i^{p-1} + (u_{i+p+1} - x)/(u_{i+p+1} - u_{i+1})
            // N_{i+1}^{p-1}
            if (const double span = knot(i + p) - knot(i); span > 0.0)
              add(k, (cell - knot(i)) / span, 1.0 / span);
            if (const double span = knot(i + p + 1) - knot(i + 1); span > 0.0)
              add(k + 1, (knot(i + p + 1) - cell) / span, -1.0 / span);
          }
          n = next;
        }
        Cell<double> entry{.c = n, .node = {}};
        for (int k = 0; k < support; ++k)
          entry.node[k] = node_position[static_cast<std::size_t>(cell) + k];
        cell_table.push_back(entry);
      }
    }
  };

  template <class Real>
  static void evaluate(const Axis& axis, const Real& x, Weights<Real, support>& out) {
    const Real u = x * axis.inverse_h, cell = trunc(u), t = u - cell;
    out.inertia = 0.0;
    out.first = cell;
    if (inside(axis, cell)) return evaluate_inside(axis, t, out);
    const auto here = look_up<Cell>(axis.cell_table.data(), index_below(cell));
    for (int k = 0; k < support; ++k) {
      Real value = here.c[k][P], slope = 0.0;
      for (int j = P - 1; j >= 0; --j) {
        slope = slope * t + value;
        value = value * t + here.c[k][j];
      }
      out.set(k, value, axis.inverse_h * slope, here.node[k] - x);
    }
    out.invert(axis.h);
  }

  /// In single precision, but for the places; beside the ends narrowed at last.
  static void evaluate(const Axis& axis, const Halves<WideFloat>& x,
                       Weights<WideFloat, support>& out) {
    Halves<WideFloat> t;
    bool all_inside = true;
    for (std::size_t h = 0; h < t.size(); ++h) {
      const Wide u = x[h] * axis.inverse_h;
      out.first[h] = trunc(u);
      t[h] = u - out.first[h];
      all_inside = all_inside && inside(axis, out.first[h]);
    }
    if (all_inside) return evaluate_inside(axis, merge(t), out);
    std::array<Weights<Wide, support>, 2> half;
    for (std::size_t h = 0; h < 2; ++h) evaluate(axis, x[h], half[h]);
    const auto both = [&](auto number) {
      return merge(std::array{number(half[0]), number(half[1])});
    };
    for (std::size_t k = 0; k < support; ++k) {
      out.w[k] = both([&](const auto& n) { return n.w[k]; });
      out.dw[k] = both([&](const auto& n) { return n.dw[k]; });
      out.moment[k] = both([&](const auto& n) { return n.moment[k]; });
    }
    out.inertia = both([](const auto& n) { return n.inertia; });
    out.inverse_inertia = both([](const auto& n) { return n.inverse_inertia; });
  }

 private:
  /// From P - 1 cells off the ends on, all cells are alike.
  template <class Real>
  static bool inside(const Axis& axis, const Real& cell) {
    return all(cell >= P - 1.0) && all(cell <= axis.cells - 1.0 * P);
  }
  template <class Real>
  static void evaluate_inside(const Axis& axis, const Real& t, Weights<Real, support>& out) {
    const auto number = constant<Real>;
    const Real h = number(axis.h), inverse_h = number(axis.inverse_h), s = 1 - t;
    const auto set = [&](int k, const Real& value, const Real& slope) {
      out.set(k, value, inverse_h * slope, h * (number(k - 0.5 * (P - 1)) - t));
    };
    out.inertia = number(0.0);
    if constexpr (P == 1) {
      set(0, s, number(-1.0)), set(1, t, number(1.0));
    } else if constexpr (P == 2) {
      set(0, number(0.5) * s * s, -s), set(1, number(0.5) + s * t, s - t),
          set(2, number(0.5) * t * t, t);
    } else {
      static_assert(P == 3);
      const Real ss = s * s, tt = t * t, half = number(0.5), most = number(2.0 / 3.0),
                 steep = number(1.5), sixth = number(1.0 / 6.0);
      set(0, ss * s * sixth, -half * ss), set(1, most - tt * (1 - half * t), t * (steep * t - 2));
      set(2, most - ss * (1 - half * s), -s * (steep * s - 2)), set(3, tt * t * sixth, half * tt);
    }
    if constexpr (P == 2)
      out.inertia = number(0.25 * axis.h * axis.h),
      out.inverse_inertia = number(4.0 * axis.inverse_h * axis.inverse_h);
    else
      out.invert(axis.h);
  }
};

/// Linear hats averaged over the width 2 l of an undeformed point domain: uGIMP [Bardenhagen2004].
/// A domain that would cross an end of the axis is cut there, so that no function reaches beyond a
/// wall.
struct Gimp {
  static constexpr int degree = 1;
  static constexpr int support = 3;
  static constexpr int reach = 4;

  struct Axis : GridAxis {
    double half_size;  // [m]

    Axis(int cell_count, double spacing, double point_size)
        : GridAxis(cell_count, spacing, std::max(cell_count + 1, support)),
          half_size(0.5 * point_size) {
      for (int i = 0; i < nodes; ++i) node_position.push_back(i * h);
    }
  };

  template <class Real>
  static void evaluate(const Axis& axis, const Real& x, Weights<Real, support>& out) {
    const double end = axis.cells * axis.h;
    const Real l = smaller(Real(axis.half_size),
                           smaller(x, end - x));  // the domain stays centred on the point
    const Real a = x - l, b = x + l, width = b - a;
    // Three nodes from the cell that holds the domain's left end reach it all (2 l <= h).
    const Real first = smaller(trunc(a * axis.inverse_h), Real(std::max(axis.cells - 2, 0)));
    const auto wide = width > 1e-9 * axis.h;
    out.inertia = 0.0;
    out.first = first;
    for (int k = 0; k < support; ++k) {
      const Real node = (first + k) * axis.h, r = x - node;
      // mean and slope of the hat over [a, b]: differences of its integral and of itself
      const Real mean = (integral(axis, b - node) - integral(axis, a - node)) / width;
      const Real slope = (hat(axis, b - node) - hat(axis, a - node)) / width;
      const Real rise =
          select(k == 0 ? r <= 0.0 : r < 0.0, Real(axis.inverse_h), Real(-axis.inverse_h));
      out.set(k, select(wide, mean, hat(axis, r)),
              select(wide, slope, select(abs(r) < axis.h, rise, Real(0.0))), node - x);
    }
    out.invert(axis.h);
  }

 private:
  template <class Real>
  static Real hat(const Axis& axis, const Real& r) {
    return larger(Real(0.0), 1.0 - abs(r) * axis.inverse_h);
  }
  template <class Real>
  static Real integral(const Axis& axis, const Real& r) {  // of the hat, from -h to r [m]
    const Real s = clamped(r * axis.inverse_h, -1.0, 1.0);
    return axis.h * select(s < 0.0, 0.5 * (1.0 + s) * (1.0 + s), 0.5 + s - 0.5 * s * s);
  }
};

}  // namespace grainpair
