/* The state as bytes: the token of the unit, a sum over all that follows, the phase, the values, the model's memory. */
#include "unit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What a state holds besides the model's memory, read before anything is changed. */
typedef struct {
    int64_t phase;
    char *failure;
    bool exchange, initialised;
    double start_time, reached;
    Value *values;
} Saved;

/* Fowler-Noll-Vo hash (FNV-1a): another number if any bit is another one. */
static int64_t sum_of(const unsigned char *at, size_t size)
{
    uint64_t sum = 14695981039346656037u;
    for (size_t i = 0; i < size; i++)
        sum = (sum ^ at[i]) * 1099511628211u;
    return (int64_t)sum;
}

static void write_text(Bytes *bytes, const char *text)
{
    const int64_t length = (int64_t)strlen(text) + 1;
    write_int64_t(bytes, &length);
    write_bytes(bytes, text, (size_t)length);
}

/* Read a text behind its length, its zero included. */
static char *read_text(Bytes *bytes)
{
    int64_t count = 0;
    read_count(bytes, &count);
    char *text = space_take(bytes->space, count + 1, 1);
    read_bytes(bytes, text, (size_t)count);
    text[count] = '\0';
    return text;
}

static void write_state(const Unit *unit, Bytes *bytes)
{
    const int64_t phase = unit->phase;
    write_int64_t(bytes, &phase);
    write_text(bytes, unit->failure);
    write_bool(bytes, &unit->exchange);
    write_bool(bytes, &unit->initialised);
    write_double(bytes, &unit->start_time);
    write_double(bytes, &unit->reached);
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        const Value *value = &unit->values[i];
        write_double(bytes, &value->real);
        write_bool(bytes, &value->refused);
        write_double(bytes, &value->refused_as);
        if (value->text)
            write_text(bytes, value->text);
    }
    if (unit->initialised && MODEL.write)
        MODEL.write(unit->model, bytes);
}

static void read_saved(Bytes *bytes, Saved *saved)
{
    const size_t length = strlen(UNIT_TOKEN) + 1;
    char *token = space_take(bytes->space, (int64_t)length, 1);
    int64_t sum = 0;
    read_bytes(bytes, token, length);
    read_int64_t(bytes, &sum);
    if (memcmp(token, UNIT_TOKEN, length) != 0 || sum != sum_of(bytes->at + bytes->used, bytes->size - bytes->used))
        refuse(bytes->space, "these bytes are no state of this unit");
    read_int64_t(bytes, &saved->phase);
    saved->failure = read_text(bytes);
    read_bool(bytes, &saved->exchange);
    read_bool(bytes, &saved->initialised);
    read_double(bytes, &saved->start_time);
    read_double(bytes, &saved->reached);
    saved->values = space_take(bytes->space, (int64_t)VARIABLE_COUNT, sizeof *saved->values);
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        Value *value = &saved->values[i];
        read_double(bytes, &value->real);
        read_bool(bytes, &value->refused);
        read_double(bytes, &value->refused_as);
        value->text = VARIABLES[i].kind == STRING ? read_text(bytes) : NULL;
    }
}

/* Make room for ``size`` bytes in a state that may exist already; NULL if there is no memory. */
static State *with_room(Unit *unit, const char *call, size_t size, void **state)
{
    State *kept = realloc(*state, sizeof *kept + size);
    if (!kept) {
        unit_say(unit, ERROR, "%s: there is no memory left", call);
        return NULL;
    }
    kept->size = size;
    *state = kept;
    return kept;
}

Status state_get(Unit *unit, void **state)
{
    const size_t token = strlen(UNIT_TOKEN) + 1, head = token + sizeof(int64_t);
    Bytes bytes = {0};
    if (unit->outdated)
        unit_prepare(unit, "getFMUstate");
    write_state(unit, &bytes);
    State *kept = with_room(unit, "getFMUstate", head + bytes.used, state);
    if (!kept)
        return ERROR;
    bytes = (Bytes){kept->bytes + head, bytes.used, 0, NULL};
    write_state(unit, &bytes);
    const int64_t sum = sum_of(bytes.at, bytes.size);
    memcpy(kept->bytes, UNIT_TOKEN, token);
    memcpy(kept->bytes + token, &sum, sizeof sum);
    return OK;
}

/* Set the values; return whether a parameter or the start time differs from what the model was initialised with. */
static bool take_values(Unit *unit, const Saved *saved)
{
    bool other = unit->start_time != saved->start_time || !unit->initialised;
    unit->refused_count = 0;
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        const Variable *variable = &VARIABLES[i];
        Value *own = &unit->values[i], *value = &saved->values[i];
        const bool fixed = variable->causality == PARAMETER && !variable->tunable;
        const bool settable = variable->causality == INPUT || variable->causality == PARAMETER;
        if (fixed || (settable && !exchange_lets_change(unit, (uint32_t)i)))
            other |= own->real != value->real;
        if (value->text) {
            other |= strcmp(own->text, value->text) != 0;
            free(own->text);
        }
        *own = *value;
        if (value->text && !(own->text = copied(value->text)))
            refuse(&unit->space, "there is no memory left");
        unit->refused_count += own->refused;
    }
    unit->start_time = saved->start_time;
    return other;
}

Status state_set(Unit *unit, const State *state)
{
    volatile bool changed = false;
    Saved saved = {0};
    if (!state)
        return unit_say(unit, ERROR, "setFMUstate: there is no state");
    Bytes bytes = {(unsigned char *)state->bytes, state->size, 0, &unit->spare};
    space_empty(&unit->spare);
    if (setjmp(unit->refusal.back)) {
        if (!changed)
            return unit_say(unit, DISCARD, "setFMUstate: %s; nothing was changed", unit->refusal.message);
        memcpy(unit->failure, unit->refusal.message, sizeof unit->failure);
        return unit_say(unit, ERROR, "setFMUstate: %s", unit->refusal.message);
    }
    read_saved(&bytes, &saved);
    if (saved.exchange != unit->exchange)
        refuse(&unit->spare, "this is a state of an instance for %s", saved.exchange ? "model exchange" : "co-simulation");
    changed = true;
    const bool other = take_values(unit, &saved);
    unit->phase = (Phase)saved.phase;
    snprintf(unit->failure, sizeof unit->failure, "%s", saved.failure);
    unit->outdated = unit->phase == INITIALISING;
    if (!saved.initialised) {
        unit->initialised = false;
        return OK;
    }
    if (other) {
        unit_initialise(unit);
        for (size_t i = 0; i < VARIABLE_COUNT; i++) /* the initialisation has set the outputs of the start time */
            unit->values[i].real = saved.values[i].real;
    }
    unit->reached = saved.reached;
    if (MODEL.read) {
        MODEL.read(unit->model, &bytes); /* its lists lie in the spare space */
        const Space old = unit->space;
        unit->space = unit->spare;
        unit->spare = old;
        unit->live = unit->space.taken;
    }
    exchange_begin(unit);
    return OK;
}

Status state_serialise(Unit *unit, const State *state, void *bytes, size_t size)
{
    if (size < state->size)
        return unit_say(unit, ERROR, "serializeFMUstate: the state has %zu bytes, not %zu", state->size, size);
    memcpy(bytes, state->bytes, state->size);
    return OK;
}

Status state_deserialise(Unit *unit, const void *bytes, size_t size, void **state)
{
    State *kept = with_room(unit, "deSerializeFMUstate", size, state);
    if (kept)
        memcpy(kept->bytes, bytes, size);
    return kept ? OK : ERROR;
}
