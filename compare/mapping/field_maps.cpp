#include "compare/mapping/field_maps.hpp"

#include <algorithm>

namespace grainpair {
namespace {

struct Entry {
  const char *name, *unit;
  int components;
  const char* doc;
};
const Entry catalogue[] = {
    {"solid_fraction", "-", 1, "volume of solid per volume, sum V phi"},
    {"void_ratio", "-", 1, "(1 - solid_fraction) / solid_fraction"},
    {"density", "kg/m3", 1, "mass per volume, sum m phi"},
    {"momentum", "kg/(m2 s)", 3, "momentum per volume, sum m v phi"},
    {"velocity", "m/s", 3, "momentum / density"},
    {"velocity_gradient", "1/s", 9, "dv_i/dx_j of the weighted affine fit; zero across the depth"},
    {"kinetic_stress", "Pa", 9,
     "sum m v' v' phi with v' = v - velocity, compression positive; of an average, the mean of the "
     "frames' own"},
    {"mean_fluctuation_stress", "Pa", 9,
     "mean over frames of rho (V - velocity) (V - velocity), V each frame's own: what the mean "
     "motion's changes carry; neither in the kinetic stress nor in the granular temperature"},
    {"granular_temperature_one_step", "m2/s2", 1,
     "trace of kinetic_stress / (3 density), uncorrected: holds the velocity gradient's w^2 G:G/3"},
    {"granular_temperature", "m2/s2", 1,
     "mean square fluctuation per component about the affine fit, corrected for self-inclusion; by "
     "mass, sum m v'^2 phi / (3 sum m phi)"},
    {"granular_temperature_per_grain", "m2/s2", 1,
     "the same by number, sum v'^2 phi / (3 sum phi), about the same fit; of grains whose masses "
     "differ"},
    {"effective_number", "-", 1,
     "(sum m phi)^2 / sum (m phi)^2: points an average rests on, of all frames of an average"},
    {"granular_temperature_two_step", "m2/s2", 1,
     "mean of |v_i - V(r_i)|^2 / 3, each corrected for self-inclusion"},
    {"rotational_temperature", "m2/s2", 1,
     "sum I |w'|^2 phi / (3 sum m phi), w' about the affine fit, corrected for self-inclusion"},
    {"contact_stress", "Pa", 9, "sum f (x) branch psi, psi the exact line integral of the kernel"},
    {"interaction_force_density", "N/m3", 3, "sum over wall and glued-grain contacts of f phi"},
    {"fabric", "-", 9, "psi-weighted mean of n (x) n over contacts, n the branch's direction"},
    {"coordination", "-", 1, "mean number of contacts per grain, walls included"},
    {"dissipation_density", "W/m3", 1, "power dissipated at contacts, sum P phi"},
    {"void_ratio_state", "-", 1, "the points' own void ratio, weighted by solid volume"},
    {"granular_temperature_state", "m2/s2", 1, "the points' own granular temperature, by mass"},
    {"stress_state", "Pa", 9, "the points' own stress, sum V sigma phi"},
    {"strain_rate", "1/s", 9, "-sym(velocity_gradient), compression positive"},
    {"shear_rate", "1/s", 1, "sqrt(2 dev D : dev D)"},
    {"pressure", "Pa", 1, "trace of the stress / 3: contact + kinetic, or the points' own"},
    {"deviatoric_stress", "Pa", 1, "sqrt(3/2 s : s) of the same stress, symmetric part"},
    {"stress_ratio", "-", 1, "deviatoric_stress / pressure"},
    {"inertial_number", "-", 1,
     "shear_rate d / sqrt(pressure / rho_s); of several sizes d = sum d^4 / sum d^3"},
    {"stress_power", "W/m3", 1, "stress : strain_rate"},
};

}  // namespace

double* Builder::add(const std::string& name) {
  const Entry* const entry = std::find_if(std::begin(catalogue), std::end(catalogue),
                                          [&](const Entry& one) { return one.name == name; });
  if (entry == std::end(catalogue)) throw std::logic_error("no field '" + name + "' is known");
  fields_.list.push_back(
      {name, entry->unit, entry->doc, entry->components,
       std::vector<double>(cells_ * static_cast<std::size_t>(entry->components), 0.0)});
  return fields_.list.back().values.data();
}

const Field& Fields::operator[](const std::string& name) const {
  for (const auto& f : list)
    if (f.name == name) return f;
  throw std::out_of_range("no field '" + name + "'");
}

void Fields::drop(const std::vector<std::string>& names) {
  std::erase_if(list, [&](const Field& field) {
    return std::find(names.begin(), names.end(), field.name) != names.end();
  });
}

void FieldMaps::map_two_step(const Stencils& points, const std::vector<double>& fluctuation) {
  double* T = out_.add("granular_temperature_two_step");
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
  double* e = out_.add("void_ratio_state");
  double* T = out_.add("granular_temperature_state");
  stress_ = out_.add("stress_state");
  out_.for_cells([&](std::size_t k) {
    double solid = 0.0;
    Mat3 sigma = Mat3::Zero();
    for (const auto& w : points.of_cell(k)) {
      const double vs = cloud_.solid_volume[w.item] * w.value;
      solid += vs, e[k] += vs * cloud_.void_ratio[w.item];
      T[k] += cloud_.mass[w.item] * w.value * cloud_.granular_temperature[w.item];
      sigma += cloud_.volume_of(w.item) * w.value * to_matrix(cloud_.stress[w.item]);
    }
    e[k] = solid > 0.0 ? e[k] / solid : nan;
    T[k] = density_[k] > 0.0 ? T[k] / density_[k] : nan;
    put(stress_, k, sigma);
  });
}

void DerivedMaps::map_derived() {
  double* D_ = out_.add("strain_rate");
  double* rate = out_.add("shear_rate");
  out_.for_cells([&](std::size_t k) {
    const Mat3 L = tensor(gradient_, k), rate_of_strain = -0.5 * (L + L.transpose());
    put(D_, k, rate_of_strain);
    rate[k] = std::sqrt(2.0) * deviator(from_matrix(rate_of_strain)).norm();
  });
  if (!stress_) return;
  double* p = out_.add("pressure");
  double* q = out_.add("deviatoric_stress");
  double* eta = out_.add("stress_ratio");
  double* I = out_.add("inertial_number");
  double* work = out_.add("stress_power");
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
