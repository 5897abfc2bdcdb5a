#include "unit.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { UNTIDY = 1 << 16 }; /* bytes beyond twice the live ones at which the space is tidied up */

Status unit_say(Unit *unit, Status status, const char *format, ...)
{
    char message[MESSAGE_SIZE + 256];
    va_list values;
    va_start(values, format);
    vsnprintf(message, sizeof message, format, values);
    va_end(values);
    unit->report(unit, status, message);
    return status;
}

char *unit_copied(const char *text)
{
    char *copy = malloc(strlen(text) + 1);
    return copy ? strcpy(copy, text) : NULL;
}

/* From the first call to the last */

static bool set_starts(Unit *unit)
{
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        unit->values[i].real = VARIABLES[i].start;
        free(unit->values[i].text);
        unit->values[i].text = VARIABLES[i].kind == STRING ? unit_copied(VARIABLES[i].text) : NULL;
        if (VARIABLES[i].kind == STRING && !unit->values[i].text)
            return false;
        unit->refused[i] = false;
    }
    unit->refused_count = 0;
    unit->start_time = unit->reached = 0.0;
    unit->phase = INSTANTIATED;
    unit->failure[0] = '\0';
    unit->outdated = unit->stale = unit->initialised = false;
    return true;
}

Unit *unit_new(const char *name, Reporter report, void *host)
{
    Unit *unit = calloc(1, sizeof *unit);
    if (!unit)
        return NULL;
    unit->values = calloc(VARIABLE_COUNT, sizeof *unit->values);
    unit->refused = calloc(VARIABLE_COUNT, sizeof *unit->refused);
    unit->refused_as = calloc(VARIABLE_COUNT, sizeof *unit->refused_as);
    unit->space = calloc(1, sizeof *unit->space);
    unit->spare = calloc(1, sizeof *unit->spare);
    unit->settled = calloc(1, sizeof *unit->settled);
    unit->model = calloc(1, MODEL_SIZE);
    unit->name = unit_copied(name ? name : "");
    unit->report = report;
    unit->host = host;
    if (!unit->values || !unit->refused || !unit->refused_as || !unit->space || !unit->spare || !unit->settled ||
        !unit->model || !unit->name || !set_starts(unit)) {
        unit_free(unit);
        return NULL;
    }
    return unit;
}

static void free_space(Space *space)
{
    if (space)
        space_free(space);
    free(space);
}

void unit_free(Unit *unit)
{
    if (!unit)
        return;
    for (size_t i = 0; unit->values && i < VARIABLE_COUNT; i++)
        free(unit->values[i].text);
    free(unit->values);
    free(unit->refused);
    free(unit->refused_as);
    free_space(unit->space);
    free_space(unit->spare);
    free_space(unit->settled);
    free(unit->model);
    free(unit->name);
    free(unit);
}

Status unit_reset(Unit *unit)
{
    space_empty(unit->space);
    space_empty(unit->settled);
    memset(unit->model, 0, MODEL_SIZE);
    if (!set_starts(unit))
        return unit_say(unit, ERROR, "reset: there is no memory left");
    return OK;
}

/* Why the model refused. */
static const char *reason_of(const Unit *unit)
{
    return unit->space->message[0] ? unit->space->message : unit->settled->message;
}

Status unit_prepare(Unit *unit, const char *call)
{
    jmp_buf back;
    unit->initialised = false;
    unit->space->back = unit->settled->back = &back;
    unit->space->message[0] = unit->settled->message[0] = '\0';
    space_empty(unit->space);
    space_empty(unit->settled);
    memset(unit->model, 0, MODEL_SIZE);
    if (setjmp(back)) {
        unit_say(unit, DISCARD, "%s: %s", call, reason_of(unit));
        return DISCARD;
    }
    model_initialise(unit->model, unit);
    unit->reached = unit->start_time;
    exchange_begin(unit);
    unit->live = 0;
    unit->outdated = false;
    unit->initialised = true;
    return OK;
}

static const char *const PHASES[] = {"instantiated", "initialising", "stepping", "terminated"};

static Status wrong_phase(Unit *unit, const char *call)
{
    return unit_say(
        unit, ERROR, "%s: it is not allowed while the unit is %s, and was ignored", call, PHASES[unit->phase]);
}

