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

/* A function of one dual number: its value, and its slope by the chain rule. */
#define DUAL_FUNCTION(name, of_value, of_slope) \
    static inline Dual dual_##name(Dual a) \
    { \
        const double value = of_value; \
        return (Dual){value, of_slope}; \
    }
DUAL_FUNCTION(sin, sin(a.value), cos(a.value) * a.slope)
DUAL_FUNCTION(cos, cos(a.value), -sin(a.value) * a.slope)
DUAL_FUNCTION(tan, tan(a.value), (1.0 + value * value) * a.slope)
DUAL_FUNCTION(tanh, tanh(a.value), (1.0 - value * value) * a.slope)
DUAL_FUNCTION(exp, exp(a.value), value * a.slope)
DUAL_FUNCTION(log, log(a.value), 1.0 / a.value * a.slope)
DUAL_FUNCTION(sqrt, sqrt(a.value), 0.5 / value * a.slope)

#endif
