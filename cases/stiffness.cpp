#include "cases/stiffness.hpp"

#include <algorithm>
#include <cmath>

#include "cases/rates.hpp"

namespace grainpair {
namespace {

/// K/(E_p^(2/3) p^(1/3)) of packings at 1 to 10 kPa, e = 0.72 to 0.75 (0.165 to 0.19 measured,
/// cases/isotropic/reference/isotropic.csv).
constexpr double hertz = 0.17;
/// Softening by less is rounding: a resolved case stays what it is.
constexpr double rounding = 1e-9;

bool linear_in_strain(const std::string& law) {
  return law == "linear_elastic" || law == "drucker_prager" || law == "mu_i";
}

double weight(const Values& scene) {
  return scene.number("grains.density") / (1.0 + scene.number("initial.void_ratio")) *
         scene.number("geometry.gravity") * scene.number("geometry.height");
}

/// Young modulus of an engine's grains: its own, or that of the scene [Pa].
double of_grains(const Values& scene, const std::string& own) {
  return scene.number(own) > 0.0 ? scene.number(own) : scene.number("grains.young_modulus");
}

/// Of the skeleton at the base [Pa].
double skeleton(const Values& scene) {
  if (linear_in_strain(scene.word("material.law")))
    return scene.number("material.young_modulus") /
           (3.0 * (1.0 - 2.0 * scene.number("material.poisson_ratio")));
  const double pa = scene.number("material.atmospheric_pressure");
  return scene.number("material.bulk_stiffness") * pa *
         std::pow(weight(scene) / pa, scene.number("material.stiffness_exponent"));
}

/// Factor of the bulk stiffness at which the critical-state locus p_cs = a_L E_p x^m, x = nu -
/// nu_c, has the modulus K = nu dp/dx = m nu a_L E_p (p/(a_L E_p))^(1 - 1/m) that is asked for.
double of_locus(const Values& scene, double asked) {
  const std::string& form = scene.word("material.critical_state_form");
  const double m = form == "linear" ? 1.0 : form == "two_thirds" ? 1.5 : 2.0;
  const double scale =
      scene.number("material.critical_state_slope") * of_grains(scene, "mpm.young_modulus");
  const double nu = 1.0 / (1.0 + scene.number("material.critical_void_ratio"));
  const double modulus = m * nu * scale * std::pow(weight(scene) / scale, 1.0 - 1.0 / m);
  return std::pow(asked / modulus, 2.0 / 3.0 * m);  // K ~ a_L^(1/m), a_L ~ s^(3/2)
}

void scale(Values& scene, const std::string& key, double factor) {
  scene.set(key, factor * scene.number(key), "");
}

bool needed(const Values& scene, const std::string& engine) {
  return scene.word(engine + ".stiffness") == "needed" &&
         scene.number(engine + ".young_modulus") == 0.0;
}

double bounded(double factor) { return factor < 1.0 - rounding ? factor : 1.0; }

}  // namespace

Stiffness soften_continuum(Values& scene) {
  const std::string& law = scene.word("material.law");
  const bool of_springs = linear_in_strain(law), of_spheres = !of_springs && law != "lade_duncan";
  Stiffness out;
  if (law == "external") return out;  // its stiffness is its own
  if (needed(scene, "mpm")) {
    const double asked = weight(scene) / scene.number("mpm.weight_to_stiffness");
    double factor = asked / skeleton(scene);
    if (of_spheres) factor = std::max(factor, of_locus(scene, asked));
    out.factor = bounded(factor);
  }
  if (out.factor < 1.0) {
    if (of_springs) scale(scene, "material.young_modulus", out.factor);
    if (!of_springs) {
      scale(scene, "material.bulk_stiffness", out.factor);
      scale(scene, "material.shear_stiffness", out.factor);
    }
    // the locus, not E_p: collisions of softer grains would be other ones
    if (of_spheres) scale(scene, "material.critical_state_slope", std::pow(out.factor, 1.5));
  }
  out.weight = weight(scene) / skeleton(scene);
  out.error = out.factor < 1.0 ? softening_error(law, out.weight) : 0.0;
  return out;
}

Stiffness soften_grains(Values& scene) {
  const std::string key = "dem.young_modulus";
  const auto modulus = [&] {
    return hertz * std::pow(of_grains(scene, key), 2.0 / 3.0) * std::cbrt(weight(scene));
  };
  const double own = scene.number("grains.young_modulus");
  if (needed(scene, "dem")) {
    const double asked = weight(scene) / scene.number("mpm.weight_to_stiffness");
    const double factor = bounded(asked / modulus());
    if (factor < 1.0) scene.set(key, std::pow(factor, 1.5) * own, "");
  }
  Stiffness out;
  out.factor = std::pow(of_grains(scene, key) / own, 2.0 / 3.0);
  out.weight = weight(scene) / modulus();
  out.error = out.factor < 1.0 ? softening_error("grains", out.weight) : 0.0;
  return out;
}

}  // namespace grainpair
