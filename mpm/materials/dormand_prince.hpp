// The quasi-static half integrated as the seed integrates it: rates, Dormand-Prince 5(4) with
// error-controlled substeps, and correction of the drift from the cone and the critical-state locus
// [Dormand1980, Sloan2001].
//
// The elastic part of a step is taken in closed form. Regimes change between substeps only; a
// substep that crosses the locus or meets e_c is shortened to end there.
#pragma once

#include "mpm/materials/quasi_static.hpp"

namespace grainpair {

class DormandPrince {
 public:
  explicit DormandPrince(const QuasiStatic& model, double relative_tolerance = 1e-6)
      : model_(model), tolerance_(relative_tolerance) {}

  /// One step, as QuasiStatic::implicit.
  QuasiStaticResponse<double> operator()(const QuasiStaticState<double>& old,
                                         const SymTensor& increment, double e_old, double e) const;
  /// The same for several points, one after the other.
  QuasiStaticResponse<Wide> operator()(const QuasiStaticState<Wide>& old,
                                       const WideTensor& increment, const Wide& e_old,
                                       const Wide& e) const;

 private:
  QuasiStatic model_;
  double tolerance_;
};

}  // namespace grainpair
