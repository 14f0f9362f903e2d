// The Lade-Duncan cone [LadeDuncan1975] and the closed return of an elastic strain to it.
//
// With eta = s/p, elastic where f < 0:
//     f(eta) = eta:eta/2 - tr(eta^3)/3 - C,  C = M_c^2/3 - 2 M_c^3/27,
//     normal in the deviatoric plane a = eta - dev(eta.eta) .
// This is I1^3 - kappa I3 = 0, kappa = 27/(1 - C), in dimensionless form.
//
// In the deviatoric plane write eta as the complex number w whose real axis is the trial direction,
// at Lode angle theta: eta.eta -> conj(w)^2 exp(-3i theta)/sqrt6, tr(eta^3) -> Re(w^3 exp(3i
// theta))/sqrt6. Only cos 3theta and sin 3theta of the trial are needed: no angles, no
// eigenvectors.
#pragma once

#include <algorithm>
#include <cmath>

#include "mpm/case.hpp"
#include "mpm/materials/hyperelastic.hpp"
#include "mpm/tensor.hpp"

namespace grainpair {

/// Result of a return: the deviatoric elastic strain on the cone, the size a of the cone's section
/// it lies on, and the length of the plastic deviatoric strain. Not converged: the return of the
/// trial along the radius instead.
struct ConeReturn {
  SymTensor deviatoric;
  double volumetric;  // a, elastic volumetric strain counted from zero stress
  double multiplier;  // |dev eps_p|
  int iterations;
  bool converged;
};

class LadeDuncan {
 public:
  explicit LadeDuncan(const Case& c) : LadeDuncan(c.number("material.stress_ratio")) {}
  explicit LadeDuncan(double stress_ratio)
      : offset(stress_ratio * stress_ratio / 3.0 - 2.0 * std::pow(stress_ratio, 3) / 27.0) {
    // |eta| at the corners: compression sqrt(2/3) M_c; extension x^2/2 + x^3/(3 sqrt6) = C, by
    // Newton from above
    const double compression = std::sqrt(2.0 / 3.0) * stress_ratio;
    double x = std::sqrt(2.0 * offset);
    for (int i = 0; i < 50; ++i)
      x -= (x * x * (0.5 + x * inv_root6 / 3.0) - offset) / (x * (1.0 + x * inv_root6));
    corners_ = 1.0 / compression + 1.0 / x;
    spread_ = 1.0 / x - 1.0 / compression;
  }

  double kappa() const { return 27.0 / (1.0 - offset); }

  /// f of a stress ratio eta = s/p, a deviator [-].
  double yield(const SymTensor& eta) const {
    return 0.5 * eta.squaredNorm() - determinant(eta) - offset;
  }

  /// Whether eta lies inside or on the cone, and on the sheet that holds eta = 0.
  bool holds(const SymTensor& eta) const {
    // f <= 0 makes det(I + eta) positive; |eta|^2 < 6 its second invariant: no two principal
    // stresses negative.
    return eta.squaredNorm() < 6.0 && yield(eta) <= 0.0;
  }

  /// a = eta - dev(eta.eta), parallel to dev(df/dsigma).
  static SymTensor normal(const SymTensor& eta) { return eta - deviator(square(eta)); }

  /// Returns the trial's deviator along the cone's normal, with `ratio` = plastic volumetric strain
  /// per unit of plastic deviatoric strain (compression positive, 0: isochoric). Closest point in
  /// the deviatoric plane when isochoric. The trial lies outside and a_trial > 0. multiplier is
  /// negative in no case; volumetric <= 0 means that contraction has taken all the pressure away.
  ConeReturn along_flow(const Hyperelastic& elasticity, const SymTensor& trial_deviator,
                        double trial_a, double ratio) const {
    if (ratio == 0.0)
      return project(elasticity, trial_deviator, trial_a, [](const Iterate&) {
        return Size{1.0, 0.0, 0.0, 0.0};
      });
    if (ratio > 0.0 && ratio * trial_deviator.norm() >= trial_a)
      return {SymTensor::Zero(), 0.0, trial_deviator.norm(), 0, true};
    // a/a_trial = 1 - b m |N|
    const double b = ratio / elasticity.coupling;
    return project(elasticity, trial_deviator, trial_a, [b](const Iterate& z) {
      const double length = std::sqrt(z.nx * z.nx + z.ny * z.ny), slope = -b * z.m / length;
      return Size{1.0 - b * z.m * length, slope * (z.hxx * z.nx + z.hxy * z.ny),
                  slope * (z.hxy * z.nx + z.hyy * z.ny), -b * length};
    });
  }

  /// The same to the section of the cone at the pressure p [Pa]. The multiplier is negative where
  /// the trial lies inside that section.
  ConeReturn at_pressure(const Hyperelastic& elasticity, const SymTensor& trial_deviator,
                         double p) const {
    const double c = elasticity.coupling, n = elasticity.n;
    // a = a_axis (1 + |eta|^2/c)^(-n/2), with a_axis = (p/pa)^(1-n)/(k(1-n))
    return project(elasticity, trial_deviator, elasticity.size(p), [c, n](const Iterate& z) {
      const double r2 = (z.x * z.x + z.y * z.y) / c;
      const double size = n == 0.5   ? 1.0 / std::sqrt(std::sqrt(1.0 + r2))
                          : n == 0.0 ? 1.0
                                     : std::pow(1.0 + r2, -0.5 * n);
      const double slope = -n * size / (c * (1.0 + r2));
      return Size{size, slope * z.x, slope * z.y, 0.0};
    });
  }

