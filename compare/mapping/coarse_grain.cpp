#include "compare/mapping/coarse_grain.hpp"

#include <Eigen/Cholesky>
#include <limits>

#include "compare/mapping/cell_list.hpp"
#include "compare/mapping/stencil.hpp"

namespace grainpair {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
using RowMat3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// The fields under construction; `data(name)` stays valid while more are added.
class Builder {
 public:
  explicit Builder(std::size_t cells) : cells_(cells) { fields_.list.reserve(64); }

  double* add(const char* name, const char* unit, int components, const char* doc) {
    fields_.list.push_back(
        {name, unit, doc, components,
         std::vector<double>(cells_ * static_cast<std::size_t>(components), 0.0)});
    return fields_.list.back().values.data();
  }
  template <class PerCell>
  void for_cells(PerCell per_cell) const {
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t k = 0; k < cells_; ++k) per_cell(k);
  }
  Fields take() { return std::move(fields_); }

 private:
  std::size_t cells_;
  Fields fields_;
};

void put(double* field, std::size_t k, const Vec3& a) { Eigen::Map<Vec3>(field + 3 * k) = a; }
void put(double* field, std::size_t k, const Mat3& a) { Eigen::Map<RowMat3>(field + 9 * k) = a; }
Mat3 tensor(const double* field, std::size_t k) { return Eigen::Map<const RowMat3>(field + 9 * k); }

/// Weighted affine fit u ~ U + G (x - xbar) of a vector carried by points about one cell, and what
/// it leaves over.
template <int D>
struct AffineFit {
  using Point = Eigen::Matrix<double, D, 1>;
  Vec3 mean = Vec3::Constant(nan);                                                    // U
  Eigen::Matrix<double, 3, D> gradient = Eigen::Matrix<double, 3, D>::Constant(nan);  // G
  double variance =
      nan;  // weighted mean square of the residual, unbiased; sum over the three components
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

/// Squared fluctuation |v_i - V(r_i)|^2 / c_i of every point, V smoothed with the same kernel at
/// the point itself, and
///   c_i = 1 - 2 w_ii/S_i + sum_j w_ij^2/S_i^2,   w_ij = m_j phi_ij,  S_i = sum_j w_ij,
/// what that difference keeps of independent fluctuations, V containing v_i itself. NaN for a point
/// on its own.
template <int D, class K>
std::vector<double> two_step_fluctuation(const Cloud& cloud, const SampleGrid<D>& grid,
                                         const K& kernel) {
  const CellList<D> cells(cloud.x, grid, kernel.cutoff());
  const auto& order = cells.order();
  std::vector<double> mass;
  std::array<std::vector<double>, 3> v;
  for (const std::size_t p : order) {
    mass.push_back(cloud.mass[p]);
    for (std::size_t a = 0; a < 3; ++a) v[a].push_back(cloud.v[p][static_cast<Eigen::Index>(a)]);
  }
  std::vector<double> out(cloud.size(), nan);
  const double c2 = kernel.cutoff() * kernel.cutoff();
#pragma omp parallel for schedule(dynamic, 256)
  for (std::size_t i = 0; i < order.size(); ++i) {
    double S = 0.0, S2 = 0.0, Vx = 0.0, Vy = 0.0, Vz = 0.0;
    const K phi = kernel;
    cells.runs(i, [&](const auto& r, std::size_t begin, std::size_t end) {
      std::array<const double*, D> x;
      for (int a = 0; a < D; ++a) x[a] = cells.coordinate(a).data();
      const double *m = mass.data(), *vx = v[0].data(), *vy = v[1].data(), *vz = v[2].data();
#pragma omp simd reduction(+ : S, S2, Vx, Vy, Vz)
      for (std::size_t j = begin; j < end; ++j) {
        double r2 = 0.0;
        for (int a = 0; a < D; ++a) r2 += (x[a][j] - r[a]) * (x[a][j] - r[a]);
        const bool inside = r2 < c2;
        const double value = m[j] * phi.at(inside ? r2 : c2), w = inside ? value : 0.0;
        S += w, S2 += w * w, Vx += w * vx[j], Vy += w * vy[j], Vz += w * vz[j];
      }
    });
    const double c = 1.0 - 2.0 * mass[i] * kernel.at(0.0) / S + S2 / (S * S);
    const Vec3 V(Vx / S, Vy / S, Vz / S);
    if (c > 0.05) out[order[i]] = (cloud.v[order[i]] - V).squaredNorm() / c;
  }
  return out;
}

template <int D>
class Mapper {
 public:
  Mapper(const Cloud& cloud, const SampleGrid<D>& grid, const Grain& grain)
      : cloud_(cloud), grid_(grid), grain_(grain), out_(grid.size()) {}

