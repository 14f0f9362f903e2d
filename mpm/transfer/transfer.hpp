// The choice among the transfer schemes at run time. A scheme is a file: what of the motion it
// carries, what a point's velocity becomes, and what becomes of what is carried.
#pragma once

#include "mpm/transfer/affine_flip.hpp"
#include "mpm/transfer/apic.hpp"
#include "mpm/transfer/flip.hpp"
#include "mpm/transfer/pic.hpp"
#include "mpm/transfer/xpic.hpp"

namespace grainpair {

// A scheme that is missing from the switch does not compile.
#pragma GCC diagnostic push
#pragma GCC diagnostic error "-Wswitch"
/// f(Transfer{}) with the policy of a scheme.
template <class F>
constexpr auto with_transfer(TransferScheme scheme, F&& f) {
  switch (scheme) {
    case TransferScheme::pic:
      return f(Pic{});
    case TransferScheme::flip:
      return f(Flip{});
    case TransferScheme::apic:
      return f(Apic{});
    case TransferScheme::affine_flip:
      return f(AffineFlip{});
    case TransferScheme::xpic:
      return f(Xpic{});
  }
  __builtin_unreachable();
}
#pragma GCC diagnostic pop

constexpr Affine affine_of(TransferScheme scheme) {
  return with_transfer(scheme, [](auto transfer) { return decltype(transfer)::affine; });
}

/// A point's new velocity from its old one, the grid's, and the grid's increment [m/s]. The branch
/// is the same for every point, so it costs next to nothing and keeps the gathering loop to two
/// instantiations. What a point has beside the grid's no cell sees, and no wall: in the spray at
/// the tip of a front, where every closing gap gives it a push, it would gather without bound. It
/// is held to `most`.
template <class Vec>
Vec transferred(TransferScheme scheme, const Vec& v_p, const Vec& grid_velocity,
                const Vec& increment, double filter, double most) {
  using Real = typename Vec::Scalar;
  const Vec v = with_transfer(scheme, [&](auto transfer) {
    return decltype(transfer)::velocity(v_p, grid_velocity, increment, filter);
  });
  const Vec own = v - grid_velocity;
  const Real square = own.squaredNorm();
  const auto wild = square > most * most;
  if (!any(wild)) return v;
  return grid_velocity + select(wild, most / sqrt(square), Real(1.0)) * own;
}

}  // namespace grainpair
