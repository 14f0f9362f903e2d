// How frames enter an average, and what fields it has (frame_sums.hpp says what is averaged).
#pragma once

#include "compare/mapping/affine_fit.hpp"
#include "compare/mapping/field_maps.hpp"
#include "compare/mapping/frame_sums.hpp"

namespace grainpair {

/// Mass, motion and granular temperature of one frame in one cell.
template <int D>
void add_motion(CellSums<D>& sum, const Samples<D>& near) {
  const double rho = near.w().sum();
  if (!(rho > 0.0)) return;
  sum.w += rho, sum.w2 += near.w().square().sum();
  thread_local Room<D> room;
  Columns<D> wx = room.of(near.weight.size());
  wx = near.x.array().colwise() * near.w();
  const Eigen::Matrix<double, D, 1> rho_x = wx.colwise().sum().transpose();
  const Vec3 rho_v = near.weight.transpose().lazyProduct(near.v).transpose();
  sum.v += rho_v;
  sum.xx += wx.transpose().lazyProduct(near.x) - rho_x * rho_x.transpose() / rho;
  sum.vx += near.v.transpose().lazyProduct(wx) - rho_v * rho_x.transpose() / rho;
  sum.flux += rho_v * rho_v.transpose() / rho;
  sum.kinetic += spread<D>(near, rho_v / rho);
  const auto fit = affine_fit<D>(near);
  sum.by_mass[0] += fit.residual, sum.by_mass[1] += fit.freedom;
  sum.by_number[0] += fit.residual_by_number, sum.by_number[1] += fit.freedom_by_number;
}

inline void add_state(StateSums& sum, const Cloud& cloud, std::span<const Weight> weights) {
  for (const auto& w : weights) {
    const double vs = cloud.solid_volume[w.item] * w.value, m = cloud.mass[w.item] * w.value;
    sum.solid += vs, sum.mass += m;
    sum.void_ratio += vs * cloud.void_ratio[w.item];
    sum.temperature += m * cloud.granular_temperature[w.item];
    sum.stress += cloud.volume_of(w.item) * w.value * to_matrix(cloud.stress[w.item]);
  }
}

template <int D>
void add_frame(FrameSums<D>& sums, const Cloud& cloud, const KernelSums& frame,
               const std::vector<double>& fluctuation) {
  const std::size_t n = sums.cells.size();
  sums.frames += 1.0;
  const bool several = cloud.of_several_masses();
  sums.several = sums.several || several;
  sums.spins = sums.spins || !cloud.spin.empty();
  sums.dissipates = sums.dissipates || cloud.has_dissipation;
  if (!cloud.stress.empty()) sums.state.resize(n);
  if (cloud.has_contacts) {
    sums.frames_with_contacts += 1.0;
    sums.along.resize(n, Eigen::Matrix<double, 19, 1>::Zero());
    sums.at.resize(n, Eigen::Vector4d::Zero());
  }
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t k = 0; k < n; ++k) {
    CellSums<D>& sum = sums.cells[k];
    const auto weights = frame.points.of_cell(k);
    for (const auto& w : weights) {
      sum.solid += cloud.solid_volume[w.item] * w.value;
      if (!std::isnan(fluctuation[w.item])) {
        const double m = cloud.mass[w.item] * w.value;
        sum.two_step[0] += m * fluctuation[w.item], sum.two_step[1] += m;
      }
      if (cloud.has_contacts)
        sum.contacts[0] += w.value * cloud.contact_number[w.item], sum.contacts[1] += w.value;
    }
    const auto near = gather(sums.grid, cloud, frame.points, k, cloud.mass, cloud.v, several);
    const double rho = near.w().sum();
    add_motion<D>(sum, near);
    if (!cloud.spin.empty()) {
      const auto spins = gather(sums.grid, cloud, frame.points, k, cloud.inertia, cloud.spin);
      const auto fit = affine_fit<D>(spins);
      if (!std::isnan(fit.variance))
        sum.rotation[0] += fit.variance * spins.w().sum(), sum.rotation[1] += rho;
    }
    if (!cloud.stress.empty()) add_state(sums.state[k], cloud, weights);
    if (cloud.has_contacts) sums.along[k] += frame.along[k], sums.at[k] += frame.at[k];
  }
}

/// The fields of an average.
template <int D>
class AverageMaps : private DerivedMaps {
 public:
  AverageMaps(const FrameSums<D>& sums, const Grain& grain)
      : DerivedMaps(grain, sums.cells.size()), sums_(sums) {}

  Fields run() {
    map_motion();
    map_fluctuations();
    if (!sums_.along.empty()) map_contacts();
    if (!sums_.state.empty()) map_state();
    map_derived();
    return out_.take();
  }

