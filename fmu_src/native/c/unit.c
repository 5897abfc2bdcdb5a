#include "model.h"
#include "unit.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GARBAGE = 1 << 16 }; /* bytes beyond twice the live ones above which the space is compacted */

Status unit_log(Unit *unit, Status status, const char *format, ...)
{
    char message[MESSAGE_SIZE + 256];
    va_list values;
    va_start(values, format);
    vsnprintf(message, sizeof message, format, values);
    va_end(values);
    unit->report(unit, status, message);
    return status;
}

/* From the first call to the last */

Unit *unit_new(const char *name)
{
    Unit *unit = calloc(1, sizeof *unit);
    if (!unit)
        return NULL;
    unit->space.refusal = unit->spare.refusal = unit->permanent.refusal = &unit->refusal;
    unit->values = calloc(VARIABLE_COUNT, sizeof *unit->values);
    unit->model = calloc(1, MODEL.size);
    unit->name = copy_text(name ? name : "");
    if (unit->values && unit->model && unit->name && unit_set_starts(unit))
        return unit;
    unit_free(unit);
    return NULL;
}

void unit_free_parts(Unit *unit, const Unit *other)
{
    for (size_t i = 0; unit->values && i < VARIABLE_COUNT; i++)
        free(unit->values[i].text);
    free(unit->values);
    free(unit->model);
    if (unit->permanent.chunks != other->permanent.chunks)
        space_free(&unit->permanent);
}

void unit_free(Unit *unit)
{
    if (!unit)
        return;
    unit_free_parts(unit, &(Unit){.values = NULL});
    space_free(&unit->space);
    space_free(&unit->spare);
    free(unit->name);
    free(unit);
}

static void clear_model(Unit *unit)
{
    unit->initialised = false;
    space_empty(&unit->permanent);
    memset(unit->model, 0, MODEL.size);
}

Status unit_reset(Unit *unit)
{
    clear_model(unit);
    unit->start_time = unit->reached = 0.0;
    unit->phase = INSTANTIATED;
    unit->failure[0] = '\0';
    unit->outdated = unit->stale = false;
    if (!unit_set_starts(unit))
        return unit_log(unit, ERROR, "reset: there is no memory left");
    return OK;
}

void unit_initialise(Unit *unit)
{
    clear_model(unit);
    MODEL.initialise(unit->model, unit);
    unit->reached = unit->start_time;
    exchange_begin(unit);
    unit->live = 0;
    unit->outdated = false;
    unit->initialised = true;
}

Status unit_prepare(Unit *unit, const char *call)
{
    if (setjmp(unit->refusal.back))
        return unit_log(unit, DISCARD, "%s: %s", call, unit->refusal.message);
    unit_initialise(unit);
    return OK;
}

static const char *const PHASES[] = {"instantiated", "initialising", "stepping", "terminated"};

static Status wrong_phase(Unit *unit, const char *call)
{
    return unit_log(
        unit, ERROR, "%s: it is not allowed while the unit is %s, and was ignored", call, PHASES[unit->phase]);
}

Status unit_setup(Unit *unit, double start_time)
{
    char text[NUMBER_SIZE];
    if (unit->phase != INSTANTIATED || !isfinite(start_time))
        return unit_log(
            unit, ERROR,
            "setupExperiment: the start time %s s was ignored: it must be finite, and set before the initialisation "
            "begins",
            write_shortest(text, start_time));
    unit->start_time = unit->reached = start_time;
    return OK;
}

Status unit_enter_initialisation(Unit *unit)
{
    if (unit->phase != INSTANTIATED)
        return wrong_phase(unit, "enterInitializationMode");
    unit->phase = INITIALISING;
    unit->outdated = true;
    return OK;
}

Status unit_exit_initialisation(Unit *unit)
{
    if (unit->phase != INITIALISING)
        return wrong_phase(unit, "exitInitializationMode");
    unit->phase = STEPPING;
    unit->outdated = true; /* after a failed initialisation every call that reads outputs logs the reason */
    if (unit_prepare(unit, "exitInitializationMode") == OK)
        return OK;
    memcpy(unit->failure, unit->refusal.message, sizeof unit->failure);
    return ERROR;
}

Status unit_terminate(Unit *unit)
{
    unit->phase = TERMINATED;
    return OK;
}

/* Steps */

/* Write which values prevent a step, and a failed initialisation; nothing if there is none. */
static const char *write_refused(const Unit *unit, char reasons[MESSAGE_SIZE])
{
    char reason[MESSAGE_SIZE];
    size_t used = 0;
    reasons[0] = '\0';
    if (unit->failure[0])
        used = (size_t)snprintf(
            reasons, MESSAGE_SIZE, "%s (the initialisation failed; reset the unit)", unit->failure);
    for (size_t i = 0; unit->refused_count && i < VARIABLE_COUNT && used < MESSAGE_SIZE; i++) {
        if (unit->values[i].refused)
            used += (size_t)snprintf(
                reasons + used, MESSAGE_SIZE - used, "%s%s", used ? "; " : "",
                out_of_range(i, unit->values[i].refused_as, reason));
    }
    return reasons;
}

void unit_swap_spaces(Unit *unit)
{
    const Space old = unit->space;
    unit->space = unit->spare;
    unit->spare = old;
    unit->live = unit->space.taken;
}

/* Copy the model's memory to the spare space, which becomes the space; this frees everything else in it. */
static void compact(Unit *unit)
{
    Bytes bytes = {.space = &unit->spare};
    if (!MODEL.pass) { /* there is nothing between two steps */
        space_empty(&unit->space);
        return;
    }
    space_empty(&unit->spare);
    MODEL.pass(unit->model, &bytes); /* count them */
    bytes = (Bytes){.at = space_take(&unit->spare, (int64_t)bytes.used, 1), .size = bytes.used, .space = &unit->spare};
    MODEL.pass(unit->model, &bytes);
    bytes.used = 0;
    bytes.reading = true;
    MODEL.pass(unit->model, &bytes);
    unit_swap_spaces(unit);
}

Status unit_step(Unit *unit, double time, double step)
{
    char refused[MESSAGE_SIZE];
    if (unit->exchange)
        return unit_log(unit, ERROR, "doStep: the unit was instantiated for model exchange");
    if (setjmp(unit->refusal.back))
        return unit_log(unit, DISCARD, "doStep: %s", unit->refusal.message);
    if (unit->space.taken > 2 * unit->live + GARBAGE)
        compact(unit);
    slave_base_check_step(
        &unit->space, PHASES[unit->phase], write_refused(unit, refused), HAS_PAST, unit->reached, time, step);
    MODEL.advance(unit->model, unit, time, step);
    unit->reached = time + step;
    unit->stale = EXCHANGE != NULL;
    return OK;
}
