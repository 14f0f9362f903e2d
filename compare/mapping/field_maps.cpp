#include "compare/mapping/field_maps.hpp"

namespace grainpair {

const Field& Fields::operator[](const std::string& name) const {
  for (const auto& f : list)
    if (f.name == name) return f;
  throw std::out_of_range("no field '" + name + "'");
}

void FieldMaps::map_two_step(const Stencils& points, const std::vector<double>& fluctuation) {
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

void FieldMaps::map_state(const Stencils& points) {
  double* e =
      out_.add("void_ratio_state", "-", 1, "the points' own void ratio, weighted by solid volume");
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

void FieldMaps::map_derived() {
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
  double* q =
      out_.add("deviatoric_stress", "Pa", 1, "sqrt(3/2 s : s) of the same stress, symmetric part");
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

}  // namespace grainpair
