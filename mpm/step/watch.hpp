// What a run may not do, watched while it goes on. A trouble no result survives ends the run with a
// line that names it; one that only spoils the result is kept as a warning. Thresholds are shares
// of what the scene itself offers: the energy held at the release, the speed of free fall from the
// column's height, the pressure that is there.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "mpm/step/simulation.hpp"

namespace grainpair {

class Watch {
 public:
  /// The scene's measures [m], [m/s2].
  struct Column {
    double height, gravity, floor_length;
  };
  /// `cell` [m]: points of one cell are compared with one another.
  Watch(const Simulation& simulation, const Column& column, double cell);

  /// Between looks at every point [sqrt(H/g)]: a look takes as long as three steps.
  static constexpr double interval = 0.05;

  /// Share of the stable step to take: halved whenever the finite step has made another
  /// fiftieth of the energy held at release out of nothing.
  double step_share() const { return std::ldexp(1.0, -halvings_); }

  /// After every step. Throws SolverError: not finite, energy growth.
  void step(const Simulation& simulation, long steps);

  /// At every row of the energy history. Throws SolverError for a point no fall could have made so
  /// fast; gathers warnings.
  void points(const Simulation& simulation);

  /// What it has seen so far.
  void archive(Archive& to);

  /// What spoils the result without ending it, one line each that starts with the warning's name;
  /// the end of the run is the time to ask.
  std::vector<std::string> warnings(const EnergyLedger& begin, const EnergyLedger& end) const;

 private:
  /// Held at release, and what gravity has put in since along a slope [J].
  double offered(const EnergyLedger& now) const { return held_ + slope_ - now.slope; }

  double held_, slope_, mass_ = 0.0, fall_, tau_, pressure_, cell_, last_cell_;
  double created_ = 0.0, peak_ = 0.0;
  double noise_ = 0.0, roughness_ = 0.0, crowding_ = 0.0, tension_ = 0.0, at_end_ = 0.0;
  long rough_looks_ = 0;
  bool estimated_;  // energies
  int halvings_ = 0;
  double first_halved_ = 0.0;  // [s]
};

}  // namespace grainpair
