#include "mpm/programs/steady.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cases/draft.hpp"
#include "cases/hdf5.hpp"
#include "mpm/points/body.hpp"

namespace grainpair {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr int steps = 50;  // of a unit of strain, over which answers are averaged
constexpr int most = 60;   // units of strain
// A step after which everything is as before it, but the rates are told: of a unit of strain.
constexpr double probe = 1e-8;

/// The volumetric rate at which one point's pressure is the asked one: false position [Dahlquist
/// and Bjorck, "Illinois"], asked and told one value at a time so that many can go on together.
class Search {
 public:
  Search(double guess, double width) : b_(guess), width_(width) {}
  double next() const {
    if (!tried_) return b_;
    if (!bracketed_) return b_ + (fb_ < 0.0 ? width_ : -width_);  // it rises with compression
    return std::abs(fb_ - fa_) > 0.0 ? b_ - fb_ * (b_ - a_) / (fb_ - fa_) : 0.5 * (a_ + b_);
  }
  void take(double x, double miss) {
    const bool crosses = tried_ && fb_ * miss < 0.0;
    if (!bracketed_ || crosses)
      a_ = b_, fa_ = fb_;
    else
      fa_ *= 0.5;
    bracketed_ = bracketed_ || crosses;
    b_ = x, fb_ = miss, tried_ = true, width_ *= 2.0;
    const bool closed = bracketed_ && std::abs(b_ - a_) <= 1e-14 * (std::abs(a_) + std::abs(b_));
    found_ = std::abs(miss) <= 1e-7 || closed || !std::isfinite(miss);
  }
  bool found() const { return found_; }
  double rate() const { return b_; }

 private:
  double a_ = 0.0, fa_ = 0.0, b_, fb_ = 0.0, width_;
  bool tried_ = false, bracketed_ = false, found_ = false;
};

/// Points first ... n - 1 of a body are as they are, n ... 2n - 1 what they would become.
class Sheared {
 public:
  Sheared(const Case& material, std::span<const Condition> conditions)
      : conditions_(conditions),
        n_(conditions.size()),
        grain_density_(material.number("grains.density")),
        body_(material_registry().at(material.word("material.law"))(material)),
        batch_(n_),
        void_ratio_(n_, material.number("initial.void_ratio")),
        next_(n_),
        rates_(n_, 0.0),
        plastic_(n_) {
    body_->resize(2 * n_);
    std::vector<InitialState> start;
    const double d = material.number("grains.diameter");
    for (const Condition& c : conditions) {
      const double sheared = c.shear_rate * d;
      start.push_back({c.pressure * identity(), material.number("initial.void_ratio"),
                       imposed(c) ? c.granular_temperature : 0.2 * sheared * sheared});
    }
    body_->initialise(0, start, batch_);
    for (std::size_t i = 0; i < 2 * n_; ++i) copies_.push_back(static_cast<std::uint32_t>(i % n_));
    for (std::size_t i = 0; i < 2 * n_; ++i)
      trials_.push_back(static_cast<std::uint32_t>(n_ + i % n_));
  }

  /// A step of all points, each at its pressure.
  void step() {
    std::vector<Search> searches;
    for (std::size_t i = 0; i < n_; ++i)
      searches.emplace_back(rates_[i], 1e-3 * conditions_[i].shear_rate);
    for (int round = 0; round < 60; ++round) {
      for (std::size_t i = 0; i < n_; ++i)
        rates_[i] = searches[i].found() ? searches[i].rate() : searches[i].next();
      attempt();
      bool all = true;
      for (std::size_t i = 0; i < n_; ++i) {
        if (!searches[i].found())
          searches[i].take(rates_[i], pressure(i) / conditions_[i].pressure - 1.0);
        all = all && searches[i].found();
      }
      if (all) break;
    }
    body_->reorder(trials_);
    void_ratio_ = next_;
  }

