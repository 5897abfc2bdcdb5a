/* Arithmetic as Python does it, where C differs.
 *
 * Every product and sum is rounded by itself: a compiler that contracted them into one fused operation would change the
 * last bits of most results.
 */
#ifndef ARITHMETIC_H
#define ARITHMETIC_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#endif

#if defined(__GNUC__) /* Python functions may have unused variables */
#pragma GCC diagnostic ignored "-Wunused-variable"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#endif

#if defined(__FAST_MATH__)
#error "compile without -ffast-math: it changes results"
#endif

/* a // b */
static inline int64_t floor_div(int64_t a, int64_t b)
{
    const int64_t quotient = a / b;
    return a % b != 0 && (a < 0) != (b < 0) ? quotient - 1 : quotient;
}

/* a % b: the result has the sign of b */
static inline int64_t floor_mod(int64_t a, int64_t b)
{
    const int64_t rest = a % b;
    return rest != 0 && (rest < 0) != (b < 0) ? rest + b : rest;
}

static inline double float_mod(double a, double b)
{
    const double rest = fmod(a, b);
    if (rest == 0.0)
        return copysign(0.0, b);
    return (rest < 0.0) != (b < 0.0) ? rest + b : rest;
}

/* max(a, b) and min(a, b): the first unless the second is larger or smaller, also if one is NaN */
#define EXTREMES(name, type) \
    static inline type max_##name(type a, type b) { return b > a ? b : a; } \
    static inline type min_##name(type a, type b) { return b < a ? b : a; }
EXTREMES(float, double)
EXTREMES(int, int64_t)

/* len(range(first, stop, step)) */
static inline int64_t range_count(int64_t first, int64_t stop, int64_t step)
{
    if (step > 0)
        return first < stop ? (stop - first - 1) / step + 1 : 0;
    return first > stop ? (first - stop - 1) / -step + 1 : 0;
}

#endif
