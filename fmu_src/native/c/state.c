/* The state as bytes: the unit's token, a checksum of what follows, the phase, the values, the model's memory. */
#include "unit.h"

#include <stdlib.h>
#include <string.h>

/* Fowler-Noll-Vo hash (FNV-1a), which differs if any bit differs. */
static int64_t checksum(const unsigned char *at, size_t size)
{
    uint64_t sum = 14695981039346656037u;
    for (size_t i = 0; i < size; i++)
        sum = (sum ^ at[i]) * 1099511628211u;
    return (int64_t)sum;
}

/* Pass a text on the heap. */
static void pass_text(Bytes *bytes, char **text)
{
    int64_t length = bytes->reading ? 0 : (int64_t)strlen(*text) + 1;
    pass_count(bytes, &length);
    if (bytes->reading) {
        free(*text);
        *text = malloc((size_t)length);
        if (!*text)
            refuse(bytes->space, "there is no memory left");
    }
    pass_bytes(bytes, *text, (size_t)length);
}

/* Pass the values; return whether a parameter differs from ``initial``, with which the model was initialised. */
static bool pass_values(Unit *unit, Bytes *bytes, const Value initial[])
{
    bool differs = false;
    unit->refused_count = 0;
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        const Variable *variable = &VARIABLES[i];
        Value *value = &unit->values[i];
        pass_double(bytes, &value->real);
        pass_bool(bytes, &value->refused);
        pass_double(bytes, &value->refused_as);
        if (variable->causality == PARAMETER && (!variable->tunable || unit->exchange))
            differs |= value->real != initial[i].real;
        if (variable->kind == STRING) {
            pass_text(bytes, &value->text);
            differs |= strcmp(initial[i].text, value->text) != 0;
        }
        unit->refused_count += value->refused;
    }
    return differs;
}

/* Pass the state; one that is read has the right checksum, so that it fits this unit. ``before`` is not changed. */
static void pass_state(Unit *unit, Bytes *bytes, const Unit *before)
{
    int64_t phase = unit->phase, length = (int64_t)strlen(unit->failure) + 1;
    pass_int64_t(bytes, &phase);
    pass_count(bytes, &length);
    pass_bytes(bytes, unit->failure, length < MESSAGE_SIZE ? (size_t)length : MESSAGE_SIZE);
    unit->phase = (Phase)phase;
    pass_bool(bytes, &unit->initialised);
    pass_double(bytes, &unit->start_time);
    pass_double(bytes, &unit->reached);
    Bytes at_values = *bytes;
    const bool differs = pass_values(unit, bytes, before->values) || !before->initialised || before->outdated ||
                       unit->start_time != before->start_time;
    if (bytes->reading)
        unit->outdated = phase == INITIALISING || (phase == STEPPING && !unit->initialised);
    if (!unit->initialised)
        return;
    if (bytes->reading && differs) {
        const double reached = unit->reached;
        unit->permanent = (Space){.refusal = &unit->refusal};
        unit_initialise(unit);
        pass_values(unit, &at_values, before->values); /* the initialisation has set the outputs of the start time */
        unit->reached = reached;
    }
    if (MODEL.pass)
        MODEL.pass(unit->model, bytes); /* lists that are read lie in the spare space */
    if (bytes->reading && MODEL.pass)
        unit_swap_spaces(unit);
    pass_double(bytes, &unit->passed); /* whether an event at this time has passed does not follow from the time */
    pass_double(bytes, &unit->next_event);
    unit->stale |= bytes->reading && EXCHANGE;
}

/* Give a state, which may exist already, room for ``size`` bytes; NULL if there is no memory. */
static State *resize_state(Unit *unit, const char *call, size_t size, void **state)
{
    State *resized = realloc(*state, sizeof *resized + size);
    if (!resized) {
        unit_log(unit, ERROR, "%s: there is no memory left", call);
        return NULL;
    }
    resized->size = size;
    *state = resized;
    return resized;
}

Status state_get(Unit *unit, void **state)
{
    const size_t token = strlen(UNIT_TOKEN) + 1, head = token + sizeof(int64_t);
    Bytes bytes = {0};
    if (unit->outdated)
        unit_prepare(unit, "getFMUstate");
    pass_bool(&bytes, &unit->exchange);
    pass_state(unit, &bytes, unit);
    State *saved = resize_state(unit, "getFMUstate", head + bytes.used, state);
    if (!saved)
        return ERROR;
    bytes = (Bytes){.at = saved->bytes + head, .size = bytes.used};
    pass_bool(&bytes, &unit->exchange);
    pass_state(unit, &bytes, unit);
    const int64_t sum = checksum(bytes.at, bytes.size);
    memcpy(saved->bytes, UNIT_TOKEN, token);
    memcpy(saved->bytes + token, &sum, sizeof sum);
    return OK;
}

Status state_set(Unit *unit, const State *state)
{
    const size_t token = strlen(UNIT_TOKEN) + 1, head = token + sizeof(int64_t);
    int64_t sum = 0;
    bool exchange = false;
    if (!state)
        return unit_log(unit, ERROR, "setFMUstate: there is no state");
    Bytes bytes = {(unsigned char *)state->bytes, state->size, head, true, &unit->spare};
    if (state->size > head)
        memcpy(&sum, state->bytes + token, sizeof sum);
    if (state->size <= head || memcmp(state->bytes, UNIT_TOKEN, token) != 0 ||
        sum != checksum(state->bytes + head, state->size - head))
        return unit_log(unit, DISCARD, "setFMUstate: these bytes are no state of this unit; nothing was changed");
    pass_bool(&bytes, &exchange);
    if (exchange != unit->exchange)
        return unit_log(
            unit, DISCARD, "setFMUstate: this is a state of an instance for %s; nothing was changed",
            exchange ? "model exchange" : "co-simulation");
    space_empty(&unit->spare);
    Unit before = *unit;
    unit->values = calloc(VARIABLE_COUNT, sizeof *unit->values);
    unit->model = malloc(MODEL.size);
    if (setjmp(unit->refusal.back)) { /* for example if the log of the state is gone */
        unit_log(unit, DISCARD, "setFMUstate: %s", unit->refusal.message);
        before.spare = unit->spare;
        unit_free_parts(unit, &before);
        *unit = before;
        return DISCARD;
    }
    if (!unit->values || !unit->model)
        refuse(&unit->spare, "there is no memory left");
    memcpy(unit->model, before.model, MODEL.size);
    pass_state(unit, &bytes, &before);
    unit_free_parts(&before, unit);
    return OK;
}

Status state_serialise(Unit *unit, const State *state, void *bytes, size_t size)
{
    if (size < state->size)
        return unit_log(unit, ERROR, "serializeFMUstate: the state has %zu bytes, not %zu", state->size, size);
    memcpy(bytes, state->bytes, state->size);
    return OK;
}

Status state_deserialise(Unit *unit, const void *bytes, size_t size, void **state)
{
    State *saved = resize_state(unit, "deSerializeFMUstate", size, state);
    if (saved)
        memcpy(saved->bytes, bytes, size);
    return saved ? OK : ERROR;
}