 private:
  static double quotient(const std::array<double, 2>& q, double parts) {
    return q[1] > 0.0 ? q[0] / (parts * q[1]) : nan;
  }

  void map_motion() {
    double* phi_s = out_.add("solid_fraction");
    double* e = out_.add("void_ratio");
    density_ = out_.add("density");
    double* momentum = out_.add("momentum");
    double* velocity = out_.add("velocity");
    gradient_ = out_.add("velocity_gradient");
    double* number = out_.add("effective_number");
    out_.for_cells([&](std::size_t k) {
      const CellSums<D>& sum = sums_.cells[k];
      phi_s[k] = sum.solid / sums_.frames;
      e[k] = phi_s[k] > 0.0 ? (1.0 - phi_s[k]) / phi_s[k] : nan;
      density_[k] = sum.w / sums_.frames;
      put(momentum, k, Vec3(sum.v / sums_.frames));
      put(velocity, k, sum.w > 0.0 ? Vec3(sum.v / sum.w) : Vec3::Constant(nan));
      number[k] = sum.w2 > 0.0 ? sum.w * sum.w / sum.w2 : 0.0;
      Mat3 L = gradient(sum);
      if (sums_.grid.of_rings()) add_hoop(sums_.grid.radius(k), sum.v / sum.w, L);
      put(gradient_, k, L);
    });
  }

  /// Of one affine fit to all frames, each about its own mean.
  Mat3 gradient(const CellSums<D>& sum) const {
    Mat3 L = Mat3::Zero();
    Eigen::Matrix<double, 3, D> G = Eigen::Matrix<double, 3, D>::Constant(nan);
    const Eigen::LLT<Eigen::Matrix<double, D, D>> factors(sum.xx);
    if (spans_all<D>(factors, sum.xx.trace())) G = factors.solve(sum.vx.transpose()).transpose();
    for (int a = 0; a < D; ++a) L.col(sums_.grid.direction(a)) = G.col(a);
    return L;
  }

  void map_fluctuations() {
    kinetic_ = out_.add("kinetic_stress");
    double* mean = out_.add("mean_fluctuation_stress");
    double* one = out_.add("granular_temperature_one_step");
    double* T = out_.add("granular_temperature");
    double* T_number = sums_.several ? out_.add("granular_temperature_per_grain") : nullptr;
    double* two = out_.add("granular_temperature_two_step");
    double* rotation = sums_.spins ? out_.add("rotational_temperature") : nullptr;
    out_.for_cells([&](std::size_t k) {
      const CellSums<D>& sum = sums_.cells[k];
      put(kinetic_, k, Mat3(sum.kinetic / sums_.frames));
      const Mat3 steady = sum.w > 0.0 ? Mat3(sum.v * sum.v.transpose() / sum.w) : Mat3::Zero();
      put(mean, k, Mat3((sum.flux - steady) / sums_.frames));
      one[k] = sum.w > 0.0 ? sum.kinetic.trace() / (3.0 * sum.w) : nan;
      T[k] = quotient(sum.by_mass, 3.0);
      if (T_number) T_number[k] = quotient(sum.by_number, 3.0);
      two[k] = quotient(sum.two_step, 3.0);
      if (rotation) rotation[k] = quotient(sum.rotation, 3.0);
    });
  }

  void map_contacts() {
    stress_ = out_.add("contact_stress");
    double* t = out_.add("interaction_force_density");
    double* F = out_.add("fabric");
    double* Z = out_.add("coordination");
    double* power = sums_.dissipates ? out_.add("dissipation_density") : nullptr;
    const double n = sums_.frames_with_contacts;
    out_.for_cells([&](std::size_t k) {
      const auto& along = sums_.along[k];
      put(stress_, k, Mat3(Eigen::Map<const Mat3>(along.data()) / n));
      put(F, k,
          along[18] > 0.0 ? Mat3(Eigen::Map<const Mat3>(along.data() + 9) / along[18])
                          : Mat3::Constant(nan));
      put(t, k, Vec3(sums_.at[k].template head<3>() / n));
      if (power) power[k] = sums_.at[k][3] / n;
      Z[k] = quotient(sums_.cells[k].contacts, 1.0);
    });
    add_kinetic_ = true;
  }

  void map_state() {
    double* e = out_.add("void_ratio_state");
    double* T = out_.add("granular_temperature_state");
    stress_ = out_.add("stress_state");
    add_kinetic_ = false;
    out_.for_cells([&](std::size_t k) {
      const StateSums& sum = sums_.state[k];
      e[k] = sum.solid > 0.0 ? sum.void_ratio / sum.solid : nan;
      T[k] = sum.mass > 0.0 ? sum.temperature / sum.mass : nan;
      put(stress_, k, Mat3(sum.stress / sums_.frames));
    });
  }

  const FrameSums<D>& sums_;
};

}  // namespace grainpair
