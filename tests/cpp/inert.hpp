// A law for tests of what is not the law's.
#pragma once

#include "mpm/materials/body_of.hpp"

namespace grainpair::test {

/// A law without stress: what is left is the transfer, the grid and the walls.
struct Inert : Athermal {
  template <class Real>
  struct State {
    Real none = 0.0;
  };
  explicit Inert(const Case&) {}
  Response<double, State> initial(const InitialState&) const { return respond<double>(); }
  template <class Real>
  Response<Real, State> update(const State<Real>&, const DeformationOf<Real>&) const {
    return respond<Real>();
  }
  template <class Real>
  StabilityOf<Real> stability(const State<Real>&, const Real&) const {
    return {1.0, 0.0};
  }

 private:
  template <class Real>
  static Response<Real, State> respond() {
    Response<Real, State> r;
    r.sigma = Tensor<Real>::Zero();
    return r;
  }
};

}  // namespace grainpair::test
