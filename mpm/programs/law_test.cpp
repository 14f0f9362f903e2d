#include "mpm/programs/law_test.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <chrono>
#include <thread>

#include "mpm/external/tangent.hpp"
#include "mpm/programs/driven_point.hpp"

namespace grainpair {
namespace {

constexpr double pressure = 1e3;  // of a column 0.1 m high [Pa]

/// The questions, each to points of one law.
class Questions {
 public:
  explicit Questions(const Case& material)
      : material_(material), e_(material.number("initial.void_ratio")) {}

  LawFinding rest() const {
    LawFinding out{"rest", "a strain of zero changes nothing"};
    DrivenPoint point = started();
    const SymTensor begun = point.sigma;
    const double held = point.held();
    double worst = 0.0;
    for (int i = 0; i < 100; ++i) {
      point.move(SymTensor::Zero(), Vec3::Zero(), 1e-5);
      worst = std::max(worst, (point.sigma - begun).norm() / begun.norm());
    }
    const double kept = std::abs(point.held() - held) / held;
    out.figure = fmt::format("stress {:.1e}, energy {:.1e} of it", worst, kept);
    out.holds = worst < 1e-10 && kept < 1e-10;
    return out;
  }

  LawFinding objectivity() const {
    LawFinding out{"objectivity", "the same motion, seen from a frame that turns, gives the same"};
    Random random{std::mt19937_64(12)};
    double worst = 0.0;
    for (int path = 0; path < 20; ++path) {
      DrivenPoint still(material_), turned(material_);
      Mat3 Q = Eigen::AngleAxisd(random.between(0.0, 3.0), random.vector().normalized())
                   .toRotationMatrix();
      const Vec3 spin = 50.0 * random.vector();
      still.start(at_rest(pressure), e_), turned.start(rotated(at_rest(pressure), Q), e_);
      for (int i = 0; i < 50; ++i) {
        const double dt = 1e-4;
        const SymTensor D =
            deviator(random.tensor()) + 0.003 * random.normal(random.engine) * identity();
        Q = Eigen::AngleAxisd(spin.norm() * dt, spin.normalized()).toRotationMatrix() * Q;
        still.move(D, Vec3::Zero(), dt), turned.move(rotated(D, Q), spin, dt);
        worst = std::max(
            worst, (turned.sigma - rotated(still.sigma, Q)).norm() / (1.0 + still.sigma.norm()));
      }
    }
    out.figure = fmt::format("{:.1e} of the stress", worst);
    out.holds = worst < 1e-8;
    return out;
  }

  /// A loop of small strains: what a law gives back beyond what it took, it makes of nothing.
  LawFinding loops() const {
    LawFinding out{"loops", "a closed loop of strain makes no energy"};
    double made = 0.0;
    for (const double size : {1e-5, 1e-4, 1e-3}) {
      DrivenPoint point(material_);
      point.start(pressure * identity(), e_);
      double work = 0.0, turnover = 0.0;
      const int steps = 400;
      for (int i = 0; i < steps; ++i) {
        const auto at = [&](double turn) {
          const double t = 2.0 * std::numbers::pi * turn;
          return SymTensor{size * std::sin(t),           -size * std::sin(2 * t),
                           size * (1 - std::cos(t)),     size * std::sin(t),
                           size * (1 - std::cos(3 * t)), 0.0};
        };
        const SymTensor before = point.sigma;
        const SymTensor strain = at((i + 1.0) / steps) - at(double(i) / steps);
        point.move(strain / 1e-4, Vec3::Zero(), 1e-4);
        const double step = 0.5 * (before + point.sigma).dot(strain);
        work += step, turnover += std::abs(step);
      }
      made = std::max(made, -work / turnover);
    }
    out.figure = fmt::format("{:.1e} of what went around", made);
    // Cauchy stress in an elastic loop of strain x is off by x times its energy.
    out.holds = made < 2e-3;
    return out;
  }

