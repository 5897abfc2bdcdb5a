/* A measured log as CSV: time [s], v_front [V], v_rear [V], and the three angles in [rad] or [deg], in any order. */
#ifndef LOG_FILE_H
#define LOG_FILE_H

#include "memory.h"

enum { LOG_SIGNALS = 5 };

typedef struct {
    int64_t count;
    double *times; /* [s] since the first row */
    double *rows;  /* front and rear voltage [V], pitch, elevation, travel [rad] of each */
} Log;

/* Refuses a file that cannot be played: with file, row, column and reason. */
Log read_log(Space *space, const char *path);

#endif