Status unit_setup(Unit *unit, double start_time)
{
    if (unit->phase != INSTANTIATED || !isfinite(start_time)) {
        char text[NUMBER_SIZE];
        write_shortest(text, start_time);
        return unit_say(
            unit, ERROR,
            "setupExperiment: the start time %s s was ignored: it must be finite, and set before the initialisation "
            "begins",
            text);
    }
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
    unit->outdated = false;
    if (unit_prepare(unit, "exitInitializationMode") != OK) {
        snprintf(unit->failure, sizeof unit->failure, "%s", reason_of(unit));
        return ERROR;
    }
    return OK;
}

Status unit_terminate(Unit *unit)
{
    unit->phase = TERMINATED;
    return OK;
}

/* Steps */

/* Write a number as the type of a variable shows it. */
static const char *written(Kind kind, double value, char text[NUMBER_SIZE])
{
    if (kind == REAL)
        write_shortest(text, value);
    else if (kind == BOOLEAN)
        snprintf(text, NUMBER_SIZE, "%s", value != 0.0 ? "True" : "False");
    else
        snprintf(text, NUMBER_SIZE, "%.0f", value);
    return text;
}

/* Write why a value is refused. */
static const char *out_of_range(size_t reference, double value, char reason[MESSAGE_SIZE])
{
    const Variable *variable = &VARIABLES[reference];
    const char *blank = variable->physical_unit[0] ? " " : "";
    char text[NUMBER_SIZE];
    snprintf(
        reason, MESSAGE_SIZE, "%s = %s%s%s must lie in [%.6g, %.6g]%s%s", variable->name,
        written(variable->kind, value, text), blank,
        variable->physical_unit, variable->minimum, variable->maximum, blank, variable->physical_unit);
    return reason;
}

/* Whether a step begins where the one before ended: otherwise the state would belong to another time. */
static bool begins_well(const Unit *unit, double time, double step)
{
    return fabs(time - unit->reached) <= CLOCK_TOLERANCE * step || (!HAS_PAST && isfinite(time));
}

/* Say which values hinder the step at ``time``, and a failed initialisation. */
static Status refuse_for_values(Unit *unit, double time)
{
    char reasons[MESSAGE_SIZE], reason[MESSAGE_SIZE];
    size_t used = 0;
    if (unit->failure[0])
        used = (size_t)snprintf(
            reasons, sizeof reasons, "%s (the initialisation failed; reset the unit)", unit->failure);
    for (size_t i = 0; i < VARIABLE_COUNT && used < sizeof reasons; i++) {
        if (unit->refused[i])
            used += (size_t)snprintf(
                reasons + used, sizeof reasons - used, "%s%s", used ? "; " : "",
                out_of_range(i, unit->refused_as[i], reason));
    }
    return unit_say(
        unit, DISCARD, "doStep: the step from t = %g s is refused until this is corrected: %s", time, reasons);
}

static Status refuse_step(Unit *unit, double time, double step)
{
    char first[NUMBER_SIZE], second[NUMBER_SIZE];
    if (unit->phase != STEPPING)
        return unit_say(
            unit, DISCARD, "doStep: the unit is %s and cannot step from t = %g s: finish its initialisation first",
            PHASES[unit->phase], time);
    if (unit->refused_count || unit->failure[0])
        return refuse_for_values(unit, time);
    if (!(step > 0.0 && step < LONGEST_STEP)) {
        write_shortest(first, step);
        return unit_say(
            unit, DISCARD, "doStep: communication step = %s s at t = %g s must be positive and below %g s", first, time,
            LONGEST_STEP);
    }
    write_shortest(first, time);
    write_shortest(second, unit->reached);
    return unit_say(
        unit, DISCARD,
        "doStep: the step begins at t = %s s, the one before ended at %s s: time must neither repeat nor jump; to go "
        "back, restore a state from then",
        first, second);
}

/* Copy what lives to the spare space and take the rest back. */
static void tidy(Unit *unit)
{
    Space *old = unit->space;
    space_empty(unit->spare);
    unit->spare->back = old->back;
    model_keep(unit->model, unit->spare);
    unit->space = unit->spare;
    unit->spare = old;
    unit->live = unit->space->taken;
}

