// Coarse graining on a grid of D dimensions; compiled for each of them in a unit of its own
// (coarse_grain.cpp.in).
#pragma once

#include <Eigen/Cholesky>
#include <limits>

#include "compare/mapping/field_maps.hpp"
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
};

/// What a fit about one cell is made from, one row per point: weight, position relative to the
/// cell, and the vector that is fitted. Columns are contiguous, so that sums over the points run in
/// vectors.
template <int D>
struct Samples {
  Eigen::ArrayXd w;
  Eigen::Matrix<double, Eigen::Dynamic, D> x;
  Eigen::Matrix<double, Eigen::Dynamic, 3> v;
};

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
  fit.variance = (w * u.rowwise().squaredNorm().array()).sum() / freedom;
  return fit;
}

template <int D>
class Mapper : private FieldMaps {
 public:
  Mapper(const Cloud& cloud, const SampleGrid<D>& grid, const Grain& grain)
      : FieldMaps(cloud, grain, grid.size()), grid_(grid) {}

  Fields run(const KernelSums& sums) {
    const Stencils& points = sums.points;
    map_mass_and_motion(points);
    map_two_step(points, sums.fluctuation);
    if (!cloud_.spin.empty()) map_rotation(points);
    if (cloud_.has_contacts) map_contacts(sums);
    if (!cloud_.stress.empty()) map_state(points);
    map_derived();
    return out_.take();
  }

 private:
  using Point = typename SampleGrid<D>::Point;