  LawFinding dissipation() const {
    LawFinding out{"dissipation", "flow takes energy, on any path"};
    Random random{std::mt19937_64(11)};
    double least = 0.0;
    for (int path = 0; path < 200; ++path) {
      DrivenPoint point = started(std::pow(10.0, random.between(1.0, 4.0)));
      const double size = std::pow(10.0, random.between(-6.0, -2.0));
      double gone = 0.0, turnover = point.held();
      for (int i = 0; i < 20; ++i) {
        SymTensor strain = size * random.tensor();
        strain -= random.between(0.9, 1.1) * trace(strain) / 3.0 * identity();
        point.move(strain / 1e-5, size * random.vector() / 1e-5, 1e-5);
        gone += point.dissipated(), turnover += std::abs(point.work);
      }
      least = std::min(least, gone / turnover);
    }
    out.figure = fmt::format("at least {:.1e} of the work", least);
    out.holds = least > -1e-2;
    return out;
  }

  LawFinding steps() const {
    LawFinding out{"steps", "shorter steps lead to one answer"};
    const auto end = [&](int steps) {
      DrivenPoint point = started();
      const double dt = 1e-2 / steps;
      for (int i = 0; i < steps; ++i)
        point.move({0.1, 1.0, -0.5, 1.0, 0.0, 0.3}, Vec3{0.0, 0.0, 1.0}, dt);
      return point.sigma;
    };
    const SymTensor best = end(6400);
    const double coarse = (end(100) - best).norm() / best.norm(),
                 fine = (end(400) - best).norm() / best.norm();
    out.figure = fmt::format("{:.1e} with 100 steps, {:.1e} with 400", coarse, fine);
    out.holds = fine < 1e-6 || fine < 0.4 * coarse;
    return out;
  }

  /// The modulus that the time step rests on against differences of the stress.
  LawFinding modulus() const {
    LawFinding out{"modulus", "the stiffness it tells is not below what it does"};
    double most = 0.0;
    for (const double p : {0.1 * pressure, pressure})
      for (int axis = 0; axis < 3; ++axis)
        for (const double strain : {1e-7, -1e-7}) {
          DrivenPoint point = started(p);
          const SymTensor before = point.sigma;
          SymTensor D = SymTensor::Zero();
          D[axis] = strain / 1e-5;
          point.move(D, Vec3::Zero(), 1e-5);
          most = std::max(most, (point.sigma - before)[axis] / strain / point.stability.modulus);
        }
    out.figure = fmt::format("{:.3f} of it is felt", most);
    out.holds = most < 1.01;
    return out;
  }

  LawFinding tangent() const {
    LawFinding out{"tangent", "DDSDDE is the slope of the stress (where it is asked for)"};
    const auto error = tangent_error(material_);
    out.holds = !error || *error < 1e-2;
    out.figure = error ? fmt::format("{:.1e} of its largest number", *error) : "not told";
    return out;
  }

  LawFinding large_steps() const {
    LawFinding out{"large steps", "answers to strains of 0.001 to 1 in a step are numbers"};
    double largest = 0.0;
    for (const double size : {1e-3, 1e-2, 1e-1, 1.0}) {
      Random random{std::mt19937_64(17)};
      try {
        for (int i = 0; i < 100; ++i) {
          DrivenPoint point = started();
          point.move(size * random.tensor() / 1e-5, Vec3::Zero(), 1e-5);
          if (!point.sigma.allFinite())
            throw SolverError(Failure::not_finite, "the stress is no number");
        }
      } catch (const SolverError& error) {
        out.figure = fmt::format("up to {:g}; at {:g}: {}", largest, size, error.what());
        return out;
      }
      largest = size;
    }
    out.figure = "up to 1";
    out.holds = true;
    return out;
  }

