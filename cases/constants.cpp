#include "cases/constants.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace grainpair {
namespace {

// Grains are those of a card if the constants are the same within what the card's own errors are
// (dem_mu05: 0.023 in the effective restitution, 0.0068 in M_c, 0.0019 in e_c). A tenth of a
// friction of 0.5, or 0.01, moves the effective restitution by at most 0.016; 0.02 of restitution
// by 0.02.
constexpr double friction_share = 0.1, least_friction = 0.01, restitution_apart = 0.02;
// A standard deviation of diameters of 0.012 d makes random packings 0.002 denser in the void
// ratio: their solid fraction is 0.634 + 0.066 of it [Desmond2014].
constexpr double deviation_apart = 0.012;
// Rolling friction of 0.1 raises M_c and e_c by many times their errors (dem_reference/README.md);
// a tenth of it is what those errors hide.
constexpr double rolling_apart = 0.01;
constexpr double stress_ratio_apart = 0.01, void_ratio_apart = 0.002;
// No tangential restitution explains more: all that are measured, 0 to 0.5, move the derived value
// by 0.054 between them (0.640 .. 0.586 for the seed's grains).
constexpr double effective_apart = 0.05;
// Overlaps of a hundredth of a diameter make the solid 3 % denser, 0.05 in the void ratio: a third
// of what tells dense from loose.
constexpr double overlap_apart = 0.01;

/// What the scene's law reads of a card.
struct Reads {
  bool cone = true, locus = true, gas = true;
};

Reads reads(const Values& scene) {
  const std::string& law = scene.word("material.law");
  if (law == "external") return {false, false, false};
  Reads r;
  r.cone = law != "linear_elastic" && law != "mu_i";
  r.locus = r.cone && law != "drucker_prager" && law != "lade_duncan";
  r.gas = r.locus && law != "critical_state" && scene.flag("material.collisions");
  return r;
}

double number(const GivenValues& given, const std::string& key) {
  return std::get<double>(given.at(key).value);
}

double number_or_none(const GivenValues& given, const std::string& key) {
  return given.contains(key) ? number(given, key) : 0.0;
}

/// Standard deviation of diameters over d: uniform on d (1 - s) .. d (1 + s), or two sizes.
double deviation(const std::string& sizes, double spread) {
  return sizes == "two" ? spread : spread / std::numbers::sqrt3;
}

double derived_restitution(const Values& scene) {
  return std::max(0.0, effective_restitution(scene.number("grains.restitution"),
                                             scene.number("grains.friction"),
                                             scene.number("material.tangential_restitution")));
}

/// Overlap in diameters of grains under the column's weight, p = rho_s g H: (p/E)^(2/3) [Hertz].
double overlap(const Values& scene, double young_modulus) {
  const double pressure = scene.number("grains.density") * scene.number("geometry.gravity") *
                          scene.number("geometry.height");
  return std::pow(pressure / young_modulus, 2.0 / 3.0);
}

/// The lines of one scene.
class Lines {
 public:
  Lines(const Values& scene, const Card& card) : scene_(scene), card_(card), reads_(reads(scene)) {}

  std::vector<std::string> all() {
    if (reads_.cone && !card_.grains.empty()) {
      of_other_grains();
      if (same_grains_) beside_the_card();
    }
    if (reads_.gas) dissipation();
    return std::move(lines_);
  }

 private:
  template <class... Args>
  void say(const std::string& key, fmt::format_string<Args...> text, Args&&... args) {
    lines_.push_back(fmt::format("{}: {} = {:g} {}", scene_.where(key), key, scene_.number(key),
                                 fmt::format(text, std::forward<Args>(args)...)));
  }

