/* The state as bytes: the token of the unit, a sum over all that follows, the phase, the values, the model's memory. */
#include "unit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

static void write_state(const Unit *unit, Bytes *bytes)
{
    const int64_t phase = unit->phase;
    write_bool(bytes, &unit->exchange);
    write_int64_t(bytes, &phase);
    write_text(bytes, unit->failure);
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

/* Read a text into one on the heap. */
static void read_text(Bytes *bytes, char **text)
{
    int64_t length = 0;
    read_count(bytes, &length);
    free(*text);
    *text = malloc((size_t)length);
    if (!*text)
        refuse(bytes->space, "there is no memory left");
    read_bytes(bytes, *text, (size_t)length);
}

/* Read the values; return whether a parameter differs from what the model was initialised with. */
static bool read_values(Unit *unit, Bytes *bytes)
{
    bool other = false;
    unit->refused_count = 0;
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        const Variable *variable = &VARIABLES[i];
        Value *own = &unit->values[i];
        const double before = own->real;
        const bool settable = variable->causality == INPUT || variable->causality == PARAMETER;
        read_double(bytes, &own->real);
        read_bool(bytes, &own->refused);
        read_double(bytes, &own->refused_as);
        if ((variable->causality == PARAMETER && !variable->tunable) ||
            (settable && !exchange_lets_change(unit, (uint32_t)i)))
            other |= own->real != before;
        if (own->text) {
            char *had = copied(own->text);
            read_text(bytes, &own->text);
            other |= !had || strcmp(had, own->text) != 0;
            free(had);
        }
        unit->refused_count += own->refused;
    }
    return other;
}

/* Read a state whose sum is right: it fits this unit. */
static void read_state(Unit *unit, Bytes *bytes)
{
    const double start_time = unit->start_time;
    char *failure = NULL;
    int64_t phase = 0;
    bool other = !unit->initialised;
    read_int64_t(bytes, &phase);
    read_text(bytes, &failure);
    snprintf(unit->failure, sizeof unit->failure, "%s", failure);
    free(failure);
    unit->phase = (Phase)phase;
    unit->outdated = phase == INITIALISING;
    read_bool(bytes, &unit->initialised);
    read_double(bytes, &unit->start_time);
    read_double(bytes, &unit->reached);
    Bytes again = *bytes;
    other |= read_values(unit, bytes) || unit->start_time != start_time;
    if (!unit->initialised)
        return;
    if (other) {
        const double reached = unit->reached;
        unit_initialise(unit);
        read_values(unit, &again); /* the initialisation has set the outputs of the start time */
        unit->reached = reached;
    }
    if (MODEL.read) {
        MODEL.read(unit->model, bytes); /* its lists lie in the spare space */
        const Space old = unit->space;
        unit->space = unit->spare;
        unit->spare = old;
        unit->live = unit->space.taken;
    }
    exchange_begin(unit);
}

Status state_set(Unit *unit, const State *state)
{
    const size_t token = strlen(UNIT_TOKEN) + 1, head = token + sizeof(int64_t);
    int64_t sum = 0;
    bool exchange = false;
    if (!state)
        return unit_say(unit, ERROR, "setFMUstate: there is no state");
    Bytes bytes = {(unsigned char *)state->bytes, state->size, head, &unit->spare};
    if (state->size > head)
        memcpy(&sum, state->bytes + token, sizeof sum);
    if (state->size <= head || memcmp(state->bytes, UNIT_TOKEN, token) != 0 ||
        sum != sum_of(state->bytes + head, state->size - head))
        return unit_say(unit, DISCARD, "setFMUstate: these bytes are no state of this unit; nothing was changed");
    space_empty(&unit->spare);
    if (setjmp(unit->refusal.back)) {
        unit->initialised = false;
        memcpy(unit->failure, unit->refusal.message, sizeof unit->failure);
        return unit_say(unit, ERROR, "setFMUstate: %s", unit->refusal.message);
    }
    read_bool(&bytes, &exchange);
    if (exchange != unit->exchange)
        return unit_say(
            unit, DISCARD, "setFMUstate: this is a state of an instance for %s; nothing was changed",
            exchange ? "model exchange" : "co-simulation");
    read_state(unit, &bytes);
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
