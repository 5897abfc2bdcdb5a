/* Memory of a unit: lists are taken from a space one after the other and given back all at once.
 *
 * A step never changes the lists of the step before, so that a refused step leaves the unit as it was. A refusal
 * (an exception of Python) goes back to the call of the host that asked for the step.
 */
#ifndef MEMORY_H
#define MEMORY_H

#include <setjmp.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { MESSAGE_SIZE = 1024, NUMBER_SIZE = 40 };

/* Where a refusal goes, and its reason. */
typedef struct {
    jmp_buf back;
    char message[MESSAGE_SIZE];
} Refusal;

typedef struct Chunk Chunk;

typedef struct {
    Chunk *chunks; /* the newest first */
    size_t taken;  /* bytes since the space was emptied */
    Refusal *refusal;
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

/* Write the shortest text that reads back as the same number, as repr() does. */
const char *write_shortest(char text[NUMBER_SIZE], double value);
const char *shortest(Space *space, double value);

/* Elements that a growing list of ``count`` has room for: 4, 8, 16, ... */
static inline int64_t room_for(int64_t count)
{
    int64_t room = 4;
    while (room < count)
        room *= 2;
    return room;
}

/* Whether a list has to be moved before it grows. */
static inline bool is_full(int64_t count)
{
    return count == 0 || (count >= 4 && (count & (count - 1)) == 0);
}

/* Bytes that a value is written to or read from. Without ``at`` writing only counts. */
typedef struct {
    unsigned char *at;
    size_t size, used;
    Space *space; /* for lists that are read */
} Bytes;

void write_bytes(Bytes *bytes, const void *from, size_t size);
void read_bytes(Bytes *bytes, void *to, size_t size);

/* The values of C itself are written as they are; a bool must be 0 or 1, a list has a byte an element at least. */
#define PLAIN(type) \
    static inline void write_##type(Bytes *bytes, const type *x) { write_bytes(bytes, x, sizeof *x); } \
    static inline void read_##type(Bytes *bytes, type *x) { read_bytes(bytes, x, sizeof *x); }
PLAIN(double)
PLAIN(int64_t)
void write_bool(Bytes *bytes, const bool *x);
void read_bool(Bytes *bytes, bool *x);
void read_count(Bytes *bytes, int64_t *count);

#endif