  /// Two points turn by turn, and at once in two threads: each as if it were alone.
  LawFinding apart() const {
    LawFinding out{"apart",
                   "a point does not see what other points did (else thread_safe = false)"};
    const auto drive = [](DrivenPoint& point, int which, int i) {
      const double sign = which == 0 ? 1.0 : -0.5;
      point.move({0.2 * sign, 1.0, 0.1, sign, 0.0, std::sin(i)}, Vec3{0.0, 0.0, sign}, 1e-4);
    };
    const auto fresh = [&](int which) { return started((1.0 + which) * pressure); };
    constexpr int count = 200;
    std::array<SymTensor, 2> alone, in_turn, at_once;
    for (int w = 0; w < 2; ++w) {
      DrivenPoint point = fresh(w);
      for (int i = 0; i < count; ++i) drive(point, w, i);
      alone[static_cast<std::size_t>(w)] = point.sigma;
    }
    DrivenPoint one = fresh(0), other = fresh(1);
    for (int i = 0; i < count; ++i) drive(one, 0, i), drive(other, 1, i);
    in_turn = {one.sigma, other.sigma};
    bool same_at_once = true;
    for (int round = 0; round < 20 && same_at_once; ++round) {
      DrivenPoint a = fresh(0), b = fresh(1);
      std::thread helper([&] {
        for (int i = 0; i < count; ++i) drive(b, 1, i);
      });
      for (int i = 0; i < count; ++i) drive(a, 0, i);
      helper.join();
      at_once = {a.sigma, b.sigma};
      same_at_once = at_once == alone;
    }
    out.holds = in_turn == alone && same_at_once;
    out.figure = fmt::format("in turn {}, in two threads {}",
                             in_turn == alone ? "the same" : "other results",
                             same_at_once ? "the same" : "other results");
    return out;
  }

  LawFinding cost() const {
    LawFinding out{"cost", "of an update, in blocks"};
    constexpr std::size_t count = 1024;
    const auto body = material_registry().at(material_.word("material.law"))(material_);
    body->resize(count);
    const std::vector<InitialState> initial(count, InitialState{at_rest(pressure), e_, 1e-15});
    Batch batch(count);
    body->initialise(0, initial, batch);
    batch.in_plane = true;
    for (std::size_t i = 0; i < count; ++i)
      batch.steps.set(i,
                      Deformation{{0.1, 1.0, 0.0, 0.5, 0.0, 0.0}, {0.0, 0.0, 0.5}, 1e-6, e_, e_});
    using Clock = std::chrono::steady_clock;
    const auto begin = Clock::now();
    constexpr int rounds = 100;
    for (int i = 0; i < rounds; ++i) body->update(0, batch);
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    out.figure = fmt::format("{:.0f} ns", 1e9 * seconds / (rounds * static_cast<double>(count)));
    out.holds = true;
    return out;
  }

 private:
  DrivenPoint started(double p = pressure) const {
    DrivenPoint point(material_);
    point.start(p * SymTensor{0.9, 1.2, 0.9, 0, 0, 0}, e_);  // inside the cone of any sand
    return point;
  }

  const Case& material_;
  double e_;
};

}  // namespace

std::vector<LawFinding> test_law(const Case& material,
                                 const std::function<void(const std::string&)>& begins) {
  const Questions questions(material);
  std::vector<LawFinding> found;
  const auto put = [&](const char* name, LawFinding (Questions::*question)() const) {
    begins(name);
    try {
      found.push_back((questions.*question)());
    } catch (const SolverError& error) {
      found.push_back({name, "", error.what()});
    }
  };
  put("rest", &Questions::rest);
  put("objectivity", &Questions::objectivity);
  put("loops", &Questions::loops);
  put("dissipation", &Questions::dissipation);
  put("steps", &Questions::steps);
  put("modulus", &Questions::modulus);
  put("tangent", &Questions::tangent);
  put("large steps", &Questions::large_steps);
  put("apart", &Questions::apart);
  put("cost", &Questions::cost);
  return found;
}

}  // namespace grainpair