  double shear_stress(std::size_t i) const {
    return batch_.sigma[i].dot(sheared(i)) / conditions_[i].shear_rate;
  }
  double deviatoric_stress(std::size_t i) const {
    return deviator(SymTensor(batch_.sigma[i])).norm() / std::numbers::sqrt2;
  }
  double pressure(std::size_t i) const { return trace(batch_.sigma[i]) / 3.0; }
  double void_ratio(std::size_t i) const { return void_ratio_[i]; }
  double temperature(std::size_t i) const { return batch_.granular_temperature[i]; }
  /// Plastic flow as it was over the step: the probe is too short to leave the cone's tolerance.
  double dissipation(std::size_t i) const {  // [W/m3]
    const Energies now = batch_.energies[i];
    const double spent = plastic_[i] * steps + (now.regime_4 + now.contact) / probe;
    return spent * grain_density_ / (1.0 + void_ratio_[i]) * conditions_[i].shear_rate;
  }

 private:
  static bool imposed(const Condition& c) { return !std::isnan(c.granular_temperature); }

  SymTensor sheared(std::size_t i) const {
    SymTensor D = SymTensor::Zero();
    D[3] = conditions_[i].shear_rate / std::numbers::sqrt2;
    return D;
  }

  /// Copies, the step with the rates as they are, the granular temperature where it is imposed, and
  /// the probe that tells stress and powers of what came out.
  void attempt() {
    body_->reorder(copies_);
    go(1.0 / steps, void_ratio_);
    for (std::size_t i = 0; i < n_; ++i) {
      plastic_[i] = Energies(batch_.energies[i]).plastic;
      if (imposed(conditions_[i]))
        body_->heat(n_ + i,
                    1.5 * (conditions_[i].granular_temperature - batch_.granular_temperature[i]));
    }
    const std::vector<double> reached = next_;
    go(probe, reached);
  }

  /// An update of the trials over `strain` from the void ratios `before`.
  void go(double strain, const std::vector<double>& before) {
    for (std::size_t i = 0; i < n_; ++i) {
      const double rate = conditions_[i].shear_rate, dt = strain / rate;
      const SymTensor D = sheared(i) + rates_[i] / 3.0 * identity();
      next_[i] = (1.0 + before[i]) * std::exp(-rates_[i] * dt) - 1.0;
      batch_.steps.set(i, Deformation{D, Vec3(0.0, 0.0, 0.5 * rate), dt, before[i], next_[i]});
    }
    body_->update(n_, batch_);
  }

  std::span<const Condition> conditions_;
  std::size_t n_;
  double grain_density_;
  std::unique_ptr<Body> body_;
  Batch batch_;
  std::vector<double> void_ratio_, next_, rates_;
  std::vector<double> plastic_;  // of the last step [J/kg]
  std::vector<std::uint32_t> copies_, trials_;
};

/// Means over a unit of strain.
struct Means {
  double shear = 0.0, deviator = 0.0, void_ratio = 0.0, temperature = 0.0, dissipation = 0.0;

  /// The largest relative change of stress, volume and granular temperature.
  double change_from(const Means& before) const {
    const auto off = [](double a, double b) { return a != 0.0 ? std::abs(1.0 - b / a) : 0.0; };
    return std::max({off(shear, before.shear), off(1.0 + void_ratio, 1.0 + before.void_ratio),
                     off(temperature, before.temperature)});
  }
};

/// Answers to a few conditions, which go on until the last of them is steady.
struct Answer {
  Means means;
  double change = nan;
};
std::vector<Answer> answers_to(const Case& material, std::span<const Condition> conditions) {
  const std::size_t n = conditions.size();
  Sheared points(material, conditions);
  std::vector<Answer> found(n);
  for (int unit = 0; unit < most; ++unit) {
    std::vector<Means> sums(n);
    for (int i = 0; i < steps; ++i) {
      points.step();
      for (std::size_t k = 0; k < n; ++k) {
        sums[k].shear += points.shear_stress(k) / steps;
        sums[k].deviator += points.deviatoric_stress(k) / steps;
        sums[k].void_ratio += points.void_ratio(k) / steps;
        sums[k].temperature += points.temperature(k) / steps;
        sums[k].dissipation += points.dissipation(k) / steps;
      }
    }
    bool all = unit > 0;
    for (std::size_t k = 0; k < n; ++k) {
      if (found[k].change < steady_change) continue;
      if (unit > 0) found[k].change = sums[k].change_from(found[k].means);
      found[k].means = sums[k];
      all = all && found[k].change < steady_change;
    }
    if (all) break;
  }
  return found;
}

}  // namespace

