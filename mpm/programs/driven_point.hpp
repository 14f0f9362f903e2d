// One point of a law, driven step by step.
#pragma once

#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "cases/case.hpp"
#include "mpm/points/body.hpp"

namespace grainpair {

/// A body of one point, and what it answered last.
class DrivenPoint {
 public:
  explicit DrivenPoint(const Case& material)
      : body_(material_registry().at(material.word("material.law"))(material)) {
    body_->resize(1);
  }
  void start(const SymTensor& stress, double e, double initial_temperature = 1e-15) {
    void_ratio = e;
    const InitialState initial{stress, e, initial_temperature};
    body_->initialise(0, {&initial, 1}, batch_);
    keep_results();
  }
  void move(const SymTensor& D, const Vec3& spin, double dt) {
    const Deformation step{D, spin, dt, void_ratio,
                           (1.0 + void_ratio) * std::exp(-trace(D) * dt) - 1.0};
    void_ratio = step.void_ratio;
    batch_.steps.set(0, step);
    body_->update(0, batch_);
    keep_results();
  }

  double void_ratio = 0.0;
  SymTensor sigma = SymTensor::Constant(NAN);
  Energies energies{};
  double work = NAN, temperature = NAN;
  Stability stability{};
  int regime = 255;

  double held() const { return energies.stored + energies.fluctuation; }
  double dissipated() const { return energies.plastic + energies.regime_4 + energies.contact; }

 private:
  void keep_results() {
    sigma = batch_.sigma[0], energies = batch_.energies[0], stability = batch_.stability[0];
    work = batch_.work[0], temperature = batch_.granular_temperature[0];
    regime = batch_.regime[0];
  }
  Batch batch_{1};
  std::unique_ptr<Body> body_;
};

struct Random {
  std::mt19937_64 engine;
  std::normal_distribution<double> normal{};
  std::uniform_real_distribution<double> uniform{0.0, 1.0};

  SymTensor tensor() {
    SymTensor a;
    for (double& x : a) x = normal(engine);
    return a;
  }
  Vec3 vector() { return Vec3{normal(engine), normal(engine), normal(engine)}; }
  double between(double a, double b) { return a + (b - a) * uniform(engine); }
};

/// Under its own weight, K0 = 1/2, of mean pressure p.
inline SymTensor at_rest(double p) { return p * SymTensor{0.75, 1.5, 0.75, 0, 0, 0}; }

}  // namespace grainpair
