// What a boundary does to a nodal velocity. A wall is a face of the grid; its normal is an axis.
#pragma once

#include <array>
#include <cmath>

#include "mpm/numbers/tensor.hpp"

namespace grainpair {

enum class Contact {
  roller,   // no motion through the wall, none away from it either; free along it
  fixed,    // no motion at all
  coulomb,  // no motion through the wall; free to leave; friction along it
};

struct Wall {
  Contact contact = Contact::roller;
  double friction = 0.0;  // of a coulomb wall [-]

  /// Velocity after contact; `side` is +1 where the body lies on the positive side of the wall,
  /// else -1.
  template <class Vec>
  Vec apply(Vec v, int axis, double side) const {
    if (contact == Contact::fixed) return Vec::Zero();
    if (contact == Contact::roller) {
      v[axis] = 0.0;
      return v;
    }
    const double approach = -side * v[axis];
    if (approach <= 0.0) return v;
    v[axis] = 0.0;
    // the tangential impulse is at most mu times the normal one, and no more than stops the slip
    const double slip = v.norm();
    if (slip > 0.0) v *= std::max(0.0, 1.0 - friction * approach / slip);
    return v;
  }
};

/// A gate at x = position, whose lower edge rises from y = edge: nothing passes it above that edge.
struct Gate {
  double position = 0.0, speed = 0.0;
  bool present = false;
  double edge = 0.0;
  bool closes(double x, double y, double time) const {
    return present && x >= position && y >= edge + speed * time;
  }
};

/// The bottom of a silo, its top at y = top, from x = begin on: three rows of nodes, the first half
/// a cell above its top. What lies on it then meets no node that moves through it, nor does what
/// has sunk by less than a cell: quadratic shape functions reach one and a half cells.
struct Shelf {
  double begin = 0.0, top = 0.0, cell = 0.0;
  Wall wall;
  bool present = false;
  bool holds(double x, double y) const {
    return present && x > begin && y < top + 0.75 * cell && y > top - 1.75 * cell;
  }
};

/// walls[axis][0] at the low end, [1] at the high end.
template <int Dim>
using Walls = std::array<std::array<Wall, 2>, Dim>;

}  // namespace grainpair
