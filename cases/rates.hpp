// What a run takes of the machine, as measured: cases/rates.toml.
#pragma once

#include <string>

namespace grainpair {

/// A figure of the table by its dotted name, e.g. measured("continuum.seconds_per_step"). A name
/// that it lacks throws std::logic_error.
double measured(const std::string& name);

}  // namespace grainpair
