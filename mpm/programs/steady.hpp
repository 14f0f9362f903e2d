// Steady simple shear at constant pressure: what a law answers to the conditions of a flow.
//
// A material point is sheared at a constant rate while its volume gives way so that its pressure
// stays, until stress, void ratio and granular temperature stay too. Where a granular temperature
// is imposed the point is held at it: the law's own balance of fluctuations is left aside.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "cases/case.hpp"

namespace grainpair {

struct Condition {
  double pressure;              // p = tr(sigma)/3 [Pa]
  double shear_rate;            // gdot = sqrt(2 dev D : dev D) [1/s]
  double granular_temperature;  // imposed [m2/s2]; NaN where the law's own
};

/// Change per unit of strain that counts as none.
inline constexpr double steady_change = 1e-3;

/// Of each condition, means over the last unit of strain.
struct SteadyShear {
  std::vector<double> shear_stress;          // s : D/gdot [Pa]
  std::vector<double> deviatoric_stress;     // |s| = sqrt(s : s/2) [Pa]
  std::vector<double> void_ratio;            // [-]
  std::vector<double> granular_temperature;  // [m2/s2]
  std::vector<double> dissipation;           // in all accounts [W/m3]
  std::vector<double>
      change;  // of stress, volume or granular temperature over the last unit of strain [-]
};

/// Drives a point for each condition, all of them together.
SteadyShear steady_shear(const Case& material, std::span<const Condition> conditions);

/// Reads conditions, the datasets pressure, shear_rate and, where it is imposed,
/// granular_temperature. Throws CaseError.
std::vector<Condition> read_conditions(const std::string& file);

/// Writes the answers beside their conditions; the file appears whole or not at all.
void write(const SteadyShear& answers, std::span<const Condition> conditions, const Case& material,
           const std::string& file);

}  // namespace grainpair
