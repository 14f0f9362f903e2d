// What a sweep over points sums up, and what it sweeps over.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mpm/points/material.hpp"

namespace grainpair {

/// Points that are taken together.
struct Strip {
  std::size_t begin, end;
  std::size_t size() const { return end - begin; }
};

/// The point that allows the smallest step.
struct Fastest {
  double rate = 0.0;  // 2/dt [1/s]
  Limit limit = Limit::none;
  std::uint32_t point = 0;  // its id
};

/// Sums over the points of a strip, lane by lane until they are asked for; kept by strip so that
/// their order never changes.
struct PointSums {
  EnergiesOf<Wide> energies;  // stored and fluctuation held; what is dissipated is of the step [J]
  Wide mixing = 0.0, potential = 0.0;          // [J]
  double detached = 0.0;                       // [J]
  std::ptrdiff_t inverted = -1, escaped = -1;  // points that ended the run
  Fastest fastest;
};

}  // namespace grainpair
