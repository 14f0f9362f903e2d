#pragma once

#include "mpm/grid/interpolation.hpp"
#include "mpm/transfer/scheme.hpp"

namespace grainpair {

/// Affine particle in cell [Jiang2015]: PIC with the moment B = sum_i w_i v_i (X_i - x)^T carried
/// along, so that angular momentum survives the round trip.
struct Apic {
  static constexpr Affine affine = Affine::moment;
  template <class Vec>
  static Vec velocity(const Vec& /*v_p*/, const Vec& grid_velocity, const Vec& /*increment*/,
                      double /*filter*/) {
    return grid_velocity;
  }

  /// B, afresh from the nodes.
  template <int Dim, class Real, class Axes>
  static MatrixOf<Dim, Real> carried(const MatrixOf<Dim, Real>& /*own*/,
                                     const Collected<Dim, Real>& nodes, const Axes& /*n*/,
                                     double /*filter*/, double /*dt*/) {
    return nodes.moment;
  }
};

}  // namespace grainpair