  template <class K>
  Fields run(const K& kernel) {
    const Stencils points =
        make_stencils(grid_, cloud_.size(),
                      place_points(grid_, kernel, [&](std::size_t p) { return cloud_.x[p]; }));
    map_mass_and_motion(points);
    map_two_step(points, two_step_fluctuation(cloud_, grid_, kernel));
    if (!cloud_.spin.empty()) map_rotation(points);
    if (cloud_.has_contacts) map_contacts(points, kernel);
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

  void map_two_step(const Stencils& points, const std::vector<double>& fluctuation) {
    double* T = out_.add("granular_temperature_two_step", "m2/s2", 1,
                         "mean of |v_i - V(r_i)|^2 / 3, each corrected for self-inclusion");
    out_.for_cells([&](std::size_t k) {
      double sum = 0.0, m = 0.0;
      for (const auto& w : points.of_cell(k)) {
        if (std::isnan(fluctuation[w.item])) continue;
        const double mw = cloud_.mass[w.item] * w.value;
        sum += mw * fluctuation[w.item], m += mw;
      }
      T[k] = m > 0.0 ? sum / (3.0 * m) : nan;
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

  template <class K>
  void map_contacts(const Stencils& points, const K& kernel) {
    const auto& contacts = cloud_.contacts;
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

    // Along the branches: f (x) b, n (x) n, 1. At the contact points: wall force, power.
    const auto along =
        scatter<19>(grid_, contacts.size(), place_branches(grid_, kernel, std::span(contacts)),
                    [&](std::size_t i) {
                      const Contact& c = contacts[i];
                      Eigen::Matrix<double, 19, 1> q = Eigen::Matrix<double, 19, 1>::Zero();
                      const double b2 = c.branch.squaredNorm();
                      Eigen::Map<Mat3>(q.data()) = c.force * c.branch.transpose();
                      if (b2 > 0.0) {
                        Eigen::Map<Mat3>(q.data() + 9) = c.branch * c.branch.transpose() / b2;
                        q[18] = 1.0;
                      }
                      return q;
                    });
    const auto at_point = [&](std::size_t i) { return contacts[i].point; };
    const std::vector<Eigen::Vector4d> at = scatter<4>(
        grid_, contacts.size(), place_points(grid_, kernel, at_point), [&](std::size_t i) {
          const Contact& c = contacts[i];
          const Vec3 wall = c.wall ? c.force : Vec3::Zero();
          return Eigen::Vector4d(wall.x(), wall.y(), wall.z(), c.dissipation);
        });
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

  void map_state(const Stencils& points) {
    double* e = out_.add("void_ratio_state", "-", 1,
                         "the points' own void ratio, weighted by solid volume");
    double* T = out_.add("granular_temperature_state", "m2/s2", 1,
                         "the points' own granular temperature, by mass");
    stress_ = out_.add("stress_state", "Pa", 9, "the points' own stress, sum V sigma phi");
    out_.for_cells([&](std::size_t k) {
      double solid = 0.0;
      Mat3 sigma = Mat3::Zero();
      for (const auto& w : points.of_cell(k)) {
        const double vs = cloud_.solid_volume[w.item] * w.value;
        solid += vs, e[k] += vs * cloud_.void_ratio[w.item];
        T[k] += cloud_.mass[w.item] * w.value * cloud_.granular_temperature[w.item];
        sigma += vs * (1.0 + cloud_.void_ratio[w.item]) * to_matrix(cloud_.stress[w.item]);
      }
      e[k] = solid > 0.0 ? e[k] / solid : nan;
      T[k] = density_[k] > 0.0 ? T[k] / density_[k] : nan;
      put(stress_, k, sigma);
    });
  }

  void map_derived() {
    double* D_ = out_.add("strain_rate", "1/s", 9, "-sym(velocity_gradient), compression positive");
    double* rate = out_.add("shear_rate", "1/s", 1, "sqrt(2 dev D : dev D)");
    out_.for_cells([&](std::size_t k) {
      const Mat3 L = tensor(gradient_, k), rate_of_strain = -0.5 * (L + L.transpose());
      put(D_, k, rate_of_strain);
      rate[k] = std::sqrt(2.0) * deviator(from_matrix(rate_of_strain)).norm();
    });
    if (!stress_) return;
    double* p = out_.add("pressure", "Pa", 1,
                         "trace of the stress / 3: contact + kinetic, or the points' own");
    double* q = out_.add("deviatoric_stress", "Pa", 1,
                         "sqrt(3/2 s : s) of the same stress, symmetric part");
    double* eta = out_.add("stress_ratio", "-", 1, "deviatoric_stress / pressure");
    double* I = out_.add("inertial_number", "-", 1, "shear_rate d / sqrt(pressure / rho_s)");
    double* work = out_.add("stress_power", "W/m3", 1, "stress : strain_rate");
    out_.for_cells([&](std::size_t k) {
      Mat3 sigma = tensor(stress_, k);
      if (add_kinetic_) sigma += tensor(kinetic_, k);
      const SymTensor s = from_matrix(sigma);
      p[k] = trace(s) / 3.0;
      q[k] = von_mises(s);
      eta[k] = p[k] > 0.0 ? q[k] / p[k] : nan;
      I[k] = p[k] > 0.0 ? rate[k] * grain_.diameter / std::sqrt(p[k] / grain_.density) : nan;
      work[k] = sigma.cwiseProduct(tensor(D_, k)).sum();
    });
  }

  const Cloud& cloud_;
  const SampleGrid<D>& grid_;
  Grain grain_;
  Builder out_;
  double *density_ = nullptr, *gradient_ = nullptr, *kinetic_ = nullptr, *stress_ = nullptr;
  bool add_kinetic_ = false;
};

}  // namespace

const Field& Fields::operator[](const std::string& name) const {
  for (const auto& f : list)
    if (f.name == name) return f;
  throw std::out_of_range("no field '" + name + "'");
}

template <int D>
Fields coarse_grain(const Cloud& cloud, const SampleGrid<D>& grid, const Kernel<D>& kernel,
                    const Grain& grain) {
  return std::visit([&](const auto& k) { return Mapper<D>(cloud, grid, grain).run(k); }, kernel);
}

template Fields coarse_grain<1>(const Cloud&, const SampleGrid<1>&, const Kernel<1>&, const Grain&);
template Fields coarse_grain<2>(const Cloud&, const SampleGrid<2>&, const Kernel<2>&, const Grain&);
template Fields coarse_grain<3>(const Cloud&, const SampleGrid<3>&, const Kernel<3>&, const Grain&);

}  // namespace grainpair
