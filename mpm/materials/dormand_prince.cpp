#include "mpm/materials/dormand_prince.hpp"

#include <array>
#include <limits>
#include <tuple>

namespace grainpair {
namespace {

/// How plastic volume changes: by the state, by the locus p = p_cs(e), or dilating at the bound
/// towards it.
enum class Mode { state, following, lagging };

struct Point {
  SymTensor strain;   // elastic
  SymTensor stress;   // tau [Pa]
  double dissipated;  // so far in the step [J/m3]
};

constexpr int most_substeps = 100000;
constexpr double smallest_step = 1e-10;
constexpr double first_step = 1e-3;        // of what is left, out of the apex
constexpr double locus_tolerance = 1e-7;   // of G_1, relative to p_cs
constexpr double release_pressure = 1e-3;  // below which a point lets go [Pa]

/// The straight path of a step in strain, over a pseudo-time t from 0 to 1.
struct Path {
  const QuasiStatic& model;
  const SymTensor& increment;
  double e_old;

  double void_ratio(double t) const {
    return (1.0 + e_old) * std::exp(-t * trace(increment)) - 1.0;
  }

  /// Pseudo-time at which e meets e_c, rising or falling; infinity if it does not.
  double meets_critical_void_ratio(double t, bool rising) const {
    const double rate = trace(increment), e = void_ratio(t);
    if (rising ? e >= model.locus.e_c : e < model.locus.e_c) return t;
    if (rate == 0.0 || (rate < 0.0) != rising) return std::numeric_limits<double>::infinity();
    return volumetric_strain<double>(e_old, model.locus.e_c) / rate;
  }
  /// Pseudo-time at which an open strain is back at a = 0.
  double closes(const SymTensor& strain, double t) const {
    return closing(t) > 0.0 ? t + std::max(-trace(strain), 0.0) / closing(t)
                            : std::numeric_limits<double>::infinity();
  }
  /// Rate of a while open: the volume, and the dilation of shear without stress.
  double closing(double t) const {
    const double e = void_ratio(t);
    const double ratio = e < model.locus.e_c ? model.locus.flow_ratio(e, 0.0) : 0.0;
    return trace(increment) - ratio * deviator(increment).norm();
  }

  /// p_cs(e) and G_1, in tau [Pa].
  double target(double t) const {
    const double e = void_ratio(t);
    return model.locus.pressure(e) / model.volume.cauchy(e);
  }
  double gap(const Point& at, double t) const { return trace(at.stress) / 3.0 - target(t); }
  bool on_locus(const Point& at, double t) const {
    const double p_cs = target(t);
    return p_cs > 0.0 && std::abs(gap(at, t)) <= locus_tolerance * p_cs;
  }

  /// Fraction of the remaining strain that is elastic, 0 where flow begins at once: the strain
  /// path is straight and the cone convex in strain, so the yield function changes sign once from
  /// inside.
  double elastic_fraction(const Point& now, double t) const {
    const SymTensor rest = (1.0 - t) * increment;
    const auto f = [&](double x) {
      const SymTensor strain = now.strain + x * rest;
      const double a = trace(strain);
      if (a <= 0.0) return 1.0;
      const SymTensor eta = model.elasticity.coupling / a * deviator(strain);
      return eta.squaredNorm() < 6.0 ? model.cone.yield(eta) : 1.0;
    };
    double inside = 0.0, f_inside = f(0.0);
    if (f_inside > -1e-9) {  // on the cone: does the path turn inwards first?
      double x = 1e-3;
      while (x > 1e-12 && f(x) >= f_inside) x *= 0.1;
      if (x <= 1e-12 || f(x) > -1e-12) return 0.0;
      inside = x, f_inside = f(x);
    }
    double outside = 1.0, f_outside = f(1.0);
    for (int i = 0; i < 200 && outside - inside > 1e-15; ++i) {  // Pegasus
      const double x = inside + std::clamp(f_inside / (f_inside - f_outside), 1e-6, 1.0 - 1e-6) *
                                    (outside - inside);
      const double fx = f(x);
      if (std::abs(fx) < 1e-13) return x;
      if (fx * f_outside < 0.0)
        inside = outside, f_inside = f_outside;
      else
        f_inside *= f_outside / (f_outside + fx);
      outside = x, f_outside = fx;
    }
    return outside;
  }

