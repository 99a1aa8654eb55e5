/* Exponential, logarithm and power by +, -, *, / and bits only: the same result on every processor and with every C
   library. The compiler must not contract a * b + c; setup.py says so. */
#ifndef PNEUMO_MATHS_H
#define PNEUMO_MATHS_H
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "core.h"

#if defined(_MSC_VER)
#define INLINE static __forceinline
#define restrict __restrict
#define HIDDEN
#else
#define HIDDEN __attribute__((visibility("hidden")))
#define INLINE static inline __attribute__((always_inline))
#endif

/* One compiled form for each generation of processors, chosen when the library is loaded. Clang before 18 gives the
   choice a name that other files do not find. */
#if defined(__clang__) && __clang_major__ < 18 && !defined(PNEUMO_NO_CLONES)
#define PNEUMO_NO_CLONES
#endif
#if defined(__x86_64__) && defined(__GLIBC__) && !defined(PNEUMO_NO_CLONES)
#define CLONES __attribute__((target_clones("default", "avx2", "avx512f")))
#else
#define CLONES
#endif

/* exp(t) for |t| <= 0.6, and ln(m) / z with z = (m - 1)/(m + 1) in powers of z^2 for sqrt(1/2) <= m <= sqrt(2): both
   interpolated at Chebyshev nodes. */
#define EXP_REACH 0.6
static const double EXP[12] = {
    0x1p+0, 0x1.0000000000003p+0, 0x1.00000000004b8p-1, 0x1.5555555554f20p-3, 0x1.555555544debep-5,
    0x1.111111116997ep-7, 0x1.6c16c36e1ceb7p-10, 0x1.a01a017851a99p-13, 0x1.a016cfa394c1bp-16,
    0x1.71dd7885e5c5ep-19, 0x1.2a1dd61dd876dp-22, 0x1.b064fd73c1b64p-26};
static const double LOG[8] = {
    0x1p+1, 0x1.5555555555559p-1, 0x1.9999999994126p-2, 0x1.2492492f9f61bp-2, 0x1.c71c61022ff77p-3,
    0x1.746332c1a6cabp-3, 0x1.39eefedceddf5p-3, 0x1.2c0d55678d294p-3};
#define LN_2 0x1.62e42fefa39efp-1
#define LN_2_HIGH 0x1.62e42fefa38p-1 /* 42 bits: a multiple by an exponent is exact */
#define LN_2_LOW 0x1.ef35793c7673p-45
#define LN_2_SHORT 0x1.62e42fep-1 /* 28 bits: a multiple by 128 exponents is exact */
#define LN_2_REST 0x1.f473de6af278fp-30
#define PI 3.14159265358979323846

INLINE double from_bits(uint64_t bits) { double x; memcpy(&x, &bits, sizeof x); return x; }
INLINE uint64_t to_bits(double x) { uint64_t bits; memcpy(&bits, &x, sizeof bits); return bits; }
/* A NaN in b stays, one in a does not. */
INLINE double larger(double a, double b) { return a > b ? a : b; }
INLINE double smaller(double a, double b) { return a < b ? a : b; }

/* Polynomial with an even number of coefficients, lowest power first: even and odd powers side by side. */
INLINE double polynomial(const double *c, int terms, double x) {
    double x_2 = x * x, even = c[terms - 2], odd = c[terms - 1];
    for (int i = terms - 4; i >= 0; i -= 2) {
        even = even * x_2 + c[i];
        odd = odd * x_2 + c[i + 1];
    }
    return even + odd * x;
}

/* x = m 2^exponent with m between sqrt(1/2) and sqrt(2). */
INLINE double split(double x, double *exponent) {
    const uint64_t mantissa = (UINT64_C(1) << 52) - 1, one = UINT64_C(1023) << 52;
    const uint64_t root_half = UINT64_C(0x3fe6a09e667f3bcd), large = UINT64_C(1075) << 52; /* 2^52 */
    uint64_t bits = to_bits(x) + (one - root_half);
    *exponent = from_bits((bits >> 52) | large) - (0x1p52 + 1023.0);
    return from_bits((bits & mantissa) + root_half);
}

