// Rings: what a kernel is in cells that are rings about the axis x = 0, over radius and height.
//
// A ring of cells sees a point through the kernel's mean over all angles between them. Of a
// three-dimensional Gaussian of width w that is, but for factors that hold for all cells alike,
//   K(r, y) = phi(r - r_p, y - y_p) exp(-z) I0(z),   z = r r_p / w^2,
// phi the kernel in the plane and I0 the modified Bessel function; far from the axis
// exp(-z) I0(z) is 1 / sqrt(2 pi z). K is the same seen from either side, so a packing that is
// uniform in space stays uniform up to the axis, where nothing has to be folded back.
// DEVIATION: kernels of other shapes get the Gaussian's factor of their width, and a branch that of
// its middle, since their means over the angle have no closed form; what is summed over the cells
// stays exact, and far from the axis they are the kernels of the plane.
#pragma once

#include <cmath>
#include <numbers>

#include "compare/mapping/coarse_grain.hpp"

namespace grainpair {

/// exp(-z) I0(z), z >= 0: within 2e-10 of it, relative.
inline double mean_over_angles(double z) {
  if (z < 40.0) return std::exp(-z) * std::cyl_bessel_i(0.0, z);
  const double u = 0.125 / z;  // Hankel's expansion
  return (1.0 + u * (1.0 + u * (4.5 + u * (37.5 + u * (459.375 + u * 7441.875))))) /
         std::sqrt(2.0 * std::numbers::pi * z);
}

/// The factor of a ring of cells of radius r for a point of radius r_p [m]; none lies beyond the
/// axis.
template <int D>
double ring_factor(const SampleGrid<D>& grid, double r, double r_p) {
  return r > 0.0 ? mean_over_angles(r * r_p / (grid.width * grid.width)) : 0.0;
}

/// Adds to a velocity gradient what a velocity V at radius r [m] has along the angle:
/// v_r / r in the direction of it, -v_angle / r across.
inline void add_hoop(double r, const Vec3& V, Mat3& gradient) {
  gradient(0, 2) = -V[2] / r, gradient(2, 2) = V[0] / r;
}

}  // namespace grainpair
