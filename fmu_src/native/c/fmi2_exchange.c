/* The functions of FMI 2.0 for Model Exchange, on top of exchange.h. */
#include "fmi2Functions.h"
#include "exchange.h"

#include <math.h>

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    double next = INFINITY;
    const Status status = exchange_update(c, &next);
    info->newDiscreteStatesNeeded = info->terminateSimulation = fmi2False;
    info->nominalsOfContinuousStatesChanged = info->valuesOfContinuousStatesChanged = fmi2False;
    info->nextEventTimeDefined = next < INFINITY;
    info->nextEventTime = next;
    return (fmi2Status)status;
}

fmi2Status fmi2CompletedIntegratorStep(
    fmi2Component c, fmi2Boolean no_earlier_state, fmi2Boolean *event, fmi2Boolean *terminate)
{
    (void)c;
    (void)no_earlier_state;
    *event = *terminate = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    return (fmi2Status)exchange_set_time(c, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t count)
{
    return (fmi2Status)exchange_set_states(c, x, count);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t count)
{
    return (fmi2Status)exchange_get_states(c, x, count);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t count)
{
    return (fmi2Status)exchange_get_rates(c, derivatives, count);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t count)
{
    return (fmi2Status)exchange_get_nominals(c, nominals, count);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t count)
{
    (void)indicators;
    return count == 0 ? fmi2OK : (fmi2Status)unit_say(c, ERROR, "getEventIndicators: the unit has none");
}

fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns, const fmi2ValueReference known[],
    size_t knowns, const fmi2Real seed[], fmi2Real sensitivity[])
{
    return (fmi2Status)exchange_slopes(c, unknown, unknowns, known, knowns, seed, sensitivity);
}