  struct Flow {
    SymTensor df;                            // df/dsigma
    SymTensor n;                             // direction of dev eps_p
    SymTensor elastic, by_shear, by_volume;  // Ce[D], Ce[n], Ce[I/3]
  };
  Flow flow(const SymTensor& tau) const {
    const double p = trace(tau) / 3.0;
    const SymTensor eta = deviator(tau) / p, a = LadeDuncan::normal(eta);
    Flow w;
    w.df = (a - a.dot(eta) / 3.0 * identity()) / p;
    w.n = a.normalized();
    w.elastic = model.elasticity.rate(tau, increment);
    w.by_shear = model.elasticity.rate(tau, w.n);
    w.by_volume = model.elasticity.rate(tau, identity() / 3.0);
    return w;
  }

  /// Multiplier and plastic volume rate that keep f = 0 and p = p_cs(e).
  std::pair<double, double> following(const Flow& w, double t) const {
    // d/dt [p_cs(e) (1+e)/(1+e_r)], with e_dot = -(1+e) tr D
    const double e = void_ratio(t);
    const double slope = (model.locus.modulus(e) - model.locus.pressure(e)) * trace(increment) /
                         model.volume.cauchy(e);
    const double a11 = w.df.dot(w.by_shear), a12 = w.df.dot(w.by_volume), b1 = w.df.dot(w.elastic);
    const double a21 = trace(w.by_shear) / 3.0, a22 = trace(w.by_volume) / 3.0,
                 b2 = trace(w.elastic) / 3.0 - slope;
    const double det = a11 * a22 - a12 * a21;
    return {(b1 * a22 - a12 * b2) / det, (a11 * b2 - a21 * b1) / det};
  }

  Mode critical_mode(const Point& now, double t) const {
    if (!on_locus(now, t)) return gap(now, t) < 0.0 ? Mode::lagging : Mode::state;
    const auto [multiplier, volume] = following(flow(now.stress), t);
    return multiplier >= 0.0 && volume >= -model.locus.largest_ratio * multiplier ? Mode::following
                                                                                  : Mode::lagging;
  }

  /// d(tau)/dt and the dissipation rate.
  std::pair<SymTensor, double> rate(const SymTensor& tau, double t, Mode mode) const {
    const Flow w = flow(tau);
    double multiplier, volume;
    if (mode == Mode::following) {
      std::tie(multiplier, volume) = following(w, t);
    } else {
      const double e = void_ratio(t), p = trace(tau) / 3.0 * model.volume.cauchy(e);
      const double ratio =
          mode == Mode::lagging ? -model.locus.largest_ratio : model.locus.flow_ratio(e, p);
      multiplier = w.df.dot(w.elastic) / w.df.dot(w.by_shear + ratio * w.by_volume);
      volume = ratio * multiplier;
    }
    return {w.elastic - multiplier * w.by_shear - volume * w.by_volume,
            multiplier * tau.dot(w.n) + volume * trace(tau) / 3.0};
  }

