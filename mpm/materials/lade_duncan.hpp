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

#include <cmath>

#include "cases/case.hpp"
#include "mpm/materials/hyperelastic.hpp"
#include "mpm/numbers/tensor.hpp"

namespace grainpair {

/// Result of a return: the deviatoric elastic strain on the cone, the size a of the cone's section
/// it lies on, and the length of the plastic deviatoric strain. Not converged: the return of the
/// trial along the radius instead.
template <class T>
struct ConeReturn {
  using Real = typename T::Scalar;
  T deviatoric;
  Real volumetric;  // a, elastic volumetric strain counted from zero stress
  Real multiplier;  // |dev eps_p|
  Real iterations;
  Mask<Real> converged;
};
template <class Real, class T = Tensor<Real>>
ConeReturn<T> select(const Mask<Real>& m, const ConeReturn<T>& yes, const ConeReturn<T>& no) {
  return {select(m, yes.deviatoric, no.deviatoric), select(m, yes.volumetric, no.volumetric),
          select(m, yes.multiplier, no.multiplier), select(m, yes.iterations, no.iterations),
          (m && yes.converged) || (!m && no.converged)};
}

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
  template <class T>
  typename T::Scalar yield(const T& eta) const {
    return 0.5 * eta.squaredNorm() - determinant(eta) - offset;
  }

  /// Whether eta lies inside or on the cone, and on the sheet that holds eta = 0.
  template <class T>
  Mask<typename T::Scalar> holds(const T& eta) const {
    // f <= 0 makes det(I + eta) positive; |eta|^2 < 6 its second invariant: no two principal
    // stresses negative.
    return eta.squaredNorm() < 6.0 && yield(eta) <= 0.0;
  }

  /// a = eta - dev(eta.eta), parallel to dev(df/dsigma).
  template <class T>
  static Tensor<typename T::Scalar> normal(const T& eta) {
    return eta - deviator(square(eta));
  }

  /// Returns the trial's deviator along the cone's normal, with `ratio` = plastic volumetric strain
  /// per unit of plastic deviatoric strain (compression positive, 0: isochoric). Closest point in
  /// the deviatoric plane when isochoric. The trial lies outside and a_trial > 0. multiplier is
  /// negative in no case; volumetric <= 0 means that contraction has taken all the pressure away.
  template <class T, class Real = typename T::Scalar>
  ConeReturn<T> along_flow(const Hyperelastic& elasticity, const T& trial_deviator,
                           const Real& trial_a, const std::type_identity_t<Real>& ratio,
                           const Mask<Real>& wanted = Mask<Real>(true)) const {
    if (!any(wanted && ratio != 0.0))
      return project(elasticity, trial_deviator, trial_a, wanted, [](const Iterate<Real>&) {
        return Size<Real>{1.0, 0.0, 0.0, 0.0};
      });
    const Real length = trial_deviator.norm();
    const auto spent = ratio > 0.0 && ratio * length >= trial_a;
    // a/a_trial = 1 - b m |N|
    const Real b = ratio / elasticity.coupling;
    const auto back =
        project(elasticity, trial_deviator, trial_a, wanted && !spent, [b](const Iterate<Real>& z) {
          const Real normal = sqrt(z.nx * z.nx + z.ny * z.ny), slope = -b * z.m / normal;
          return Size<Real>{1.0 - b * z.m * normal, slope * (z.hxx * z.nx + z.hxy * z.ny),
                            slope * (z.hxy * z.nx + z.hyy * z.ny), -b * normal};
        });
    return select<Real>(spent, {T::Zero(), 0.0, length, 0.0, spent}, back);
  }

  /// The same to the section of the cone at the pressure p [Pa]. The multiplier is negative where
  /// the trial lies inside that section.
  template <class T, class Real = typename T::Scalar>
  ConeReturn<T> at_pressure(const Hyperelastic& elasticity, const T& trial_deviator, const Real& p,
                            const Mask<Real>& wanted = Mask<Real>(true)) const {
    const double c = elasticity.coupling, n = elasticity.n;
    // a = a_axis (1 + |eta|^2/c)^(-n/2), with a_axis = (p/pa)^(1-n)/(k(1-n))
    return project(elasticity, trial_deviator, elasticity.size(p), wanted,
                   [n, inverse_c = 1.0 / c](const Iterate<Real>& z) {
                     const Real r2 = (z.x * z.x + z.y * z.y) * inverse_c;
                     if (n == 0.5) {
                       const Real size = 1.0 / sqrt(sqrt(1.0 + r2)), size2 = size * size;
                       const Real slope = (-n * inverse_c) * (size * size2 * size2);
                       return Size<Real>{size, slope * z.x, slope * z.y, 0.0};
                     }
                     const Real size = n == 0.0 ? Real(1.0) : power(1.0 + r2, -0.5 * n);
                     const Real slope = (-n * inverse_c) * size / (1.0 + r2);
                     return Size<Real>{size, slope * z.x, slope * z.y, 0.0};
                   });
  }

  double offset;  // C

 private:
  static constexpr double inv_root6 = 0.40824829046386301637;
  double corners_, spread_;  // of 1/|eta| along the cone

  template <class Real>
  struct Iterate {
    Real x, y, m;        // w = x + i y and the multiplier
    Real nx, ny;         // N, the normal at w
    Real hxx, hxy, hyy;  // dN/dw
  };
  template <class Real>
  struct Size {
    Real value, dx, dy, dm;  // a/a_ref and its derivatives
  };

