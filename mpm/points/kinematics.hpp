// What a step does to the volume of points.
#pragma once

#include "mpm/points/material.hpp"

namespace grainpair {

/// det(I + grad u) of a displacement with symmetric part -strain (compression positive) and
/// rotation vector w, so that the skew part of grad u times a is w x a:  det(A + [w]x) = det A +
/// w.A.w for a symmetric A = I - strain.
template <class Where>
Wide stretched_volume(const WideTensor& strain, const Eigen::Matrix<Wide, 3, 1>& w) {
  const WideTensor a = plus_isotropic(Wide(-1.0) * strain, Wide(1.0));
  if constexpr (std::is_same_v<Where, InPlane>)
    return (a[0] * a[1] - 0.5 * a[3] * a[3] + w[2] * w[2]) * a[2];
  Wide turned = 0.0;  // w.A.w
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) turned += w[i] * component(a, i, j) * w[j];
  return determinant(a) + turned;
}

}  // namespace grainpair
