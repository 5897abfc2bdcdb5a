/* Memory of a unit: lists are allocated in a space one after the other and freed all at once.
 *
 * A step never changes the lists of the step before, so that a refused step changes nothing. A refusal (an exception
 * in Python) returns to the call of the host.
 */
#ifndef MEMORY_H
#define MEMORY_H

#include <setjmp.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { MESSAGE_SIZE = 1024, NUMBER_SIZE = 40 };

/* Return point and reason of a refusal. */
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

/* Free all lists; the largest piece of memory is kept for later. */
void space_empty(Space *space);

/* Free all lists and return the memory to the system. */
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

/* Bytes to which a value is written or, with ``reading``, from which it is read. Without ``at`` they are counted. */
typedef struct {
    unsigned char *at;
    size_t size, used;
    bool reading;
    Space *space; /* for lists that are read */
} Bytes;

/* Values of C's own types are copied; a bool must be 0 or 1, a list has at least a byte per element. */
void pass_bytes(Bytes *bytes, void *x, size_t size);
void pass_bool(Bytes *bytes, bool *x);
void pass_count(Bytes *bytes, int64_t *count);

#define PLAIN(type) \
    static inline void pass_##type(Bytes *bytes, type *x) { pass_bytes(bytes, x, sizeof *x); }
PLAIN(double)
PLAIN(int64_t)

#endif