  double offset;  // C

 private:
  static constexpr double inv_root6 = 0.40824829046386301637;
  double corners_, spread_;  // of 1/|eta| along the cone

  struct Iterate {
    double x, y, m;        // w = x + i y and the multiplier
    double nx, ny;         // N, the normal at w
    double hxx, hxy, hyy;  // dN/dw
  };
  struct Size {
    double value, dx, dy, dm;  // a/a_ref and its derivatives
  };

  /// Newton on  (a/a_ref) w + m N(w) = r,  f(w) = 0, where r = c |trial|/a_ref is real.
  template <class SizeOf>
  ConeReturn project(const Hyperelastic& elasticity, const SymTensor& trial, double a_ref,
                     SizeOf size_of) const {
    const double length = trial.norm();
    if (!(length > 0.0)) return {trial, a_ref, -1.0, 0, true};
    const SymTensor direction = trial / length;
    const double cosine = std::clamp(3.0 / inv_root6 * determinant(direction), -1.0, 1.0);
    const double sine = std::sqrt(1.0 - cosine * cosine);
    const double r = elasticity.coupling * length / a_ref;

    // Start on the cone along the radius, x^2/2 - cosine x^3/(3 sqrt6) = C: one Newton step from
    // the chord between the corners, 1/x linear in the cosine.
    Iterate z{2.0 / (corners_ - spread_ * cosine), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    const double t = cosine * z.x * inv_root6;
    z.x -= (z.x * z.x * (0.5 - t / 3.0) - offset) / (z.x * (1.0 - t));
    const double radial = z.x;
    const auto differentiate = [&] {
      // conj(w)^2 exp(-3i theta) = ((x^2 - y^2) - 2 i x y)(cosine - i sine)
      const double re = z.x * z.x - z.y * z.y, im = -2.0 * z.x * z.y;
      z.nx = z.x - inv_root6 * (re * cosine + im * sine);
      z.ny = z.y - inv_root6 * (im * cosine - re * sine);
      const double br = 2.0 * inv_root6 * (z.x * cosine - z.y * sine);
      const double bi = -2.0 * inv_root6 * (z.x * sine + z.y * cosine);
      z.hxx = 1.0 - br, z.hxy = -bi, z.hyy = 1.0 + br;
    };
    differentiate();
    Size a = size_of(z);
    if (r <= a.value * z.x) return {trial, a_ref, r < a.value * z.x ? -1.0 : 0.0, 0, true};
    z.m = (r - a.value * z.x) * z.nx / (z.nx * z.nx + z.ny * z.ny);
    a = size_of(z);

    constexpr int most = 30;
    constexpr double tolerance = 1e-13;
    bool converged = false;
    int i = 0;
    for (; i < most && !converged; ++i) {
      const double fx = a.value * z.x + z.m * z.nx - r, fy = a.value * z.y + z.m * z.ny;
      const double re = z.x * z.x - z.y * z.y, im = 2.0 * z.x * z.y;  // w^2
      const double cubic =
          (re * z.x - im * z.y) * cosine - (re * z.y + im * z.x) * sine;  // Re(w^3 e^{3i theta})
      const double f = 0.5 * (z.x * z.x + z.y * z.y) - inv_root6 / 3.0 * cubic - offset;
      const double gx = z.nx + z.x * a.dm, gy = z.ny + z.y * a.dm;
      const double axx = a.value + z.m * z.hxx + z.x * a.dx, axy = z.m * z.hxy + z.x * a.dy;
      const double ayx = z.m * z.hxy + z.y * a.dx, ayy = a.value + z.m * z.hyy + z.y * a.dy;
      // [A g; N 0][dw; dm] = -[F; f], with U = adj(A) F and V = adj(A) g
      const double det = axx * ayy - axy * ayx;
      const double ux = ayy * fx - axy * fy, uy = axx * fy - ayx * fx;
      const double vx = ayy * gx - axy * gy, vy = axx * gy - ayx * gx;
      const double dm = (f * det - z.nx * ux - z.ny * uy) / (z.nx * vx + z.ny * vy),
                   inverse = 1.0 / det;
      const double dx = -(ux + vx * dm) * inverse, dy = -(uy + vy * dm) * inverse;
      z.x += dx, z.y += dy, z.m += dm;
      differentiate();
      a = size_of(z);
      // Newton converges quadratically: the step after this one would be below round-off.
      converged = dx * dx + dy * dy < tolerance && dm * dm < tolerance * (1.0 + z.m * z.m);
    }
    converged = converged && a.value > 0.0 && z.m >= 0.0 && z.x > 0.0;
    if (!converged) z.x = radial, z.y = 0.0, differentiate(), z.m = 0.0, a = size_of(z);

    // i times the direction, from dev(direction^2) = (cosine - i sine) direction/sqrt6; y ~ sine
    const double scale = a.value * a_ref / elasticity.coupling;
    ConeReturn result{scale * z.x * direction, a.value * a_ref,
                      z.m * std::sqrt(z.nx * z.nx + z.ny * z.ny) * a_ref / elasticity.coupling, i,
                      converged};
    if (z.y != 0.0 && sine > 0.0)
      result.deviatoric +=
          scale * z.y / sine * (cosine * direction - deviator(square(direction)) / inv_root6);
    return result;
  }
};

}  // namespace grainpair
