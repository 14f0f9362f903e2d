#include "mpm/programs/point.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "cases/draft.hpp"
#include "cases/hdf5.hpp"
#include "mpm/materials/hyperelastic.hpp"
#include "mpm/points/body.hpp"

namespace grainpair {
namespace {

/// A body of two points: the one that is, and a trial of what it might become.
class Point {
 public:
  explicit Point(const PointPath& path)
      : body_(material_registry().at(path.material.word("material.law"))(path.material)) {
    body_->resize(2);
    void_ratio = path.void_ratio;
    const InitialState start{path.stress, path.void_ratio, path.granular_temperature};
    body_->initialise(0, {&start, 1}, batch_);
    keep_results();
  }

  /// What the step would do; keep() makes it so.
  void attempt(const SymTensor& D, const Vec3& spin, double dt) {
    static constexpr std::uint32_t copies[] = {0, 0};
    body_->reorder(copies);
    const Deformation step{D, spin, dt, void_ratio,
                           (1.0 + void_ratio) * std::exp(-trace(D) * dt) - 1.0};
    next_void_ratio_ = step.void_ratio;
    const auto start = std::chrono::steady_clock::now();
    batch_.steps.set(0, step);
    body_->update(1, batch_);
    keep_results();
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    ++updates;
  }
  void keep() {
    static constexpr std::uint32_t trial[] = {1, 1};
    body_->reorder(trial);
    void_ratio = next_void_ratio_;
    gone.plastic += energies.plastic, gone.regime_4 += energies.regime_4;
    gone.contact += energies.contact, worked += work;
  }
  SymTensor quasi_static_stress() const { return body_->quasi_static_stress(0, sigma, void_ratio); }

  double void_ratio;
  SymTensor sigma = SymTensor::Zero();
  Energies energies{};
  double work = 0.0, temperature = 0.0;
  Energies gone{};      // dissipated since the start, and ...
  double worked = 0.0;  // ... the work of the stress
  int regime = 0;
  double seconds = 0.0;
  long updates = 0;

