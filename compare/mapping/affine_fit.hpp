// The weighted affine fit that velocity gradient and granular temperature rest on.
#pragma once

#include <Eigen/Cholesky>
#include <limits>

#include "compare/mapping/cloud.hpp"
#include "compare/mapping/stencil.hpp"

namespace grainpair {

/// Weighted affine fit u ~ U + G (x - xbar) of a vector carried by points about one cell, and what
/// it leaves over.
template <int D>
struct AffineFit {
  using Point = Eigen::Matrix<double, D, 1>;
  Vec3 mean = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());  // U
  Eigen::Matrix<double, 3, D> gradient =
      Eigen::Matrix<double, 3, D>::Constant(std::numeric_limits<double>::quiet_NaN());  // G
  double variance =
      std::numeric_limits<double>::quiet_NaN();  // weighted mean square of the residual, unbiased;
                                                 // sum over the three components
  // The variance as a quotient, and the same with every point counted by its number; zero where
  // there is none.
  double residual = 0.0, freedom = 0.0, residual_by_number = 0.0, freedom_by_number = 0.0;
};

/// What a fit about one cell is made from, one row per point: weight, position relative to the
/// cell, and the vector that is fitted. Columns are contiguous, so that sums over the points run in
/// vectors.
template <int D>
struct Samples {
  Eigen::ArrayXd w;
  Eigen::Matrix<double, Eigen::Dynamic, D> x;
  Eigen::Matrix<double, Eigen::Dynamic, 3> v;
  Eigen::ArrayXd number;  // weight of the point itself, phi; empty unless it is asked for
};

/// The points about cell k of the part of the grid with their `inertia` times weight and their
/// `motion`; valid until the thread asks again.
template <int D>
const Samples<D>& gather(const SampleGrid<D>& grid, const Cloud& cloud, const Stencils& points,
                         std::size_t k, const std::vector<double>& inertia,
                         const std::vector<Vec3>& motion, bool numbers = false) {
  using Point = typename SampleGrid<D>::Point;
  thread_local Samples<D> out;
  Point r;
  std::size_t rest = k;
  for (int a = 0; a < D; ++a) {
    const auto n = static_cast<std::size_t>(grid.count(a));
    r[a] = grid.centre(a, grid.first(a) + static_cast<int>(rest % n));
    rest /= n;
  }
  const auto row = points.of_cell(k);
  const auto count = static_cast<Eigen::Index>(row.size());
  out.w.resize(count), out.x.resize(count, D), out.v.resize(count, 3);
  out.number.resize(numbers ? count : 0);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Weight& e = row[static_cast<std::size_t>(i)];
    out.w[i] = inertia[e.item] * e.value;
    if (numbers) out.number[i] = e.value;
    const Point x = grid.project(cloud.x[e.item]) - r;
    for (int a = 0; a < D; ++a)
      out.x(i, a) = x[a] - e.image[static_cast<std::size_t>(a)] *
                               grid.cells[static_cast<std::size_t>(a)] * grid.spacing[a];
    for (int a = 0; a < 3; ++a) out.v(i, a) = motion[e.item][a];
  }
  return out;
}

/// Mean square of the residuals r of a fit with every point counted by its number weight n instead
/// of w: sum n r^2 and what it holds of independent fluctuations of variance s2,
///   sum n_i (1 - 2 h_ii + sum_j h_ij^2),   h_ij = w_j X_i^T A^-1 X_j,
/// h_ij being the share of point j in what the fit says at point i.
template <int D>
void by_number(const Samples<D>& samples, const Eigen::Matrix<double, Eigen::Dynamic, D>& X,
               const Eigen::Matrix<double, Eigen::Dynamic, 3>& r,
               const Eigen::LLT<Eigen::Matrix<double, D, D>>& A, double S, AffineFit<D>& fit) {
  const Eigen::ArrayXd w2 = samples.w.square();
  const double b = w2.sum();
  const Eigen::Matrix<double, D, 1> bx = X.transpose().lazyProduct(w2.matrix());
  const Eigen::Matrix<double, D, D> B =
      X.transpose().lazyProduct((X.array().colwise() * w2).matrix());
  for (Eigen::Index i = 0; i < samples.w.size(); ++i) {
    const Eigen::Matrix<double, D, 1> x = X.row(i).transpose(), y = A.solve(x);
    const double own = samples.w[i] * (1.0 / S + x.dot(y));
    const double all = b / (S * S) + 2.0 * bx.dot(y) / S + y.dot(B * y);
    fit.residual_by_number += samples.number[i] * r.row(i).squaredNorm();
    fit.freedom_by_number += samples.number[i] * (1.0 - 2.0 * own + all);
  }
}

/// For independent fluctuations of variance s2 per component the weighted residual sum of squares
/// has the mean
///   s2 (S - tr(A^-1 B)),   S = sum w,  A = sum w X X^T,  B = sum w^2 X X^T,  X = (1, x - xbar),
/// so dividing by S - tr(A^-1 B) instead of S removes the self-inclusion bias, and the fit removes
/// the velocity gradient's w^2 G:G. Where the points do not span D directions no fit exists and the
/// result stays NaN.
template <int D>
AffineFit<D> affine_fit(const Samples<D>& samples) {
  const auto& w = samples.w;
  AffineFit<D> fit;
  const double S = w.sum();
  if (!(S > 0.0)) return fit;
  const Eigen::Matrix<double, 1, D> xbar = w.matrix().transpose().lazyProduct(samples.x) / S;
  const Eigen::RowVector3d U = w.matrix().transpose().lazyProduct(samples.v) / S;
  fit.mean = U;

  const Eigen::Matrix<double, Eigen::Dynamic, D> X = samples.x.rowwise() - xbar,
                                                 wX = X.array().colwise() * w;
  Eigen::Matrix<double, Eigen::Dynamic, 3> u = samples.v.rowwise() - U;
  const Eigen::Matrix<double, D, D> A = wX.transpose().lazyProduct(X),
                                    B = wX.transpose().lazyProduct(wX);
  const Eigen::Matrix<double, D, 3> K = wX.transpose().lazyProduct(u);
  const Eigen::LLT<Eigen::Matrix<double, D, D>> factors(A);
  const auto pivots = factors.matrixLLT().diagonal().array().square();
  if (factors.info() != Eigen::Success || !(pivots.minCoeff() > 1e-6 * A.trace())) return fit;
  const Eigen::Matrix<double, D, 3> G = factors.solve(K);
  fit.gradient = G.transpose();

  const double freedom = S - w.square().sum() / S - factors.solve(B).trace();
  if (freedom < 0.05 * S) return fit;  // fewer independent points than the fit has constants
  u -= X.lazyProduct(G);
  fit.freedom = freedom;
  fit.residual = (w * u.rowwise().squaredNorm().array()).sum();
  fit.variance = fit.residual / freedom;
  if (samples.number.size() > 0) by_number<D>(samples, X, u, factors, S, fit);
  return fit;
}

}  // namespace grainpair
