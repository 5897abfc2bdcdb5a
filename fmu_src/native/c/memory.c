#include "memory.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ALIGNMENT = 16, SMALLEST_CHUNK = 1 << 16 };

struct Chunk {
    Chunk *next;
    size_t size, used;
    _Alignas(ALIGNMENT) unsigned char at[];
};

void *space_take(Space *space, int64_t count, size_t element)
{
    const size_t needed = ((size_t)count * element + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    Chunk *chunk = space->chunks;
    if (count < 0 || (size_t)count > SIZE_MAX / 2 / element)
        refuse(space, "a list of %lld elements is longer than memory", (long long)count);
    if (!chunk || chunk->size - chunk->used < needed) {
        const size_t doubled = chunk ? 2 * chunk->size : SMALLEST_CHUNK;
        const size_t size = needed > doubled ? needed : doubled;
        Chunk *more = malloc(sizeof *more + size);
        if (!more)
            refuse(space, "there is no memory left: %zu bytes were asked for", size);
        more->next = chunk;
        more->size = size;
        more->used = 0;
        space->chunks = chunk = more;
    }
    void *room = chunk->at + chunk->used;
    chunk->used += needed;
    space->taken += needed;
    return room;
}

static void free_chunks(Chunk *chunk)
{
    while (chunk) {
        Chunk *next = chunk->next;
        free(chunk);
        chunk = next;
    }
}

void space_empty(Space *space)
{
    if (space->chunks) { /* the newest is the largest */
        free_chunks(space->chunks->next);
        space->chunks->next = NULL;
        space->chunks->used = 0;
    }
    space->taken = 0;
}

void space_free(Space *space)
{
    free_chunks(space->chunks);
    space->chunks = NULL;
    space->taken = 0;
}

void refuse(Space *space, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    vsnprintf(space->refusal->message, MESSAGE_SIZE, format, values);
    va_end(values);
    longjmp(space->refusal->back, 1);
}

/* Python writes 1e-05 and 1e+16 with an exponent and all between with a point. */
const char *write_shortest(char text[NUMBER_SIZE], double value)
{
    if (!isfinite(value)) {
        snprintf(text, NUMBER_SIZE, "%s", isnan(value) ? "nan" : value > 0.0 ? "inf" : "-inf");
        return text;
    }
    int digits = 0;
    do
        snprintf(text, NUMBER_SIZE, "%.*e", digits, value);
    while (++digits < 17 && strtod(text, NULL) != value);
    const int exponent = atoi(strchr(text, 'e') + 1);
    if (exponent >= -4 && exponent < 16) {
        const int decimals = digits - 1 - exponent;
        snprintf(text, NUMBER_SIZE, "%.*f", decimals > 1 ? decimals : 1, value);
    }
    return text;
}

const char *shortest(Space *space, double value)
{
    return write_shortest(space_take(space, NUMBER_SIZE, 1), value);
}

static const char NO_STATE[] = "these bytes are no state of this unit";

void pass_bytes(Bytes *bytes, void *x, size_t size)
{
    if (bytes->reading && size > bytes->size - bytes->used)
        refuse(bytes->space, NO_STATE);
    if (bytes->at && size)
        memcpy(bytes->reading ? x : bytes->at + bytes->used, bytes->reading ? bytes->at + bytes->used : x, size);
    bytes->used += size;
}

void pass_bool(Bytes *bytes, bool *x)
{
    unsigned char byte = bytes->reading ? 0 : *x;
    pass_bytes(bytes, &byte, 1);
    if (byte > 1)
        refuse(bytes->space, NO_STATE);
    *x = byte;
}

void pass_count(Bytes *bytes, int64_t *count)
{
    pass_bytes(bytes, count, sizeof *count);
    if (bytes->reading && (*count < 0 || (uint64_t)*count > bytes->size - bytes->used))
        refuse(bytes->space, NO_STATE);
}
