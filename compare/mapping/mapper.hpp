// Coarse graining on a grid of D dimensions; compiled for each of them in a unit of its own
// (coarse_grain.cpp.in).
#pragma once

#include "compare/mapping/affine_fit.hpp"
#include "compare/mapping/field_maps.hpp"

namespace grainpair {

template <int D>
class Mapper : private FieldMaps {
 public:
  Mapper(const Cloud& cloud, const SampleGrid<D>& grid, const Grain& grain)
      : FieldMaps(cloud, grain, grid.size()), grid_(grid) {}

  Fields run(const KernelSums& sums, const std::vector<double>& fluctuation) {
    const Stencils& points = sums.points;
    map_mass_and_motion(points);
    map_two_step(points, fluctuation);
    if (!cloud_.spin.empty()) map_rotation(points);
    if (cloud_.has_contacts) map_contacts(sums);
    if (!cloud_.stress.empty()) map_state(points);
    map_derived();
    return out_.take();
  }

 private:
  void map_mass_and_motion(const Stencils& points) {
    double* phi_s = out_.add("solid_fraction");
    double* e = out_.add("void_ratio");
    density_ = out_.add("density");
    double* momentum = out_.add("momentum");
    double* velocity = out_.add("velocity");
    gradient_ = out_.add("velocity_gradient");
    kinetic_ = out_.add("kinetic_stress");
    double* one = out_.add("granular_temperature_one_step");
    double* T = out_.add("granular_temperature");
    const bool several = cloud_.of_several_masses();
    double* T_number = several ? out_.add("granular_temperature_per_grain") : nullptr;
    double* number = out_.add("effective_number");

    out_.for_cells([&](std::size_t k) {
      for (const auto& weight : points.of_cell(k))
        phi_s[k] += cloud_.solid_volume[weight.item] * weight.value;
      e[k] = phi_s[k] > 0.0 ? (1.0 - phi_s[k]) / phi_s[k] : nan;
      const auto near = gather(grid_, cloud_, points, k, cloud_.mass, cloud_.v, several);
      const double rho = near.w().sum(), rho2 = near.w().square().sum();
      const Vec3 rho_v = near.weight.transpose().lazyProduct(near.v).transpose();
      density_[k] = rho;
      put(momentum, k, rho_v);
      const Vec3 V = rho > 0.0 ? Vec3(rho_v / rho) : Vec3::Constant(nan);
      put(velocity, k, V);
      number[k] = rho2 > 0.0 ? rho * rho / rho2 : 0.0;

      const Mat3 sigma_k = rho > 0.0 ? spread(near, V) : Mat3::Zero();
      put(kinetic_, k, sigma_k);
      one[k] = rho > 0.0 ? sigma_k.trace() / (3.0 * rho) : nan;

      const auto fit = affine_fit<D>(near);
      T[k] = fit.variance / 3.0;
      if (T_number)
        T_number[k] = fit.freedom_by_number > 0.0
                          ? fit.residual_by_number / (3.0 * fit.freedom_by_number)
                          : nan;
      Mat3 L = Mat3::Zero();
      for (int a = 0; a < D; ++a) L.col(grid_.direction(a)) = fit.gradient.col(a);
      if (grid_.of_rings()) add_hoop(grid_.radius(k), V, L);
      put(gradient_, k, L);
    });
  }

  void map_rotation(const Stencils& points) {
    double* T = out_.add("rotational_temperature");
    out_.for_cells([&](std::size_t k) {
      const auto near = gather(grid_, cloud_, points, k, cloud_.inertia, cloud_.spin);
      const double inertia = near.w().sum();
      const auto fit = affine_fit<D>(near);
      T[k] = density_[k] > 0.0 ? fit.variance * inertia / (3.0 * density_[k]) : nan;
    });
  }

  void map_contacts(const KernelSums& sums) {
    const Stencils& points = sums.points;
    const auto& along = sums.along;
    const auto& at = sums.at;
    stress_ = out_.add("contact_stress");
    double* t = out_.add("interaction_force_density");
    double* F = out_.add("fabric");
    double* Z = out_.add("coordination");
    double* power = cloud_.has_dissipation ? out_.add("dissipation_density") : nullptr;

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
