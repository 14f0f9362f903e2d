// The numerical choices of a run, and the step they allow.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "mpm/transfer/scheme.hpp"

namespace grainpair {

enum class StressUpdate { first, last, musl };
enum class Limit { none = 0, elastic = 1, critical_state = 2, viscous = 3 };

struct Numerics {
  double h = 0.0;  // cell size [m]
  TransferScheme transfer = TransferScheme::affine_flip;
  double velocity_relaxation = 0.0;  // of flip and affine_flip, and ... [s]
  double gradient_relaxation = 0.0;  // ... of the gradient of affine_flip [s]
  double most_own_speed = std::numeric_limits<double>::infinity();  // see transferred() [m/s]
  double void_ratio_relaxation = 0.0;                               // within cells; 0: none [s]
  double volume_relaxation = 0.0;  // shear strain, to the room there is; 0: none [-]
  int xpic_order = 2;
  StressUpdate stress_update = StressUpdate::last;
  bool averaging = true;    // of volumetric rates and pressures over cells
  bool conduction = false;  // of granular temperature
  double time_step_fraction = 0.5;

  /// Whether points take the mean volumetric rate or the mean void ratio of their cells.
  bool averages_rates() const { return averaging || void_ratio_relaxation > 0.0; }
  /// Whether points change their volume beside what they are strained.
  bool changes_volumes() const { return averages_rates() || volume_relaxation > 0.0; }
  /// Whether the internal force takes the mean pressure of a point's cell.
  bool averages_pressures() const { return averaging; }
};

/// Fraction of the way that a step takes a relaxation of time tau; without one, none.
inline double relaxed(double dt, double tau) { return tau > 0.0 ? -std::expm1(-dt / tau) : 0.0; }

struct TimeStep {
  double dt = 0.0;  // [s]
  Limit limit = Limit::none;
  std::uint32_t point = 0;  // id of the point that limits
};

}  // namespace grainpair
