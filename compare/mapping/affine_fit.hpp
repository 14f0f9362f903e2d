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

/// N columns, contiguous, so that sums over the points run in vectors.
template <int N>
using Columns = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, N>>;

/// Room for columns, kept from one cell to the next. Aligned, since Eigen sums what lies on a
/// packet's boundary in another order than what does not.
template <int N>
class Room {
 public:
  Columns<N> of(Eigen::Index rows) {
    const auto size = static_cast<std::size_t>(N * rows);
    if (values_.size() < size) values_.resize(2 * size);
    return {values_.data(), rows, N};
  }

 private:
  std::vector<double, Eigen::aligned_allocator<double>> values_;
};

/// What a fit about one cell is made from, one row per point: weight, position relative to the
/// cell, and the vector that is fitted.
template <int D>
struct Samples {
  Columns<1> weight;
  Columns<D> x;
  Columns<3> v;
  Columns<1> number;  // weight of the point itself, phi; empty unless it is asked for

  auto w() const { return weight.array(); }
};

/// Weighted squares of what is left of the vectors beside their mean: sum w (v - mean) (v - mean).
template <int D>
Mat3 spread(const Samples<D>& samples, const Vec3& mean) {
  Mat3 out;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b <= a; ++b)
      out(a, b) = out(b, a) = (samples.w() * (samples.v.col(a).array() - mean[a]) *
                               (samples.v.col(b).array() - mean[b]))
                                  .sum();
  return out;
}

/// The points about cell k of the part of the grid with their `inertia` times weight and their
/// `motion`; valid until the thread asks again.
template <int D>
Samples<D> gather(const SampleGrid<D>& grid, const Cloud& cloud, const Stencils& points,
                  std::size_t k, const std::vector<double>& inertia,
                  const std::vector<Vec3>& motion, bool numbers = false) {
  using Point = typename SampleGrid<D>::Point;
  thread_local Room<1> weights, own;
  thread_local Room<D> places;
  thread_local Room<3> vectors;
  Point r, period;
  std::size_t rest = k;
  for (int a = 0; a < D; ++a) {
    const auto n = static_cast<std::size_t>(grid.count(a));
    r[a] = grid.centre(a, grid.first(a) + static_cast<int>(rest % n));
    period[a] = grid.cells[static_cast<std::size_t>(a)] * grid.spacing[a];
    rest /= n;
  }
  const auto row = points.of_cell(k);
  const auto count = static_cast<Eigen::Index>(row.size());
  Samples<D> out{weights.of(count), places.of(count), vectors.of(count),
                 own.of(numbers ? count : 0)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Weight& e = row[static_cast<std::size_t>(i)];
    out.weight[i] = inertia[e.item] * e.value;
    if (numbers) out.number[i] = e.value;
    const Point x = grid.project(cloud.x[e.item]) - r;
    for (int a = 0; a < D; ++a)
      out.x(i, a) = x[a] - e.image[static_cast<std::size_t>(a)] * period[a];
    for (int a = 0; a < 3; ++a) out.v(i, a) = motion[e.item][a];
  }
  return out;
}

/// Mean square of the residuals r of a fit with every point counted by its number weight n instead
/// of w: sum n r^2 and what it holds of independent fluctuations of variance s2,
///   sum n_i (1 - 2 h_ii + sum_j h_ij^2),   h_ij = w_j X_i^T A^-1 X_j,
/// h_ij being the share of point j in what the fit says at point i.
template <int D>
void by_number(const Samples<D>& samples, const Columns<D>& X, const Columns<3>& r,
               const Eigen::LLT<Eigen::Matrix<double, D, D>>& A, double S, AffineFit<D>& fit) {
  const Eigen::ArrayXd w2 = samples.w().square();
  const double b = w2.sum();
  const Eigen::Matrix<double, D, 1> bx = X.transpose().lazyProduct(w2.matrix());
  const Eigen::Matrix<double, D, D> B =
      X.transpose().lazyProduct((X.array().colwise() * w2).matrix());
  for (Eigen::Index i = 0; i < samples.weight.size(); ++i) {
    const Eigen::Matrix<double, D, 1> x = X.row(i).transpose(), y = A.solve(x);
    const double own = samples.weight[i] * (1.0 / S + x.dot(y));
    const double all = b / (S * S) + 2.0 * bx.dot(y) / S + y.dot(B * y);
    fit.residual_by_number += samples.number[i] * r.row(i).squaredNorm();
    fit.freedom_by_number += samples.number[i] * (1.0 - 2.0 * own + all);
  }
}

/// Whether points whose second moments these are span all D directions.
template <int D>
bool spans_all(const Eigen::LLT<Eigen::Matrix<double, D, D>>& factors, double trace) {
  const auto pivots = factors.matrixLLT().diagonal().array().square();
  return factors.info() == Eigen::Success && pivots.minCoeff() > 1e-6 * trace;
}

/// For independent fluctuations of variance s2 per component the weighted residual sum of squares
/// has the mean
///   s2 (S - tr(A^-1 B)),   S = sum w,  A = sum w X X^T,  B = sum w^2 X X^T,  X = (1, x - xbar),
/// so dividing by S - tr(A^-1 B) instead of S removes the self-inclusion bias, and the fit removes
/// the velocity gradient's w^2 G:G. Where the points do not span D directions no fit exists and the
/// result stays NaN.
template <int D>
AffineFit<D> affine_fit(const Samples<D>& samples) {
  thread_local Room<D> room, weighted;
  thread_local Room<3> deviations;
  const auto w = samples.w();
  const Eigen::Index n = samples.weight.size();
  AffineFit<D> fit;
  const double S = w.sum();
  if (!(S > 0.0)) return fit;
  const Eigen::Matrix<double, 1, D> xbar = samples.weight.transpose().lazyProduct(samples.x) / S;
  const Eigen::RowVector3d U = samples.weight.transpose().lazyProduct(samples.v) / S;
  fit.mean = U;

  Columns<D> X = room.of(n), wX = weighted.of(n);
  Columns<3> u = deviations.of(n);
  X = samples.x.rowwise() - xbar;
  wX = X.array().colwise() * w;
  u = samples.v.rowwise() - U;
  const Eigen::Matrix<double, D, D> A = wX.transpose().lazyProduct(X),
                                    B = wX.transpose().lazyProduct(wX);
  const Eigen::Matrix<double, D, 3> K = wX.transpose().lazyProduct(u);
  const Eigen::LLT<Eigen::Matrix<double, D, D>> factors(A);
  if (!spans_all<D>(factors, A.trace())) return fit;
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
