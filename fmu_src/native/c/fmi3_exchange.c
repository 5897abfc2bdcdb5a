/* The functions of FMI 3.0 for Model Exchange, on top of exchange.h. */
#include "fmi3Functions.h"
#include "exchange.h"

#include <math.h>

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    (void)instance;
    return fmi3OK;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    (void)instance;
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(
    fmi3Instance instance, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals_changed,
    fmi3Boolean *states_changed, fmi3Boolean *next_defined, fmi3Float64 *next_time)
{
    double next = INFINITY;
    const Status status = exchange_update(instance, &next);
    *again = *terminate = *nominals_changed = *states_changed = fmi3False;
    *next_defined = next < INFINITY;
    *next_time = next;
    return (fmi3Status)status;
}

fmi3Status fmi3CompletedIntegratorStep(
    fmi3Instance instance, fmi3Boolean no_earlier_state, fmi3Boolean *event, fmi3Boolean *terminate)
{
    (void)instance;
    (void)no_earlier_state;
    *event = *terminate = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    return (fmi3Status)exchange_set_time(instance, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 states[], size_t count)
{
    return (fmi3Status)exchange_set_states(instance, states, count);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 states[], size_t count)
{
    return (fmi3Status)exchange_get_states(instance, states, count);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[], size_t count)
{
    return (fmi3Status)exchange_get_rates(instance, derivatives, count);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t count)
{
    return (fmi3Status)exchange_get_nominals(instance, nominals, count);
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *count)
{
    (void)instance;
    *count = EXCHANGE->states;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *count)
{
    (void)instance;
    *count = 0;
    return fmi3OK;
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 indicators[], size_t count)
{
    (void)indicators;
    return count == 0 ? fmi3OK : (fmi3Status)unit_say(instance, ERROR, "getEventIndicators: the unit has none");
}

fmi3Status fmi3GetDirectionalDerivative(
    fmi3Instance instance, const fmi3ValueReference unknowns[], size_t unknown_count,
    const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[], size_t seed_count,
    fmi3Float64 sensitivity[], size_t sensitivity_count)
{
    if (seed_count != known_count || sensitivity_count != unknown_count)
        return (fmi3Status)unit_say(
            instance, ERROR, "getDirectionalDerivative: %zu seeds for %zu knowns, %zu results for %zu unknowns",
            seed_count, known_count, sensitivity_count, unknown_count);
    return (fmi3Status)exchange_slopes(instance, unknowns, unknown_count, knowns, known_count, seed, sensitivity);
}
