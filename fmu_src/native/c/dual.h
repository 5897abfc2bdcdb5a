/* Dual numbers, as heli_plant/dual.py has them: a value with its slope in one direction. */
#ifndef DUAL_H
#define DUAL_H

#include "arithmetic.h"

typedef struct {
    double value, slope;
} Dual;

static inline Dual dual_of(double x)
{
    return (Dual){x, 0.0};
}

static inline Dual dual_neg(Dual a)
{
    return (Dual){-a.value, -a.slope};
}

static inline Dual dual_add(Dual a, Dual b)
{
    return (Dual){a.value + b.value, a.slope + b.slope};
}

static inline Dual dual_sub(Dual a, Dual b)
{
    return (Dual){a.value - b.value, a.slope - b.slope};
}

static inline Dual dual_mul(Dual a, Dual b)
{
    return (Dual){a.value * b.value, a.slope * b.value + a.value * b.slope};
}

static inline Dual dual_div(Dual a, Dual b)
{
    const double value = a.value / b.value;
    return (Dual){value, (a.slope - value * b.slope) / b.value};
}

/* A number with a slope is different from one without, whatever their values. */
static inline bool dual_equal(Dual a, Dual b)
{
    return a.value == b.value && a.slope == b.slope;
}

static inline Dual dual_abs(Dual a)
{
    return a.value < 0.0 ? dual_neg(a) : a;
}

static inline Dual dual_sin(Dual a)
{
    return (Dual){sin(a.value), cos(a.value) * a.slope};
}

static inline Dual dual_cos(Dual a)
{
    return (Dual){cos(a.value), -sin(a.value) * a.slope};
}

static inline Dual dual_tan(Dual a)
{
    const double value = tan(a.value);
    return (Dual){value, (1.0 + value * value) * a.slope};
}

static inline Dual dual_tanh(Dual a)
{
    const double value = tanh(a.value);
    return (Dual){value, (1.0 - value * value) * a.slope};
}

static inline Dual dual_exp(Dual a)
{
    const double value = exp(a.value);
    return (Dual){value, value * a.slope};
}

static inline Dual dual_log(Dual a)
{
    return (Dual){log(a.value), 1.0 / a.value * a.slope};
}

static inline Dual dual_sqrt(Dual a)
{
    const double value = sqrt(a.value);
    return (Dual){value, 0.5 / value * a.slope};
}

#endif
