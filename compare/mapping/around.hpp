// Directions about an axis.
#pragma once

#include <cmath>

#include "mpm/numbers/tensor.hpp"

namespace grainpair {

/// Radial and angular directions about the axis x = z = 0, where a place is.
class Around {
 public:
  explicit Around(const Vec3& place) {
    const double r = std::hypot(place[0], place[2]);
    if (r > 0.0) cos_ = place[0] / r, sin_ = place[2] / r;
  }
  /// The components r, y, angle of a vector.
  Vec3 operator()(const Vec3& v) const {
    return {cos_ * v[0] + sin_ * v[2], v[1], cos_ * v[2] - sin_ * v[0]};
  }

 private:
  double cos_ = 1.0, sin_ = 0.0;
};

}  // namespace grainpair
