/* What the functions of FMI 2.0 and 3.0 share: categories of the log, the worst status, states on the heap. */
#ifndef CALLS_H
#define CALLS_H

#include "unit.h"

/* Category of the log, by the status of the message. */
extern const char *const CATEGORIES[];

/* Several values are set or read in one call: all are, and the worst status is returned. */
void note(Status *worst, Status status);

/* A state of the unit that the host keeps; ``call`` is what the version of FMI calls the function. */
Status state_get(Unit *unit, const char *call, void **state);
Status state_set(Unit *unit, const char *call, const void *state);
void state_free(void **state);
size_t state_size(const void *state);
Status state_serialise(Unit *unit, const char *call, const void *state, void *bytes, size_t size);
Status state_deserialise(Unit *unit, const char *call, const void *bytes, size_t size, void **state);

#endif