  /// Newton on  (a/a_ref) w + m N(w) = r,  f(w) = 0, where r = c |trial|/a_ref is real, for the
  /// points that are wanted.
  /// long: residual, derivatives and solution of one system in three unknowns share their names.
  template <class T, class SizeOf, class Real = typename T::Scalar>
  ConeReturn<T> project(const Hyperelastic& elasticity, const T& trial, const Real& a_ref,
                        const Mask<Real>& wanted, SizeOf size_of) const {
    const Real length = trial.norm();
    const T direction = (1.0 / length) * trial;
    const Real cosine = clamped(3.0 / inv_root6 * determinant(direction), Real(-1.0), Real(1.0));
    const Real sine = sqrt(1.0 - cosine * cosine);
    const Real r = elasticity.coupling * length / a_ref;

    // Start on the cone along the radius, x^2/2 - cosine x^3/(3 sqrt6) = C: one Newton step from
    // the chord between the corners, 1/x linear in the cosine.
    Iterate<Real> z{2.0 / (corners_ - spread_ * cosine), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    const Real t = cosine * z.x * inv_root6;
    z.x -= (z.x * z.x * (0.5 - t * (1.0 / 3)) - offset) / (z.x * (1.0 - t));
    const Real radial = z.x;
    const auto differentiate = [&] {
      // conj(w)^2 exp(-3i theta) = ((x^2 - y^2) - 2 i x y)(cosine - i sine)
      const Real re = z.x * z.x - z.y * z.y, im = -2.0 * z.x * z.y;
      z.nx = z.x - inv_root6 * (re * cosine + im * sine);
      z.ny = z.y - inv_root6 * (im * cosine - re * sine);
      const Real br = 2.0 * inv_root6 * (z.x * cosine - z.y * sine);
      const Real bi = -2.0 * inv_root6 * (z.x * sine + z.y * cosine);
      z.hxx = 1.0 - br, z.hxy = -bi, z.hyy = 1.0 + br;
    };
    differentiate();
    Size<Real> a = size_of(z);
    const Real outside = r - a.value * z.x;
    z.m = outside * z.nx / (z.nx * z.nx + z.ny * z.ny);
    a = size_of(z);

    constexpr int most = 30;
    constexpr double tolerance = 1e-13;
    const auto inside = !(outside > 0.0);  // already, or on the axis
    Mask<Real> pending = wanted && !inside;
    Real iterations = 0.0;
    for (int i = 0; i < most && any(pending); ++i) {
      const Real fx = a.value * z.x + z.m * z.nx - r, fy = a.value * z.y + z.m * z.ny;
      const Real re = z.x * z.x - z.y * z.y, im = 2.0 * z.x * z.y;  // w^2
      const Real cubic =
          (re * z.x - im * z.y) * cosine - (re * z.y + im * z.x) * sine;  // Re(w^3 e^{3i theta})
      const Real f = 0.5 * (z.x * z.x + z.y * z.y) - inv_root6 / 3.0 * cubic - offset;
      const Real gx = z.nx + z.x * a.dm, gy = z.ny + z.y * a.dm;
      const Real axx = a.value + z.m * z.hxx + z.x * a.dx, axy = z.m * z.hxy + z.x * a.dy;
      const Real ayx = z.m * z.hxy + z.y * a.dx, ayy = a.value + z.m * z.hyy + z.y * a.dy;
      // [A g; N 0][dw; dm] = -[F; f], with U = adj(A) F and V = adj(A) g
      const Real det = axx * ayy - axy * ayx;
      const Real ux = ayy * fx - axy * fy, uy = axx * fy - ayx * fx;
      const Real vx = ayy * gx - axy * gy, vy = axx * gy - ayx * gx;
      const Real across = z.nx * vx + z.ny * vy, both = 1.0 / (det * across),
                 inverse = across * both;
      const Real dm = (f * det - z.nx * ux - z.ny * uy) * (det * both);
      const Real dx = -(ux + vx * dm) * inverse, dy = -(uy + vy * dm) * inverse;
      z.x = select(pending, z.x + dx, z.x), z.y = select(pending, z.y + dy, z.y);
      z.m = select(pending, z.m + dm, z.m);
      differentiate();
      a = size_of(z);
      iterations = select(pending, iterations + 1.0, iterations);
      // Newton converges quadratically: the step after this one would be below round-off.
      pending =
          pending && !(dx * dx + dy * dy < tolerance && dm * dm < tolerance * (1.0 + z.m * z.m));
    }
    const auto converged = !pending && a.value > 0.0 && z.m >= 0.0 && z.x > 0.0;
    if (any(wanted && !inside && !converged)) {
      z.x = select(converged, z.x, radial), z.y = select(converged, z.y, Real(0.0));
      z.m = select(converged, z.m, Real(0.0));
      differentiate();
      a = size_of(z);
    }

    // i times the direction, from dev(direction^2) = (cosine - i sine) direction/sqrt6; y ~ sine
    const Real scale = a.value * a_ref / elasticity.coupling;
    const Real turn = select(sine > 0.0, z.y / sine, Real(0.0));
    const T on_cone = (scale * (z.x + turn * cosine)) * direction -
                      (scale * turn / inv_root6) * deviator(square(direction));
    const Real multiplier = z.m * sqrt(z.nx * z.nx + z.ny * z.ny) * a_ref / elasticity.coupling;
    return select<Real>(inside,
                        {trial, a_ref, select(outside == 0.0, Real(0.0), Real(-1.0)), 0.0, inside},
                        {on_cone, a.value * a_ref, multiplier, iterations, converged});
  }
};

}  // namespace grainpair
