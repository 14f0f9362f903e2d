/* Circular cone q = M p through grainpair's interface: linear elasticity, isochoric flow, no stress
   in tension; the law of mpm/materials/drucker_prager.cpp in steps of stress. Constants: bulk
   modulus [Pa], shear modulus [Pa], M. The loop has no branches, so the compiler computes several
   points at once. */
#include <math.h>

#include "mpm/external_law.h"

int grainpair_law_version(void) { return GRAINPAIR_LAW_VERSION; }

/* Points without aliases, so that the compiler may reorder what it loads and stores. */
static void update(int size, const double* constants, const double* restrict exx,
                   const double* restrict eyy, const double* restrict ezz,
                   const double* restrict exy, const double* restrict eyz,
                   const double* restrict ezx, double* restrict sxx, double* restrict syy,
                   double* restrict szz, double* restrict sxy, double* restrict syz,
                   double* restrict szx, double* restrict modulus, double* restrict stored,
                   double* restrict dissipated) {
  const double bulk = constants[0], shear = constants[1];
  const double cone = sqrt(2.0 / 3.0) * constants[2]; /* |s|/p on the cone */
  const double tiny = 1e-300;                         /* keeps 0/0 out, far below any stress */
  for (int i = 0; i < size; ++i) {
    const double volume = exx[i] + eyy[i] + ezz[i];
    const double p_old = (sxx[i] + syy[i] + szz[i]) / 3.0;
    const double p = p_old + bulk * volume;
    const double open = p <= 0.0 ? 1.0 : 0.0;
    const double axx = sxx[i] - p_old, ayy = syy[i] - p_old, azz = szz[i] - p_old;
    const double bxx = axx + 2.0 * shear * (exx[i] - volume / 3.0);
    const double byy = ayy + 2.0 * shear * (eyy[i] - volume / 3.0);
    const double bzz = azz + 2.0 * shear * (ezz[i] - volume / 3.0);
    const double bxy = sxy[i] + 2.0 * shear * exy[i];
    const double byz = syz[i] + 2.0 * shear * eyz[i];
    const double bzx = szx[i] + 2.0 * shear * ezx[i];
    const double trial2 =
        bxx * bxx + byy * byy + bzz * bzz + 2.0 * (bxy * bxy + byz * byz + bzx * bzx);
    const double trial = sqrt(trial2);
    const double limit = p <= 0.0 ? 0.0 : cone * p;
    const double kept = trial > limit ? limit / (trial + tiny) : 1.0;
    const double held = open > 0.0 ? 0.0 : p;
    /* work on the plastic strain (1 - kept) b/(2 G), by the trapezoidal rule, or by the stress at
       the end where that before opposed the flow */
    const double turned =
        axx * bxx + ayy * byy + azz * bzz + 2.0 * (sxy[i] * bxy + syz[i] * byz + szx[i] * bzx);
    const double before = p_old > 0.0 ? turned : 0.0;
    const double after = kept * trial2;
    const double work = before > 0.0 ? 0.5 * (before + after) : after;
    dissipated[i] = (1.0 - kept) * work / (2.0 * shear);
    stored[i] = held * held / (2.0 * bulk) + kept * kept * trial2 / (4.0 * shear);
    modulus[i] = bulk + 4.0 / 3.0 * shear;
    sxx[i] = held + kept * bxx;
    syy[i] = held + kept * byy;
    szz[i] = held + kept * bzz;
    sxy[i] = kept * bxy;
    syz[i] = kept * byz;
    szx[i] = kept * bzx;
  }
}

int grainpair_law(grainpair_block* b) {
  update(b->size, b->constants, b->strain[0], b->strain[1], b->strain[2], b->strain[3],
         b->strain[4], b->strain[5], b->stress[0], b->stress[1], b->stress[2], b->stress[3],
         b->stress[4], b->stress[5], b->modulus, b->stored, b->dissipated);
  return 0;
}
