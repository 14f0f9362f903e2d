// What a run takes of the machine, as measured: cases/rates.toml; and what softening costs
// in accuracy.
#pragma once

#include <string>

namespace grainpair {

/// A figure of the table by its dotted name, e.g. measured("continuum.seconds_per_step"). A name
/// that it lacks throws std::logic_error.
double measured(const std::string& name);

/// Relative error of the headline figures, for all that is known, of a law (or of the `grains`)
/// softened to `weight` = rho g H/K: cases/softening.toml, between its rows linear and beyond the
/// last one in proportion.
double softening_error(const std::string& law, double weight);

}  // namespace grainpair
