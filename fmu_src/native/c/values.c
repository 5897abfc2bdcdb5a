/* Values of variables: which may be set, which are refused. */
#include "unit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

char *copy_text(const char *text)
{
    char *copy = malloc(strlen(text) + 1);
    return copy ? strcpy(copy, text) : NULL;
}

bool unit_set_starts(Unit *unit)
{
    unit->refused_count = 0;
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        Value *value = &unit->values[i];
        free(value->text);
        *value = (Value){.real = VARIABLES[i].start};
        if (VARIABLES[i].kind == STRING && !(value->text = copy_text(VARIABLES[i].text)))
            return false;
    }
    return true;
}

void unit_show(Unit *unit, size_t first, const double values[], size_t count)
{
    for (size_t i = 0; i < count; i++)
        unit->values[first + i].real = values[i];
}

void unit_read(const Unit *unit, size_t first, double values[], size_t count)
{
    for (size_t i = 0; i < count; i++)
        values[i] = unit->values[first + i].real;
}

/* Write a number in the form of a variable's type. */
static const char *write_value(Kind kind, double value, char text[NUMBER_SIZE])
{
    if (kind == REAL)
        return write_shortest(text, value);
    if (kind == BOOLEAN)
        return value != 0.0 ? "True" : "False";
    snprintf(text, NUMBER_SIZE, "%.0f", value);
    return text;
}

const char *out_of_range(size_t reference, double value, char reason[MESSAGE_SIZE])
{
    const Variable *variable = &VARIABLES[reference];
    const char *blank = variable->physical_unit[0] ? " " : "";
    char text[NUMBER_SIZE];
    snprintf(
        reason, MESSAGE_SIZE, "%s = %s%s%s must lie in [%.6g, %.6g]%s%s", variable->name,
        write_value(variable->kind, value, text), blank,
        variable->physical_unit, variable->minimum, variable->maximum, blank, variable->physical_unit);
    return reason;
}

static const char *const KINDS[] = {"Real", "Integer", "Boolean", "String"};

/* Return whether there is a variable of this type and reference; if not, log it. */
static bool check_reference(Unit *unit, const char *verb, Kind kind, uint32_t reference, Status *status)
{
    if (reference < VARIABLE_COUNT && VARIABLES[reference].kind == kind)
        return true;
    *status = unit_log(
        unit, ERROR, "%s%s: no %s variable has value reference %lu", verb, KINDS[kind], KINDS[kind],
        (unsigned long)reference);
    return false;
}

static bool may_set(const Unit *unit, uint32_t reference)
{
    const Variable *variable = &VARIABLES[reference];
    const bool early = unit->phase == INSTANTIATED || unit->phase == INITIALISING;
    if (unit->phase == TERMINATED)
        return false;
    return variable->causality == INPUT ||
           (variable->causality == PARAMETER && (early || (variable->tunable && !unit->exchange)));
}

/* Log that a variable may not be set to ``value`` now. */
static Status refuse_to_set(Unit *unit, uint32_t reference, const char *value)
{
    const Variable *variable = &VARIABLES[reference];
    const char *quote = variable->kind == STRING ? "'" : "";
    const char *reason = variable->causality == OUTPUT  ? "is an output"
                         : variable->causality == LOCAL ? "is calculated"
                         : unit->phase == TERMINATED ? "cannot be set, the unit is terminated"
                         : unit->exchange               ? "is fixed in model exchange once initialisation has ended"
                                                        : "is fixed once initialisation has ended";
    return unit_log(
        unit, ERROR, "set%s: %s %s; the value %s%s%s was ignored", KINDS[variable->kind], variable->name, reason, quote,
        value, quote);
}

Status unit_set(Unit *unit, Kind kind, uint32_t reference, double value)
{
    Status status = OK;
    char text[NUMBER_SIZE];
    if (!check_reference(unit, "set", kind, reference, &status))
        return status;
    if (!may_set(unit, reference))
        return refuse_to_set(unit, reference, write_value(kind, value, text));
    const Variable *variable = &VARIABLES[reference];
    Value *stored = &unit->values[reference];
    if (!(variable->minimum <= value && value <= variable->maximum)) { /* also true of NaN */
        unit->refused_count += !stored->refused;
        stored->refused = true;
        stored->refused_as = value;
        char reason[MESSAGE_SIZE];
        return unit_log(unit, DISCARD, "set%s: %s", KINDS[kind], out_of_range(reference, value, reason));
    }
    unit->refused_count -= stored->refused;
    stored->refused = false;
    stored->real = value;
    unit->stale = EXCHANGE && unit->initialised;
    unit->outdated |= unit->phase == INITIALISING;
    return OK;
}

Status unit_set_text(Unit *unit, uint32_t reference, const char *text)
{
    Status status = OK;
    if (!check_reference(unit, "set", STRING, reference, &status))
        return status;
    if (!may_set(unit, reference))
        return refuse_to_set(unit, reference, text ? text : "");
    char *copy = text ? copy_text(text) : NULL;
    if (!copy)
        return unit_log(unit, ERROR, "setString: %s has no text", VARIABLES[reference].name);
    free(unit->values[reference].text);
    unit->values[reference].text = copy;
    unit->outdated |= unit->phase == INITIALISING;
    return OK;
}

Status unit_get(Unit *unit, Kind kind, uint32_t reference, double *value)
{
    Status status = OK;
    if (!check_reference(unit, "get", kind, reference, &status))
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
    if (check_reference(unit, "get", STRING, reference, &status))
        *text = unit->values[reference].text;
    return status;
}
