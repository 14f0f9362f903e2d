// A simulation as output, watch and driver see it, whatever its dimension, law and shape functions;
// and the way from a case to one that is ready to step.
#pragma once

#include <memory>
#include <optional>

#include "cases/case.hpp"
#include "mpm/points/numerics.hpp"
#include "mpm/points/packing.hpp"
#include "mpm/points/points.hpp"
#include "mpm/step/ledger.hpp"
#include "mpm/step/ranks.hpp"

namespace grainpair {

/// Processor time that the parts of steps took [s].
struct StageTimes {
  double to_grid = 0.0, to_points = 0.0, update = 0.0;
};

class Simulation {
 public:
  virtual ~Simulation() = default;
  virtual TimeStep stable_step() const = 0;
  virtual void step(double dt) = 0;
  /// The same, and adds up where the time goes.
  virtual void step(double dt, StageTimes& times) = 0;
  /// All that later steps depend on. A simulation that is put back so goes on to the last bit.
  virtual void archive(Archive& to) = 0;
  virtual double time() const = 0;
  /// Of all ranks.
  virtual const EnergyLedger& ledger() const = 0;
  virtual const Ranks& ranks() const { return alone(); }
  /// Points of the fullest rank over the mean, of all steps so far.
  virtual double imbalance() const { return 1.0; }
  virtual double solid_density() const = 0;  // [kg/m3]
  /// Across the plane at x, of plane strain or all the way round; of space 1 [m], [-].
  virtual double depth(double x) const = 0;
  /// Whether elastic and plastic energy are figures of the law's own.
  virtual bool tells_energies() const { return true; }
  /// Position and velocity of the point at place p, with zeros for the axes the grid lacks.
  virtual Vec3 position(std::size_t p) const = 0;
  virtual Vec3 velocity(std::size_t p) const = 0;
  /// What averaging adds to the pressure of that point in the stress that the grid feels [Pa].
  virtual double pressure_correction(std::size_t p) const = 0;
  /// The part of that point's pressure that collisions make; they may pull [Pa].
  virtual double collisional_pressure(std::size_t p) const = 0;
  virtual const Points<2>* plane() const { return nullptr; }
  virtual const Points<3>* space() const { return nullptr; }

  /// Calls f with the points, of either dimension; their places are points.occupied().
  template <class F>
  void visit_points(F&& f) const {
    if (plane()) return f(*plane());
    f(*space());
  }
  /// How many points there are, of this rank.
  std::size_t size() const {
    std::size_t count = 0;
    visit_points([&](const auto& points) { count = points.occupied().size(); });
    return count;
  }
};

/// What a case leaves open about its start: the seed of mpm.jitter, and the packing if
/// initial.state asks for one.
struct Start {
  unsigned seed = 1;
  std::optional<Packing> packing = std::nullopt;
};

/// Builds the column of a case, or a rank's share of it. Throws CaseError.
std::unique_ptr<Simulation> make_simulation(const Case& scene, const Start& start,
                                            const Ranks& ranks = alone());

/// sqrt(H/g) [s], the unit of the case's times.
double time_scale(const Case& scene);

}  // namespace grainpair