Status unit_step(Unit *unit, double time, double step)
{
    jmp_buf back;
    if (unit->exchange)
        return unit_say(unit, ERROR, "doStep: the unit was instantiated for model exchange");
    if (unit->phase != STEPPING || unit->refused_count || unit->failure[0] || !(step > 0.0 && step < LONGEST_STEP) ||
        !begins_well(unit, time, step))
        return refuse_step(unit, time, step);
    unit->space->back = unit->settled->back = &back;
    unit->space->message[0] = unit->settled->message[0] = '\0';
    if (setjmp(back))
        return unit_say(unit, DISCARD, "doStep: %s", reason_of(unit));
    if (unit->space->taken > 2 * unit->live + UNTIDY)
        tidy(unit);
    model_advance(unit->model, unit, time, step);
    unit->reached = time + step;
    unit->stale = EXCHANGE != NULL;
    return OK;
}

/* Values */

static const char *const KINDS[] = {"Real", "Integer", "Boolean", "String"};

static bool known(Unit *unit, const char *verb, Kind kind, uint32_t reference, Status *status)
{
    if (reference < VARIABLE_COUNT && VARIABLES[reference].kind == kind)
        return true;
    *status = unit_say(
        unit, ERROR, "%s%s: no %s variable has value reference %lu", verb, KINDS[kind], KINDS[kind],
        (unsigned long)reference);
    return false;
}

static bool open_to_set(const Unit *unit, uint32_t reference)
{
    const Variable *variable = &VARIABLES[reference];
    const bool early = unit->phase == INSTANTIATED || unit->phase == INITIALISING;
    if (!early && !exchange_lets_change(unit, reference))
        return false;
    return variable->causality == INPUT || (variable->causality == PARAMETER && (early || variable->tunable));
}

/* Say that a variable may not be set to ``value`` now. */
static Status closed_to_set(Unit *unit, uint32_t reference, const char *value)
{
    const Variable *variable = &VARIABLES[reference];
    const char *quote = variable->kind == STRING ? "'" : "";
    const char *reason = variable->causality == OUTPUT  ? "is an output"
                         : variable->causality == LOCAL ? "is calculated"
                         : unit->exchange               ? "is fixed in model exchange once initialisation has ended"
                                                        : "is fixed once initialisation has ended";
    return unit_say(
        unit, ERROR, "set%s: %s %s; the value %s%s%s was ignored", KINDS[variable->kind], variable->name, reason, quote,
        value, quote);
}

Status unit_set(Unit *unit, Kind kind, uint32_t reference, double value)
{
    Status status = OK;
    char text[NUMBER_SIZE];
    if (!known(unit, "set", kind, reference, &status))
        return status;
    if (!open_to_set(unit, reference))
        return closed_to_set(unit, reference, written(kind, value, text));
    const Variable *variable = &VARIABLES[reference];
    if (!(variable->minimum <= value && value <= variable->maximum)) { /* true of a NaN as well */
        unit->refused_count += !unit->refused[reference];
        unit->refused[reference] = true;
        unit->refused_as[reference] = value;
        char reason[MESSAGE_SIZE];
        return unit_say(unit, DISCARD, "set%s: %s", KINDS[kind], out_of_range(reference, value, reason));
    }
    if (unit->refused[reference]) {
        unit->refused[reference] = false;
        unit->refused_count--;
    }
    unit->values[reference].real = value;
    unit->stale = EXCHANGE && unit->initialised;
    unit->outdated = unit->phase == INITIALISING;
    return OK;
}

Status unit_set_text(Unit *unit, uint32_t reference, const char *text)
{
    Status status = OK;
    if (!known(unit, "set", STRING, reference, &status))
        return status;
    if (!open_to_set(unit, reference))
        return closed_to_set(unit, reference, text ? text : "");
    char *copy = text ? unit_copied(text) : NULL;
    if (!copy)
        return unit_say(unit, ERROR, "setString: %s has no text", VARIABLES[reference].name);
    free(unit->values[reference].text);
    unit->values[reference].text = copy;
    unit->outdated = unit->phase == INITIALISING;
    return OK;
}

Status unit_get(Unit *unit, Kind kind, uint32_t reference, double *value)
{
    Status status = OK;
    if (!known(unit, "get", kind, reference, &status))
        return status;
    if (unit->outdated)
        status = unit_prepare(unit, "get");
    if (unit->stale && unit->initialised)
        exchange_refresh(unit);
    *value = unit->values[reference].real;
    return status;
}

Status unit_get_text(Unit *unit, uint32_t reference, const char **text)
{
    Status status = OK;
    if (known(unit, "get", STRING, reference, &status))
        *text = unit->values[reference].text;
    return status;
}
