/* A constitutive law of your own, called in blocks of points.
 *
 * Compile a function `grainpair_law` of this form into a shared library,
 *     cc -O3 -march=native -shared -fPIC -I CLONE law.c -o liblaw.so
 * and name it in a case: material.law = "external", material.interface = "grainpair",
 * material.library = "liblaw.so".
 *
 * Compression is positive, of stress and of strain. Components stand in the order xx yy zz xy yz
 * zx; shear strains are those of the tensor, half the engineering ones. A number of the points of a
 * block is an array of its own, so that a loop over the points runs in vectors. The law keeps
 * nothing between calls but what is in `state`; several threads call it at once. */
#ifndef GRAINPAIR_EXTERNAL_LAW_H
#define GRAINPAIR_EXTERNAL_LAW_H

#ifdef __cplusplus
extern "C" {
#endif

#define GRAINPAIR_LAW_VERSION 1
#define GRAINPAIR_BLOCK 64 /* most points of a block */

typedef struct {
  int size;                /* points of this block, at least 1 */
  double dt;               /* the step [s] */
  int constant_count;      /* numbers in ... */
  const double* constants; /* ... material.constants */
  int state_count;         /* material.state_variables */
  const double* strain[6]; /* of the step, with the volume of det F [-] */
  const double* spin[3];   /* axial vector w of the skew velocity gradient, W a = w x a [1/s] */
  const double* void_ratio_old; /* at the start ... */
  const double* void_ratio;     /* ... and at the end of the step [-] */
  double* stress[6];            /* before the step, turned with the material already; leave there
                                   what it is after the step [Pa] */
  double* const* state;         /* state_count arrays, the same */
  double* modulus;              /* leave the P-wave modulus of unloading [Pa] */
  double* stored;               /* leave the elastic energy [J/m3], or the NaN that is there */
  double* dissipated;           /* leave what was dissipated in the step [J/m3], or the NaN */
} grainpair_block;

/* 0, or 1 + the place in the block of a point that it cannot update. */
int grainpair_law(grainpair_block* block);

/* GRAINPAIR_LAW_VERSION that the library was compiled for; a library may leave it out. */
int grainpair_law_version(void);

#ifdef __cplusplus
}
#endif
#endif