  /// The points about cell k with their `inertia` times weight and their `motion`; valid until the
  /// thread asks again.
  const Samples<D>& samples(const Stencils& points, std::size_t k,
                            const std::vector<double>& inertia,
                            const std::vector<Vec3>& motion) const {
    thread_local Samples<D> out;
    Point r;
    for (std::size_t a = 0, rest = k; a < D; ++a) {
      const auto n = static_cast<std::size_t>(grid_.cells[a]);
      r[a] = grid_.centre(static_cast<int>(a), static_cast<int>(rest % n));
      rest /= n;
    }
    const auto row = points.of_cell(k);
    const auto count = static_cast<Eigen::Index>(row.size());
    out.w.resize(count), out.x.resize(count, D), out.v.resize(count, 3);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Weight& e = row[static_cast<std::size_t>(i)];
      out.w[i] = inertia[e.item] * e.value;
      const Point x = grid_.project(cloud_.x[e.item]) - r;
      for (int a = 0; a < D; ++a)
        out.x(i, a) =
            x[a] - e.image[static_cast<std::size_t>(a)] * grid_.cells[a] * grid_.spacing[a];
      for (int a = 0; a < 3; ++a) out.v(i, a) = motion[e.item][a];
    }
    return out;
  }

  void map_mass_and_motion(const Stencils& points) {
    double* phi_s = out_.add("solid_fraction", "-", 1, "volume of solid per volume, sum V phi");
    double* e = out_.add("void_ratio", "-", 1, "(1 - solid_fraction) / solid_fraction");
    density_ = out_.add("density", "kg/m3", 1, "mass per volume, sum m phi");
    double* momentum = out_.add("momentum", "kg/(m2 s)", 3, "momentum per volume, sum m v phi");
    double* velocity = out_.add("velocity", "m/s", 3, "momentum / density");
    gradient_ = out_.add("velocity_gradient", "1/s", 9,
                         "dv_i/dx_j of the weighted affine fit; zero across the depth");
    kinetic_ = out_.add("kinetic_stress", "Pa", 9,
                        "sum m v' v' phi with v' = v - velocity, compression positive");
    double* one = out_.add("granular_temperature_one_step", "m2/s2", 1,
                           "trace of kinetic_stress / (3 density), uncorrected: holds the velocity "
                           "gradient's w^2 G:G/3");
    double* T = out_.add(
        "granular_temperature", "m2/s2", 1,
        "mean square fluctuation per component about the affine fit, corrected for self-inclusion");
    double* number = out_.add("effective_number", "-", 1,
                              "(sum m phi)^2 / sum (m phi)^2: points an average rests on");

    out_.for_cells([&](std::size_t k) {
      for (const auto& weight : points.of_cell(k))
        phi_s[k] += cloud_.solid_volume[weight.item] * weight.value;
      e[k] = phi_s[k] > 0.0 ? (1.0 - phi_s[k]) / phi_s[k] : nan;
      const auto& near = samples(points, k, cloud_.mass, cloud_.v);
      const double rho = near.w.sum(), rho2 = near.w.square().sum();
      const Vec3 rho_v = near.w.matrix().transpose().lazyProduct(near.v).transpose();
      density_[k] = rho;
      put(momentum, k, rho_v);
      const Vec3 V = rho > 0.0 ? Vec3(rho_v / rho) : Vec3::Constant(nan);
      put(velocity, k, V);
      number[k] = rho2 > 0.0 ? rho * rho / rho2 : 0.0;

      const Eigen::Matrix<double, Eigen::Dynamic, 3> u = near.v.rowwise() - V.transpose(),
                                                     wu = u.array().colwise() * near.w;
      const Mat3 sigma_k = near.w.size() ? Mat3(wu.transpose().lazyProduct(u)) : Mat3::Zero();
      put(kinetic_, k, sigma_k);
      one[k] = rho > 0.0 ? sigma_k.trace() / (3.0 * rho) : nan;

      const auto fit = affine_fit<D>(near);
      T[k] = fit.variance / 3.0;
      Mat3 L = Mat3::Zero();
      for (int a = 0; a < D; ++a) L.col(SampleGrid<D>::direction(a)) = fit.gradient.col(a);
      put(gradient_, k, L);
    });
  }

  void map_rotation(const Stencils& points) {
    double* T = out_.add(
        "rotational_temperature", "m2/s2", 1,
        "sum I |w'|^2 phi / (3 sum m phi), w' about the affine fit, corrected for self-inclusion");
    out_.for_cells([&](std::size_t k) {
      const auto& near = samples(points, k, cloud_.inertia, cloud_.spin);
      const double inertia = near.w.sum();
      const auto fit = affine_fit<D>(near);
      T[k] = density_[k] > 0.0 ? fit.variance * inertia / (3.0 * density_[k]) : nan;
    });
  }

  void map_contacts(const KernelSums& sums) {
    const auto& [points, fluctuation, along, at] = sums;
    stress_ = out_.add("contact_stress", "Pa", 9,
                       "sum f (x) branch psi, psi the exact line integral of the kernel");
    double* t = out_.add("interaction_force_density", "N/m3", 3,
                         "sum over wall and glued-grain contacts of f phi");
    double* F = out_.add("fabric", "-", 9,
                         "psi-weighted mean of n (x) n over contacts, n the branch's direction");
    double* Z =
        out_.add("coordination", "-", 1, "mean number of contacts per grain, walls included");
    double* power = cloud_.has_dissipation ? out_.add("dissipation_density", "W/m3", 1,
                                                      "power dissipated at contacts, sum P phi")
                                           : nullptr;

    out_.for_cells([&](std::size_t k) {
      put(stress_, k, Mat3(Eigen::Map<const Mat3>(along[k].data())));
      put(F, k,
          along[k][18] > 0.0 ? Mat3(Eigen::Map<const Mat3>(along[k].data() + 9) / along[k][18])
                             : Mat3::Constant(nan));
      put(t, k, Vec3(at[k].head<3>()));
      if (power) power[k] = at[k][3];

      double z = 0.0, n = 0.0;
      for (const auto& w : points.of_cell(k))
        z += w.value * cloud_.contact_number[w.item], n += w.value;
      Z[k] = n > 0.0 ? z / n : nan;
    });
    add_kinetic_ = true;
  }

  const SampleGrid<D>& grid_;
};

}  // namespace grainpair