SteadyShear steady_shear(const Case& material, std::span<const Condition> conditions) {
  // Few at a time: neighbours become steady together.
  constexpr std::size_t chunk = 16;
  std::vector<Answer> answers(conditions.size());
  std::exception_ptr failed;
#pragma omp parallel for schedule(dynamic)
  for (std::size_t first = 0; first < conditions.size(); first += chunk) {
    try {
      const auto some = conditions.subspan(first, std::min(chunk, conditions.size() - first));
      std::ranges::copy(answers_to(material, some),
                        answers.begin() + static_cast<std::ptrdiff_t>(first));
    } catch (...) {
#pragma omp critical
      failed = std::current_exception();
    }
  }
  if (failed) std::rethrow_exception(failed);
  SteadyShear found;
  for (const auto& [means, change] : answers) {
    found.shear_stress.push_back(means.shear);
    found.deviatoric_stress.push_back(means.deviator);
    found.void_ratio.push_back(means.void_ratio);
    found.granular_temperature.push_back(means.temperature);
    found.dissipation.push_back(means.dissipation);
    found.change.push_back(change);
  }
  return found;
}

std::vector<Condition> read_conditions(const std::string& file) {
  const hdf5::Handle in = hdf5::open_file(file);
  const auto column = [&](const std::string& name) { return hdf5::read_dataset<double>(in, name); };
  const auto pressure = column("pressure"), rate = column("shear_rate");
  const bool held = H5Lexists(in, "granular_temperature", H5P_DEFAULT) > 0;
  const auto temperature =
      held ? column("granular_temperature") : std::vector<double>(pressure.size(), nan);
  if (rate.size() != pressure.size() || temperature.size() != pressure.size())
    throw CaseError(
        fmt::format("{}: {} pressures, {} shear rates, {} granular temperatures (a "
                    "condition has one of each)",
                    file, pressure.size(), rate.size(), temperature.size()));
  std::vector<Condition> found;
  for (std::size_t i = 0; i < pressure.size(); ++i) {
    const Condition one{pressure[i], rate[i], temperature[i]};
    if (!(one.pressure > 0.0 && one.shear_rate > 0.0) || one.granular_temperature < 0.0 ||
        !std::isfinite(one.pressure * one.shear_rate))
      throw CaseError(
          fmt::format("{}: condition {}: {:g} Pa, {:g} /s, {:g} m2/s2 (no steady shear "
                      "of a flow: pressure and rate are positive)",
                      file, i, pressure[i], rate[i], temperature[i]));
    found.push_back(one);
  }
  if (found.empty()) throw CaseError(fmt::format("{}: no condition", file));
  return found;
}

void write(const SteadyShear& answers, std::span<const Condition> conditions, const Case& material,
           const std::string& file) {
  Draft draft(file);
  hdf5::Handle out = hdf5::create_file(draft.name());
  hdf5::write_attribute(out, "schema_version", 1);
  hdf5::write_attribute(out, "software", std::string("grainpair"));
  hdf5::write_attribute(out, "case_resolved", material.resolved());
  const auto put = [&](const std::string& name, const std::string& unit, const std::string& doc,
                       const std::vector<double>& values) {
    const hdf5::Handle dataset = hdf5::write_dataset<double>(out, name, values);
    hdf5::write_attribute(dataset, "unit", unit);
    hdf5::write_attribute(dataset, "doc", doc);
  };
  std::vector<double> pressure, rate;
  for (const Condition& one : conditions)
    pressure.push_back(one.pressure), rate.push_back(one.shear_rate);
  put("pressure", "Pa", "tr(sigma)/3, held", pressure);
  put("shear_rate", "1/s", "sqrt(2 dev D : dev D), held", rate);
  put("shear_stress", "Pa", "s : D/shear_rate", answers.shear_stress);
  put("deviatoric_stress", "Pa", "sqrt(s : s/2)", answers.deviatoric_stress);
  put("void_ratio", "-", "void ratio", answers.void_ratio);
  put("granular_temperature", "m2/s2", "held, or the law's own", answers.granular_temperature);
  put("dissipation", "W/m3", "power dissipated, in all accounts", answers.dissipation);
  put("change", "-",
      "largest of stress, volume and granular temperature over the last unit of strain, relative",
      answers.change);
  out.finish();
  draft.finish();
}

}  // namespace grainpair
