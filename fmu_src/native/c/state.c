#include "unit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The state as bytes: a signature, the phase, the values, and the model's memory between steps. */

static void write_state(Unit *unit, Bytes *bytes)
{
    const int64_t phase = unit->phase, failure = (int64_t)strlen(unit->failure) + 1;
    write_bytes(bytes, UNIT_TOKEN, strlen(UNIT_TOKEN) + 1);
    write_int64_t(bytes, &phase);
    write_int64_t(bytes, &failure);
    write_bytes(bytes, unit->failure, (size_t)failure);
    write_bool(bytes, &unit->initialised);
    write_double(bytes, &unit->start_time);
    write_double(bytes, &unit->reached);
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        write_double(bytes, &unit->values[i].real);
        write_bool(bytes, &unit->refused[i]);
        write_double(bytes, &unit->refused_as[i]);
        if (VARIABLES[i].kind == STRING) {
            const int64_t length = (int64_t)strlen(unit->values[i].text) + 1;
            write_int64_t(bytes, &length);
            write_bytes(bytes, unit->values[i].text, (size_t)length);
        }
    }
    if (unit->initialised)
        model_write(unit->model, bytes);
}

size_t unit_state_size(Unit *unit)
{
    Bytes bytes = {NULL, 0, 0, unit->space};
    if (unit->outdated)
        unit_prepare(unit, "getFMUstate");
    write_state(unit, &bytes);
    return bytes.used;
}

Status unit_save(Unit *unit, unsigned char *at, size_t size)
{
    Bytes bytes = {at, size, 0, unit->space};
    if (unit_state_size(unit) != size)
        return unit_say(unit, ERROR, "the state has %zu bytes, not %zu", unit_state_size(unit), size);
    write_state(unit, &bytes);
    return OK;
}

/* What a state holds besides the model's memory, read before anything is changed. */
typedef struct {
    int64_t phase;
    char *failure;
    bool initialised;
    double start_time, reached;
    Value *values;
    bool *refused;
    double *refused_as;
} Saved;

/* Read a text behind its length, its zero included. */
static char *read_text(Bytes *bytes, Space *space)
{
    int64_t count = 0;
    read_count(bytes, &count);
    if (count < 1)
        refuse(space, "these bytes are no state of this unit");
    char *text = space_take(space, count, 1);
    read_bytes(bytes, text, (size_t)count);
    text[count - 1] = '\0';
    return text;
}

static void read_saved(Bytes *bytes, Space *space, Saved *saved)
{
    char token[64] = "";
    const size_t length = strlen(UNIT_TOKEN) + 1;
    read_bytes(bytes, token, length < sizeof token ? length : sizeof token);
    if (memcmp(token, UNIT_TOKEN, length < sizeof token ? length : sizeof token) != 0)
        refuse(space, "these bytes are no state of this unit");
    read_int64_t(bytes, &saved->phase);
    saved->failure = read_text(bytes, space);
    read_bool(bytes, &saved->initialised);
    read_double(bytes, &saved->start_time);
    read_double(bytes, &saved->reached);
    if (saved->phase < INSTANTIATED || saved->phase > TERMINATED)
        refuse(space, "these bytes are no state of this unit");
    saved->values = space_take(space, (int64_t)VARIABLE_COUNT, sizeof *saved->values);
    saved->refused = space_take(space, (int64_t)VARIABLE_COUNT, sizeof *saved->refused);
    saved->refused_as = space_take(space, (int64_t)VARIABLE_COUNT, sizeof *saved->refused_as);
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        read_double(bytes, &saved->values[i].real);
        read_bool(bytes, &saved->refused[i]);
        read_double(bytes, &saved->refused_as[i]);
        saved->values[i].text = NULL;
        if (VARIABLES[i].kind == STRING)
            saved->values[i].text = read_text(bytes, space);
    }
}

/* Set the values; return whether a parameter or the start time differs from what the model was initialised with. */
static bool take_values(Unit *unit, const Saved *saved)
{
    bool other = unit->start_time != saved->start_time || !unit->initialised;
    unit->refused_count = 0;
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        const bool fixed = VARIABLES[i].causality == PARAMETER && !VARIABLES[i].tunable;
        const bool settable = VARIABLES[i].causality == INPUT || VARIABLES[i].causality == PARAMETER;
        const bool kept = settable && !exchange_lets_change(unit, (uint32_t)i);
        other |= (fixed || kept) && unit->values[i].real != saved->values[i].real;
        if (VARIABLES[i].kind == STRING && strcmp(unit->values[i].text, saved->values[i].text) != 0) {
            char *copy = unit_copied(saved->values[i].text);
            if (!copy)
                refuse(unit->space, "there is no memory left");
            free(unit->values[i].text);
            unit->values[i].text = copy;
            other = true;
        }
        unit->values[i].real = saved->values[i].real;
        unit->refused[i] = saved->refused[i];
        unit->refused_as[i] = saved->refused_as[i];
        unit->refused_count += saved->refused[i];
    }
    unit->start_time = saved->start_time;
    return other;
}

Status unit_restore(Unit *unit, const unsigned char *at, size_t size)
{
    jmp_buf back;
    Bytes bytes = {(unsigned char *)at, size, 0, unit->spare};
    Saved saved = {0};
    space_empty(unit->spare);
    unit->spare->back = &back;
    if (setjmp(back))
        return unit_say(unit, DISCARD, "setFMUstate: %s; nothing was changed", unit->spare->message);
    read_saved(&bytes, unit->spare, &saved);
    if (saved.initialised) { /* read once for nothing: bytes that hold no memory must change nothing */
        Bytes trial = bytes;
        model_read(memset(space_take(unit->spare, 1, MODEL_SIZE), 0, MODEL_SIZE), &trial);
    }
    unit->space->back = unit->settled->back = &back;
    const bool other = take_values(unit, &saved);
    unit->phase = (Phase)saved.phase;
    snprintf(unit->failure, sizeof unit->failure, "%s", saved.failure);
    unit->outdated = unit->phase == INITIALISING;
    if (!saved.initialised)
        return OK;
    if (other) {
        if (unit_prepare(unit, "setFMUstate") != OK)
            return ERROR;
        for (size_t i = 0; i < VARIABLE_COUNT; i++) /* the initialisation has set the outputs of the start time */
            unit->values[i].real = saved.values[i].real;
    }
    unit->reached = saved.reached;
    unit->spare->back = &back;
    model_read(unit->model, &bytes); /* its lists lie in the spare space */
    Space *old = unit->space;
    unit->space = unit->spare;
    unit->spare = old;
    unit->live = unit->space->taken;
    exchange_begin(unit);
    return OK;
}