/* Natural logarithm of a positive, finite, normal x; for any other x a finite number outside -700 ... 700. */
INLINE double fast_log(double x) {
    double exponent, m = split(x, &exponent), z = (m - 1) / (m + 1);
    return exponent * LN_2 + z * polynomial(LOG, 8, z * z);
}

/* exp(t) for |t| <= EXP_REACH, else NaN. */
INLINE double fast_exp(double t) {
    double value = polynomial(EXP, 12, t);
    return fabs(t) <= EXP_REACH ? value : (double)NAN;
}

/* ln(c) and 1/c of numbers c with seven bits behind the point, from sqrt(1/2) to sqrt(2), and 2^(j/128): `fill_tables`
   computes them when the library is loaded. */
enum { STEPS = 128 };
extern HIDDEN double LOG_TABLE[STEPS + 2][2], EXP_TABLE[STEPS];
#define SEVEN_BITS 45 /* bits of mantissa behind those of c */
#define FIRST_C (UINT64_C(0x3fe6a09e667f3bcd) >> SEVEN_BITS)

/* ln(x) of a positive, finite, normal x, without tables. */
INLINE double plain_ln(double x) {
    double exponent, m = split(x, &exponent);
    /* m - 1 is exact; 2 z = f - z f, so the largest term has no rounding error */
    double f = m - 1, z = f / (m + 1), z_2 = z * z;
    double tail = z * (z_2 * (LOG[1] + z_2 * polynomial(LOG + 2, 6, z_2)));
    return exponent * LN_2_HIGH + (f + ((tail - z * f) + exponent * LN_2_LOW));
}

/* ln(x) - shift ln(2) of a positive, finite, normal x; for any other x a finite number, without branches. */
INLINE double normal_ln(double x, double shift) {
    double exponent, m = split(x, &exponent);
    uint64_t c = (to_bits(m) + (UINT64_C(1) << (SEVEN_BITS - 1))) >> SEVEN_BITS;
    int64_t of_c = (int64_t)(c - FIRST_C);
    double r = (m - from_bits(c << SEVEN_BITS)) * LOG_TABLE[of_c][1], r_2 = r * r; /* the difference is exact */
    double tail = r_2 * ((-1.0 / 2 + r * (1.0 / 3)) + r_2 * ((-1.0 / 4 + r * (1.0 / 5)) - r_2 * (1.0 / 6)));
    exponent -= shift;
    return (exponent * LN_2_HIGH + LOG_TABLE[of_c][0]) + (r + (tail + exponent * LN_2_LOW));
}

/* Natural logarithm of any x; NaN of a negative one. */
INLINE double ln(double x) {
    if (!(x > 0)) return x == 0 ? -(double)INFINITY : (double)NAN;
    if (!(x <= 1.7976931348623157e308)) return x;
    return x < 0x1p-1022 ? normal_ln(x * 0x1p54, 54) : normal_ln(x, 0);
}

/* exp(t) where it is a finite number, without branches. */
INLINE double finite_exp(double t) {
    const double high = 0x1.8p52; /* added, it rounds to a whole number, which is then in the last bits */
    double shifted = t * (STEPS / LN_2) + high, k = shifted - high;
    double r = (t - k * (LN_2_SHORT / STEPS)) - k * (LN_2_REST / STEPS), r_2 = r * r;
    double root = EXP_TABLE[(int64_t)(to_bits(shifted) & (STEPS - 1))];
    double tail = r + r_2 * ((1.0 / 2 + r * (1.0 / 6)) + r_2 * (1.0 / 24 + r * (1.0 / 120)));
    uint64_t exponents = (to_bits(shifted) - to_bits(high) + STEPS * 2 * 1023) / STEPS, half = exponents / 2;
    return (root + root * tail) * from_bits(half << 52) * from_bits((exponents - half) << 52); /* neither overflows */
}

/* exp(t) of any t. */
INLINE double exponential(double t) {
    if (t != t) return t;
    return t > 709.79 ? (double)INFINITY : t < -745.2 ? 0 : finite_exp(t);
}

/* x^y for x >= 0; the exponents 0, 1/2 and 1 are exact. */
INLINE double power(double x, double y) {
    if (y == 0) return 1;
    if (y == 1) return x;
    if (y == 0.5) return sqrt(x);
    return exponential(y * ln(x));
}
#endif