  // Diameter and density only scale a law's answer, so the card's may be others.
  void of_other_grains() {
    const std::string remedy = "calibrate a card for these grains: grainpair calibrate";
    const double mu = number(card_.grains, "grains.friction");
    const double en = number(card_.grains, "grains.restitution");
    if (std::abs(scene_.number("grains.friction") - mu) >
        std::max(least_friction, friction_share * mu)) {
      same_grains_ = false;
      say("grains.friction",
          "is not {:g}, of the grains that the card {} is fitted to (its stress_ratio, "
          "critical_void_ratio and effective_restitution follow friction) {}",
          mu, card_.name, remedy);
    }
    if (reads_.gas && std::abs(scene_.number("grains.restitution") - en) > restitution_apart) {
      same_grains_ = false;
      say("grains.restitution",
          "is not {:g}, of the grains that the card {} is fitted to (its effective_restitution "
          "follows it) {}",
          en, card_.name, remedy);
    }
    const std::string measure = "measure them: grainpair element cases/triaxial/rolling";
    const auto other = [&](const char* key, bool apart, const char* follow) {
      if (!apart) return;
      const double fitted = number_or_none(card_.grains, key);
      same_grains_ = false;
      say(key, "is not {:g}, of the grains that the card {} is fitted to ({}) {}", fitted,
          card_.name, follow, measure);
    };
    const auto sizes = card_.grains.find("grains.sizes");
    const double own = deviation(
        sizes == card_.grains.end() ? "uniform" : std::get<std::string>(sizes->second.value),
        number_or_none(card_.grains, "grains.size_spread"));
    const double spread =
        deviation(scene_.word("grains.sizes"), scene_.number("grains.size_spread"));
    other("grains.size_spread", std::abs(spread - own) > deviation_apart,
          "its critical_void_ratio follows the spread");
    const double rolling = number_or_none(card_.grains, "grains.rolling_friction");
    other("grains.rolling_friction",
          std::abs(scene_.number("grains.rolling_friction") - rolling) > rolling_apart,
          "its stress_ratio and critical_void_ratio follow rolling friction");
    const std::string stiff =
        scene_.number("mpm.young_modulus") > 0.0 ? "mpm.young_modulus" : "grains.young_modulus";
    const double fitted = number(card_.grains, "grains.young_modulus");
    const double more = overlap(scene_, scene_.number(stiff)) - overlap(scene_, fitted);
    if (std::abs(more) > overlap_apart)
      say(stiff,
          "Pa is not {:g} Pa, of the grains that the card {} is fitted to (under the column's "
          "weight overlaps differ by {:.2g} d, and with them critical_void_ratio and stress_ratio) "
          "use stiffer grains, or {}",
          fitted, card_.name, more, remedy);
  }

  // Of a card for the very grains, what the case sets itself.
  void beside_the_card() {
    const auto own = [&](const char* key, double apart) {
      const auto fitted = card_.constants.find(key);
      if (fitted == card_.constants.end()) return;
      const double of_card = std::get<double>(fitted->second.value);
      if (std::abs(scene_.number(key) - of_card) > apart)
        say(key,
            "is set beside the card {}, which fits {:g} to grains as these (they determine it) "
            "leave it to the card",
            card_.name, of_card);
    };
    own("material.stress_ratio", stress_ratio_apart * scene_.number("material.stress_ratio"));
    if (reads_.locus) own("material.critical_void_ratio", void_ratio_apart);
  }

  void dissipation() {
    const std::string key = "material.effective_restitution";
    const auto fitted = card_.constants.find(key);
    // told of already where the card is of other grains, and fitted to these where it is not
    const bool of_card = !card_.grains.empty() && fitted != card_.constants.end() &&
                         fitted->second.where == scene_.where(key);
    const double derived = derived_restitution(scene_);
    if (!of_card && std::abs(scene_.number(key) - derived) > effective_apart)
      say(key,
          "where the grains have {:.3g} (restitution {:g}, friction {:g}, tangential_restitution "
          "{:g}; dissipation goes as 1 - eps_eff^2, {:.2g} and not {:.2g}) leave it out, and it is "
          "derived",
          derived, scene_.number("grains.restitution"), scene_.number("grains.friction"),
          scene_.number("material.tangential_restitution"), 1.0 - std::pow(scene_.number(key), 2),
          1.0 - derived * derived);
  }

  const Values& scene_;
  const Card& card_;
  const Reads reads_;
  bool same_grains_ = true;
  std::vector<std::string> lines_;
};

}  // namespace

double effective_restitution(double en, double mu, double beta_0) {
  if (mu == 0.0) return en;
  const double mu0 = 3.5 * mu * (1.0 + en) / (1.0 + beta_0), m2 = mu0 * mu0;
  const double A = 0.5 * std::numbers::pi * mu0 * (1.0 - 2.0 / std::numbers::pi * std::atan(mu0));
  const double a1 = mu / mu0 * (2.0 * A + 2.0 * m2 / (1.0 + m2) * (1.0 - 2.0 * mu / mu0));
  const double a2 = 2.5 * mu / mu0 * (A + (m2 - m2 * m2) / ((1.0 + m2) * (1.0 + m2)));
  const double b1 = mu * mu / (1.0 + m2), b2 = 0.5 * mu / mu0 * (A + m2 / (1.0 + m2));
  return en - 0.5 * (a1 - a2 * b1 / b2);
}

void derive_constants(Values& scene) {
  const std::string key = "material.effective_restitution";
  if (scene.number(key) == 0.0) scene.set(key, derived_restitution(scene), "");
}

std::vector<std::string> contradictions(const Values& scene, const Card& card) {
  return Lines(scene, card).all();
}

}  // namespace grainpair