 private:
  void keep_results() {
    sigma = batch_.sigma[0], energies = batch_.energies[0];
    work = batch_.work[0], temperature = batch_.granular_temperature[0];
    regime = batch_.regime[0];
  }
  std::unique_ptr<Body> body_;
  Batch batch_{1};
  double next_void_ratio_ = 0.0;
};

/// One step of a leg that holds a stress: finds the one rate that is free. `target` in Pa.
void attempt_at_stress(Point& point, const Leg& leg, const SymTensor& given, const Vec3& spin,
                       double dt, double target, double& free_rate, const std::string& where) {
  SymTensor unit = SymTensor::Zero();  // the rate that is free, and the stress that is held
  const int held = leg.kind == Leg::Kind::simple_shear ? 1 : 0;
  unit[held] = 1.0;
  if (leg.kind == Leg::Kind::triaxial) unit[2] = 1.0;
  const double scale = given.norm();
  const auto miss = [&](double x) {
    point.attempt(given + x * unit, spin, dt);
    return (point.sigma[held] - target) / target;
  };
  constexpr double tolerance = 1e-10;  // of the held stress
  double a = free_rate, fa = miss(a);
  if (std::abs(fa) <= tolerance) return;
  double width = 1e-3 * scale, b = a, fb = fa;
  for (int i = 0; i < 60 && fa * fb > 0.0; ++i, width *= 2.0) {  // stress rises with compression
    a = b, fa = fb;
    b = a + (fa < 0.0 ? width : -width), fb = miss(b);
  }
  if (fa * fb > 0.0)
    throw SolverError(Failure::unattainable,
                      "{}: no strain rate holds the stress of {:g} Pa (it is {:g})", where, target,
                      point.sigma[held]);
  for (int i = 0; i < 200; ++i) {  // Illinois
    const double x = std::abs(fb - fa) > 0.0 ? b - fb * (b - a) / (fb - fa) : 0.5 * (a + b);
    const double fx = miss(x);
    if (std::abs(fx) <= tolerance || std::abs(b - a) <= 1e-15 * (std::abs(a) + std::abs(b))) {
      free_rate = x;
      return;
    }
    if (fx * fb < 0.0)
      a = b, fa = fb;
    else
      fa *= 0.5;
    b = x, fb = fx;
  }
  free_rate = b;
}

/// The columns of a history, in the order in which drive() fills them.
void declare(PointHistory& history) {
  const auto add = [&](const std::string& name, const std::string& unit, const std::string& doc) {
    history.columns.push_back({name, unit, doc, {}});
  };
  static constexpr const char* components[] = {"xx", "yy", "zz", "xy", "yz", "zx"};
  add("time", "s", "time");
  add("void_ratio", "-", "void ratio");
  for (const char* c : components)
    add(fmt::format("strain_{}", c), "-", "integral of D, compression positive");
  for (const char* c : components) add(fmt::format("sigma_q_{}", c), "Pa", "quasi-static stress");
  for (const char* c : components)
    add(fmt::format("sigma_c_{}", c), "Pa", "collisional stress, with the contact share");
  add("p_q", "Pa", "mean quasi-static stress");
  add("q_q", "Pa", "quasi-static deviatoric stress, sqrt(3/2 s:s)");
  add("p_c", "Pa", "mean collisional stress");
  add("q_c", "Pa", "collisional deviatoric stress");
  add("granular_temperature", "m2/s2", "granular temperature T");
  add("regime", "-", "1 visco-elastic, 2 visco-elasto-plastic, 3 critical, 4 collisional, 0 none");
  add("stored", "J/kg", "elastic energy");
  add("fluctuation", "J/kg", "energy of the velocity fluctuations");
  add("plastic_dissipation", "J/kg", "dissipated by plastic strain since the start");
  add("regime_4_dissipation", "J/kg", "dissipated in regime 4 since the start");
  add("contact_dissipation", "J/kg", "dissipated by enduring contacts since the start");
  add("work", "J/kg", "stress work since the start");
  add("gibbs_energy", "J/m3",
      "Gibbs energy of the quasi-static stress, Eq. 7 of the seed as printed");
}

}  // namespace

const std::vector<double>& PointHistory::operator[](const std::string& name) const {
  for (const Column& column : columns)
    if (column.name == name) return column.values;
  throw std::logic_error("no column " + name);
}

PointHistory drive(const PointPath& path) {
  Point point(path);
  const Hyperelastic hyperelastic(path.material);
  PointHistory history;
  declare(history);
  double time = 0.0;
  SymTensor strain = SymTensor::Zero();
  const auto record = [&] {
    std::size_t column = 0;
    const auto put = [&](double value) { history.columns[column++].values.push_back(value); };
    const auto put_tensor = [&](const SymTensor& t) {
      for (int i = 0; i < 6; ++i) put(i < 3 ? t[i] : t[i] / std::numbers::sqrt2);
    };
    const SymTensor sigma_q = point.quasi_static_stress(), sigma_c = point.sigma - sigma_q;
    put(time), put(point.void_ratio), put_tensor(strain), put_tensor(sigma_q), put_tensor(sigma_c);
    for (const double value :
         {trace(sigma_q) / 3.0, von_mises(sigma_q), trace(sigma_c) / 3.0, von_mises(sigma_c),
          point.temperature, static_cast<double>(point.regime), point.energies.stored,
          point.energies.fluctuation, point.gone.plastic, point.gone.regime_4, point.gone.contact,
          point.worked, hyperelastic.gibbs_energy(sigma_q)})
      put(value);
  };
  record();
  long done = 0;
  for (std::size_t l = 0; l < path.legs.size(); ++l) {
    const Leg& leg = path.legs[l];
    const double dt = leg.duration * std::max(4 * leg.cycles, 1) / static_cast<double>(leg.steps);
    const int held = leg.kind == Leg::Kind::simple_shear ? 1 : 0;
    const double target = point.sigma[held];
    double free_rate = 0.0;
    for (long i = 0; i < leg.steps; ++i) {
      // a cycle: forth, twice back, forth
      const double phase = std::fmod((static_cast<double>(i) + 0.5) * dt / leg.duration, 4.0);
      const double sign = leg.cycles > 0 && phase > 1.0 && phase < 3.0 ? -1.0 : 1.0;
      const SymTensor given = sign * leg.rate;
      const Vec3 spin = sign * leg.spin;
      const int regime = point.regime;
      SymTensor D = given;
      if (leg.constant_stress) {
        attempt_at_stress(point, leg, given, spin, dt, target, free_rate,
                          fmt::format("leg {}, step {}", l + 1, i + 1));
        D[held] += free_rate;
        if (leg.kind == Leg::Kind::triaxial) D[2] += free_rate;
      } else {
        point.attempt(given, spin, dt);
      }
      if (!point.sigma.allFinite())
        throw SolverError(Failure::not_finite, "leg {}, step {}: the stress is no number", l + 1,
                          i + 1);
      point.keep();
      time += dt, strain += dt * D;
      history.regime_switches += point.regime != regime;
      if (++done % path.every == 0) record();
    }
  }
  history.update_seconds = point.seconds;
  history.updates = point.updates;
  return history;
}

void write(const PointHistory& history, const PointPath& path, const std::string& file) {
  Draft draft(file);
  if (file.ends_with(".csv")) {
    std::string out;
    const auto to = std::back_inserter(out);
    for (const auto& column : history.columns)
      fmt::format_to(to, "{}{}", &column == &history.columns.front() ? "" : ",", column.name);
    out += '\n';
    for (std::size_t row = 0; row < history.columns.front().values.size(); ++row) {
      for (const auto& column : history.columns)
        fmt::format_to(to, "{}{:.17g}", &column == &history.columns.front() ? "" : ",",
                       column.values[row]);
      out += '\n';
    }
    draft.write(out);
  } else {
    hdf5::Handle out = hdf5::create_file(draft.name());
    hdf5::write_attribute(out, "schema_version", 1);
    hdf5::write_attribute(out, "software", std::string("grainpair"));
    hdf5::write_attribute(out, "path", path.text);
    hdf5::write_attribute(out, "case_resolved", path.material.resolved());
    hdf5::write_attribute(out, "update_seconds", history.update_seconds);
    hdf5::write_attribute(out, "updates", static_cast<double>(history.updates));
    hdf5::write_attribute(out, "regime_switches", static_cast<double>(history.regime_switches));
    for (const auto& column : history.columns) {
      const hdf5::Handle dataset = hdf5::write_dataset<double>(out, column.name, column.values);
      hdf5::write_attribute(dataset, "unit", column.unit);
      hdf5::write_attribute(dataset, "doc", column.doc);
    }
    out.finish();
  }
  draft.finish();
}

}  // namespace grainpair
