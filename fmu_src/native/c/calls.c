#include "calls.h"

#include <stdlib.h>
#include <string.h>

const char *const CATEGORIES[] = {
    "logAll", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusError"};

void note(Status *worst, Status status)
{
    if (status > *worst)
        *worst = status;
}

typedef struct {
    size_t size;
    unsigned char bytes[];
} State;

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

Status state_get(Unit *unit, const char *call, void **state)
{
    const size_t size = unit_state_size(unit);
    State *kept = with_room(unit, call, size, state);
    return kept ? unit_save(unit, kept->bytes, size) : ERROR;
}

Status state_set(Unit *unit, const char *call, const void *state)
{
    const State *kept = state;
    if (!kept)
        return unit_say(unit, ERROR, "%s: there is no state", call);
    return unit_restore(unit, kept->bytes, kept->size);
}

void state_free(void **state)
{
    free(*state);
    *state = NULL;
}

size_t state_size(const void *state)
{
    return ((const State *)state)->size;
}

Status state_serialise(Unit *unit, const char *call, const void *state, void *bytes, size_t size)
{
    const State *kept = state;
    if (size < kept->size)
        return unit_say(unit, ERROR, "%s: the state has %zu bytes, not %zu", call, kept->size, size);
    memcpy(bytes, kept->bytes, kept->size);
    return OK;
}

Status state_deserialise(Unit *unit, const char *call, const void *bytes, size_t size, void **state)
{
    State *kept = with_room(unit, call, size, state);
    if (!kept)
        return ERROR;
    memcpy(kept->bytes, bytes, size);
    return OK;
}
