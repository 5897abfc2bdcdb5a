/* Model Exchange: states, rates and events in time, between the importer and a model that has EXCHANGE. */
#include "unit.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { MOST = 32 }; /* states of a model */
/* Time since the start at which the laws are computed: before an event up to it, after the event from then on. */
static double law_time(const Unit *unit)
{
    const double time = unit->reached - unit->start_time;
    const double before = time < unit->next_event ? time : nextafter(unit->next_event, -INFINITY);
    return before > unit->passed ? before : unit->passed;
}

void exchange_begin(Unit *unit)
{
    unit->stale = EXCHANGE != NULL;
    if (!unit->exchange)
        return;
    EXCHANGE->begin(unit->model, unit);
    unit->passed = 0.0;
    unit->next_event = EXCHANGE->next_event(unit->model, unit->passed);
}

void exchange_refresh(Unit *unit)
{
    const double *states = EXCHANGE->state(unit->model);
    double rates[MOST];
    EXCHANGE->rates(unit->model, unit, unit->exchange ? law_time(unit) : unit->reached - unit->start_time, rates);
    unit_show(unit, EXCHANGE->first_state, states, EXCHANGE->states);
    unit_show(unit, EXCHANGE->first_state + EXCHANGE->states, rates, EXCHANGE->states);
    if (unit->exchange)
        EXCHANGE->show(unit->model, unit);
    unit->stale = false;
}

static const size_t NO_STATES = SIZE_MAX; /* for calls without an array of states */

/* Check that the importer may integrate now, with ``count`` states; read also while initialising and at the end. */
static Status check_ready(Unit *unit, const char *call, size_t count, bool reads)
{
    if (!unit->exchange)
        return unit_log(unit, ERROR, "%s: the unit was not instantiated for model exchange", call);
    if (reads && unit->outdated && unit_prepare(unit, call) != OK)
        return DISCARD;
    if (!unit->initialised || (unit->phase != STEPPING && !reads))
        return unit_log(unit, ERROR, "%s: finish the initialisation first", call);
    if (count != EXCHANGE->states && count != NO_STATES)
        return unit_log(unit, ERROR, "%s: there are %zu values, not %zu", call, EXCHANGE->states, count);
    return OK;
}

Status exchange_set_time(Unit *unit, double time)
{
    const Status status = check_ready(unit, "setTime", NO_STATES, false);
    if (status != OK)
        return status;
    if (!isfinite(time))
        return unit_log(unit, ERROR, "setTime: the time %g s is not finite", time);
    unit->reached = time;
    unit->stale = true;
    return OK;
}

Status exchange_set_states(Unit *unit, const double states[], size_t count)
{
    const Status status = check_ready(unit, "setContinuousStates", count, false);
    if (status != OK)
        return status;
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(states[i]))
            return unit_log(
                unit, DISCARD, "setContinuousStates: %s = %g is not finite",
                VARIABLES[EXCHANGE->first_state + i].name, states[i]);
    }
    memcpy(EXCHANGE->state(unit->model), states, count * sizeof *states);
    unit->stale = true;
    return OK;
}

Status exchange_get_states(Unit *unit, double states[], size_t count)
{
    const Status status = check_ready(unit, "getContinuousStates", count, true);
    if (status == OK)
        memcpy(states, EXCHANGE->state(unit->model), count * sizeof *states);
    return status;
}

Status exchange_get_rates(Unit *unit, double rates[], size_t count)
{
    const Status status = check_ready(unit, "getDerivatives", count, true);
    if (status != OK)
        return status;
    if (unit->refused_count)
        return unit_log(unit, DISCARD, "getDerivatives: an input or parameter has no good value");
    if (unit->stale)
        exchange_refresh(unit);
    for (size_t i = 0; i < count; i++) {
        const size_t reference = EXCHANGE->first_state + EXCHANGE->states + i;
        rates[i] = unit->values[reference].real;
        if (!isfinite(rates[i]))
            return unit_log(
                unit, DISCARD, "getDerivatives: %s is not finite at t = %g s", VARIABLES[reference].name,
                unit->reached);
    }
    return OK;
}

Status exchange_get_nominals(Unit *unit, double nominals[], size_t count)
{
    if (!unit->exchange || count != EXCHANGE->states)
        return check_ready(unit, "getNominalsOfContinuousStates", count, true);
    for (size_t i = 0; i < count; i++) /* they are constant: in any phase */
        nominals[i] = VARIABLES[EXCHANGE->first_state + i].nominal;
    return OK;
}

Status exchange_update(Unit *unit, double *next)
{
    const Status status = check_ready(unit, "newDiscreteStates", NO_STATES, false);
    if (status != OK)
        return status;
    const double due = unit->start_time + unit->next_event; /* the sum that was told */
    if (unit->reached >= due - 1e-9 - 4.0 * DBL_EPSILON * fabs(due)) { /* [s]; importers round the time of an event */
        unit->passed = unit->next_event;
        unit->next_event = EXCHANGE->next_event(unit->model, unit->passed);
        unit->stale = true;
    }
    *next = unit->start_time + unit->next_event;
    return OK;
}