  /// One substep; returns its relative error, infinite where a stage leaves p > 0.
  double substep(const Point& now, double t, double h, Mode mode, Point& next) const {
    constexpr double inf = std::numeric_limits<double>::infinity();
    static constexpr double c[7] = {0, 0.2, 0.3, 0.8, 8.0 / 9, 1, 1};
    static constexpr double a[7][6] = {
        {},
        {1.0 / 5},
        {3.0 / 40, 9.0 / 40},
        {44.0 / 45, -56.0 / 15, 32.0 / 9},
        {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
        {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
        {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784,
         11.0 / 84}};  // also the fifth-order weights
    static constexpr double error_weight[7] = {
        71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
    std::array<SymTensor, 7> k;
    std::array<double, 7> g;
    SymTensor tau;
    double dissipated = 0.0;
    for (int i = 0; i < 7; ++i) {
      tau = now.stress, dissipated = 0.0;
      for (int j = 0; j < i; ++j) tau += h * a[i][j] * k[j], dissipated += h * a[i][j] * g[j];
      if (!(trace(tau) > 0.0)) return inf;
      std::tie(k[i], g[i]) = rate(tau, t + c[i] * h, mode);
    }
    SymTensor error = SymTensor::Zero();
    double error_dissipated = 0.0;
    for (int i = 0; i < 7; ++i)
      error += h * error_weight[i] * k[i], error_dissipated += h * error_weight[i] * g[i];
    next = {now.strain, tau, now.dissipated + dissipated};
    if (!tau.allFinite()) return inf;
    return std::max(error.norm() / tau.norm(),
                    std::abs(error_dissipated) / (std::abs(next.dissipated) +
                                                  model.elasticity.size(trace(tau)) * trace(tau)));
  }

  /// Back to f = 0, and to p = p_cs(e) where the point is on the locus; then the strain that goes
  /// with the stress.
  void correct_drift(Point& at, double t, bool on_locus) const {
    for (int i = 0; i < 5; ++i) {
      const double p = trace(at.stress) / 3.0, f = model.cone.yield(deviator(at.stress) / p);
      const double miss = on_locus ? p - target(t) : 0.0;
      if (std::abs(f) < 1e-13 && std::abs(miss) <= 1e-13 * p) break;
      const Flow w = flow(at.stress);
      double multiplier, volume = 0.0;
      if (on_locus) {
        const double a11 = w.df.dot(w.by_shear), a12 = w.df.dot(w.by_volume);
        const double a21 = trace(w.by_shear) / 3.0, a22 = trace(w.by_volume) / 3.0,
                     det = a11 * a22 - a12 * a21;
        multiplier = (f * a22 - a12 * miss) / det, volume = (a11 * miss - a21 * f) / det;
      } else {
        multiplier = f / w.df.dot(w.by_shear);
      }
      at.dissipated += multiplier * at.stress.dot(w.n) + volume * p;
      at.stress -= multiplier * w.by_shear + volume * w.by_volume;
    }
    at.strain = model.elasticity.strain(at.stress);
  }
};

/// One step: where the point is, and how far it has come.
class Integration {
 public:
  Integration(const QuasiStatic& model, double tolerance, const QuasiStaticState<double>& old,
              const SymTensor& increment, double e_old, double e)
      : model_(model),
        tolerance_(tolerance),
        path_{model, increment, e_old},
        e_(e),
        before_(model.elasticity.evaluate(old.strain)),
        now_{old.strain, before_.stress, 0.0},
        regime_(old.regime) {}

  QuasiStaticResponse<double> run() {
    for (int substeps = 0; t_ < 1.0; ++substeps) {
      if (substeps == most_substeps) return rest_in_closed_form();
      if (now_.stress.isZero(0.0)) {  // regimes 4 and 0
        if (!leave_the_apex())
          return finish(model_.open(trace(now_.strain) + (1.0 - t_) * path_.closing(t_), e_));
        continue;
      }
      const SymTensor trial = now_.strain + (1.0 - t_) * path_.increment;
      if (trace(trial) > 0.0 && model_.holds(trial))
        return finish(model_.loaded(trial, visco_elastic));
      if (const double fraction = path_.elastic_fraction(now_, t_); fraction > 0.0)
        go_elastically(fraction);
      else if (!flow())
        return rest_in_closed_form();
    }
    return finish(now_.stress.isZero(0.0) ? model_.open(trace(now_.strain), e_)
                                          : model_.loaded(now_.strain, regime_));
  }

 private:
  QuasiStaticResponse<double> finish(QuasiStaticResponse<double> r) const {
    r.dissipated += now_.dissipated;
    r.work = r.stored - before_.energy + r.dissipated;
    return r;
  }
  QuasiStaticResponse<double> rest_in_closed_form() const {
    return finish(model_.implicit(QuasiStaticState<double>{now_.strain, regime_},
                                  (1.0 - t_) * path_.increment, path_.void_ratio(t_), e_));
  }
  /// Lets go where the pressure has been used up.
  void release_if_spent(double pressure_before) {
    const double p = trace(now_.stress) / 3.0;
    if (!(p <= release_pressure && p < pressure_before)) return;
    now_.dissipated += model_.elasticity.energy(now_.strain);
    const QuasiStaticResponse<double> r = model_.open(0.0, path_.void_ratio(t_));
    now_ = {r.state.strain, r.stress, now_.dissipated};
    regime_ = r.state.regime;
  }

  /// Waits for contact, then goes on in closed form; false if there is none in this step.
  bool leave_the_apex() {
    const double contact = regime_ == collisional ? path_.meets_critical_void_ratio(t_, false)
                                                  : path_.closes(now_.strain, t_);
    if (!(contact < 1.0)) return false;
    const double next = contact + (1.0 - contact) * first_step;
    const QuasiStaticResponse<double> first = model_.implicit(
        QuasiStaticState<double>{SymTensor::Zero(), regime_}, (next - contact) * path_.increment,
        path_.void_ratio(contact), path_.void_ratio(next));
    now_ = {first.state.strain, first.stress, now_.dissipated + first.dissipated};
    regime_ = first.state.regime;
    t_ = next, h_ = 1.0 - t_;
    return true;
  }

  void go_elastically(double fraction) {
    const double pressure = trace(now_.stress) / 3.0;
    now_.strain += fraction * (1.0 - t_) * path_.increment;
    now_.stress = model_.elasticity.stress(now_.strain);
    t_ += fraction * (1.0 - t_), h_ = 1.0 - t_;
    regime_ = visco_plastic;
    release_if_spent(pressure);
  }

  /// One substep of plastic flow; false where none is short enough.
  bool flow() {
    if (path_.on_locus(now_, t_)) regime_ = critical;
    if (regime_ != critical) regime_ = visco_plastic;
    const Mode mode = regime_ == critical ? path_.critical_mode(now_, t_) : Mode::state;
    const bool watched = mode != Mode::following && !path_.on_locus(now_, t_);
    h_ = std::min(h_, 1.0 - t_);
    if (regime_ == critical)  // p_cs falls to zero at e_c: halve the way there
      h_ = std::min(
          h_, std::max(0.5 * (path_.meets_critical_void_ratio(t_, true) - t_), smallest_step));
    const double gap = path_.gap(now_, t_), pressure = trace(now_.stress) / 3.0;
    Point next;
    double growth = 5.0;
    for (;;) {
      if (h_ < smallest_step) return false;
      const double error = path_.substep(now_, t_, h_, mode, next);
      if (error > tolerance_) {
        h_ *= std::clamp(0.9 * std::pow(tolerance_ / error, 0.2), 0.1, 0.9);
        growth = 1.0;
        continue;
      }
      const double gap_next = path_.gap(next, t_ + h_);
      if (!watched || gap * gap_next >= 0.0 || path_.on_locus(next, t_ + h_)) {
        growth = std::min(
            growth, std::clamp(0.9 * std::pow(tolerance_ / std::max(error, 1e-30), 0.2), 0.1, 5.0));
        break;
      }
      h_ *= std::clamp(gap / (gap - gap_next), 0.02, 0.98);  // end on the locus
      growth = 1.0;
    }
    t_ = t_ + h_ > 1.0 - smallest_step ? 1.0 : t_ + h_;
    now_ = next;
    path_.correct_drift(now_, t_, mode == Mode::following || (watched && path_.on_locus(now_, t_)));
    release_if_spent(pressure);
    h_ *= growth;
    return true;
  }

  const QuasiStatic& model_;
  double tolerance_;
  Path path_;
  double e_;
  decltype(std::declval<QuasiStatic>().elasticity.evaluate(SymTensor())) before_;
  Point now_;
  double regime_;
  double t_ = 0.0, h_ = 1.0;
};

}  // namespace

QuasiStaticResponse<double> DormandPrince::operator()(const QuasiStaticState<double>& old,
                                                      const SymTensor& increment, double e_old,
                                                      double e) const {
  return Integration(model_, tolerance_, old, increment, e_old, e).run();
}

QuasiStaticResponse<Wide> DormandPrince::operator()(const QuasiStaticState<Wide>& old,
                                                    const WideTensor& increment, const Wide& e_old,
                                                    const Wide& e) const {
  constexpr std::size_t width = Wide::size();
  std::array<QuasiStaticState<double>, width> state;
  std::array<SymTensor, width> strain, stress;
  std::array<double, width> stored, dissipated, work;
  const auto at = [](std::size_t lane) { return lane; };
  store<QuasiStaticState>(old, state.data(), at);
  store<Tensor>(increment, strain.data(), at);
  for (std::size_t lane = 0; lane < width; ++lane) {
    const auto r = (*this)(state[lane], strain[lane], e_old[lane], e[lane]);
    state[lane] = r.state, stress[lane] = r.stress;
    stored[lane] = r.stored, dissipated[lane] = r.dissipated, work[lane] = r.work;
  }
  return {load<QuasiStaticState>(state.data(), at), load<Tensor>(stress.data(), at),
          load<Scalar>(stored.data(), at), load<Scalar>(dissipated.data(), at),
          load<Scalar>(work.data(), at)};
}

}  // namespace grainpair
