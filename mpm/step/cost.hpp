// What a run will take, told from its case before anything is allocated.
#pragma once

#include <cstddef>

#include "cases/case.hpp"

namespace grainpair {

struct Cost {
  std::size_t points = 0, nodes = 0;
  double bytes = 0.0;                // of memory
  double time_step = 0.0;            // the first [s]
  double steps = 0.0, frames = 0.0;  // to time.maximum; a run that comes to rest takes fewer
  double seconds = 0.0;              // of one processor, at the rates of cases/rates.toml
  double disk = 0.0;                 // [bytes]
};

/// Throws CaseError where the case's grid does not fit.
Cost estimate(const Case& scene);

/// Throws CaseError where a run takes more memory than there is.
void refuse_more_than_there_is(const Cost& cost, const Case& scene);

}  // namespace grainpair
