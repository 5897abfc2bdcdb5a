/* Memory of a unit: lists are taken from a space one after the other and given back all at once.
 *
 * A step never changes the lists of the step before, so that a refused step leaves the unit as it was. A refusal
 * (an exception of Python) goes back to the call of the host that asked for the step.
 */
#ifndef SPACE_H
#define SPACE_H

#include <setjmp.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { MESSAGE_SIZE = 1024 };

typedef struct Chunk Chunk;

typedef struct {
    Chunk *chunks;              /* the newest first */
    size_t taken;               /* bytes since the space was emptied */
    jmp_buf *back;              /* where a refusal goes */
    char message[MESSAGE_SIZE]; /* its reason */
} Space;

/* Return room for ``count`` elements; it lasts until the space is emptied. */
void *space_take(Space *space, int64_t count, size_t element);

/* Take everything back; the largest piece of memory is kept for later. */
void space_empty(Space *space);

/* Take everything back and return the memory to the system. */
void space_free(Space *space);

/* Refuse the call of the host: printf's format and values. */
#if defined(_MSC_VER)
__declspec(noreturn)
#else
_Noreturn
#endif
void refuse(Space *space, const char *format, ...);

enum { NUMBER_SIZE = 40 };

/* Write the shortest text that reads back as the same number, as repr() does. */
void write_shortest(char text[NUMBER_SIZE], double value);
const char *shortest(Space *space, double value);

/* Elements that a growing list of ``count`` has room for, and whether it has to be moved before it grows. */
static inline int64_t room_for(int64_t count)
{
    int64_t room = 4;
    while (room < count)
        room *= 2;
    return room;
}

static inline bool is_full(int64_t count)
{
    return count == 0 || (count >= 4 && (count & (count - 1)) == 0);
}

/* Bytes that a value is written to or read from. Without ``at`` writing only counts. */
typedef struct {
    unsigned char *at;
    size_t size, used;
    Space *space;
} Bytes;

void write_bytes(Bytes *bytes, const void *from, size_t size);
void read_bytes(Bytes *bytes, void *to, size_t size);

static inline void write_double(Bytes *bytes, const double *x)
{
    write_bytes(bytes, x, sizeof *x);
}

static inline void write_int64_t(Bytes *bytes, const int64_t *x)
{
    write_bytes(bytes, x, sizeof *x);
}

static inline void write_bool(Bytes *bytes, const bool *x)
{
    const unsigned char byte = *x;
    write_bytes(bytes, &byte, 1);
}

static inline void read_double(Bytes *bytes, double *x)
{
    read_bytes(bytes, x, sizeof *x);
}

static inline void read_int64_t(Bytes *bytes, int64_t *x)
{
    read_bytes(bytes, x, sizeof *x);
}

static inline void read_bool(Bytes *bytes, bool *x)
{
    unsigned char byte = 0;
    read_bytes(bytes, &byte, 1);
    *x = byte != 0;
}

/* Read the length of a list, of which every element has a byte at least. */
static inline void read_count(Bytes *bytes, int64_t *count)
{
    read_bytes(bytes, count, sizeof *count);
    if (*count < 0 || (uint64_t)*count > bytes->size - bytes->used)
        refuse(bytes->space, "these bytes are no state of this unit");
}

#endif
