#include "log_file.h"

#include <ctype.h>
#include <errno.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS = LOG_SIGNALS + 1, MOST_CELLS = 1024 };

static const double DEGREE = 0.017453292519943295; /* math.radians(1.0) [rad] */

typedef struct {
    const char *header;
    int column;
    double factor;
} Header;

static const Header HEADERS[] = {
    {"time [s]", 0, 1.0},     {"v_front [V]", 1, 1.0},      {"v_rear [V]", 2, 1.0},
    {"pitch [rad]", 3, 1.0},  {"elevation [rad]", 4, 1.0},  {"travel [rad]", 5, 1.0},
    {"pitch [deg]", 3, DEGREE}, {"elevation [deg]", 4, DEGREE}, {"travel [deg]", 5, DEGREE},
};
static const char *const WANTED[COLUMNS] = {
    "'time [s]'", "'v_front [V]'", "'v_rear [V]'", "'pitch [rad]' or 'pitch [deg]'",
    "'elevation [rad]' or 'elevation [deg]'", "'travel [rad]' or 'travel [deg]'"};

/* The whole file as text that ends in a zero. */
static char *contents(Space *space, const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        refuse(space, "the log %s cannot be read: %s", path, strerror(errno));
    long size = -1;
    if (fseek(file, 0, SEEK_END) == 0)
        size = ftell(file);
    if (size < 0 || fseek(file, 0, SEEK_SET) != 0) {
        fclose(file);
        refuse(space, "the log %s cannot be read: %s", path, strerror(errno));
    }
    char *text = malloc((size_t)size + 1);
    const size_t got = text ? fread(text, 1, (size_t)size, file) : 0;
    fclose(file);
    if (!text || got != (size_t)size) {
        free(text);
        refuse(space, "the log %s cannot be read", path);
    }
    char *kept = memcpy(space_take(space, (int64_t)size + 1, 1), text, (size_t)size);
    free(text);
    kept[size] = '\0';
    return strncmp(kept, "\xef\xbb\xbf", 3) == 0 ? kept + 3 : kept;
}

/* Split the row at ``at`` into cells, in place; return what follows it, or NULL at the end of the file.
 *
 * A cell in quotes may hold commas and line ends; two quotes in it are one. Blanks around cells are dropped.
 */
static char *split(char *at, char **cells, int *count, int64_t *line)
{
    *count = 0;
    for (;;) {
        while (*at == ' ')
            at++;
        char *to = at, *cell = at;
        bool quoted = *at == '"';
        if (quoted) {
            at++;
            for (; *at; at++) {
                if (*at == '"' && at[1] == '"')
                    at++;
                else if (*at == '"')
                    break;
                *line += *at == '\n';
                *to++ = *at;
            }
            at += *at == '"';
        }
        while (*at && *at != ',' && *at != '\n' && *at != '\r')
            *to++ = *at++;
        const char end = *at;
        at += end != '\0';
        if (end == '\r' && *at == '\n')
            at++;
        *to = '\0';
        while (to > cell && isspace((unsigned char)to[-1]))
            *--to = '\0';
        while (isspace((unsigned char)*cell))
            cell++;
        if (*count < MOST_CELLS)
            cells[(*count)++] = cell;
        if (end != ',') {
            ++*line;
            return *at ? at : NULL;
        }
    }
}

/* A number with a decimal point, whatever the locale of the host; NaN if the cell is none. */
static double number(const char *cell)
{
    char text[128], *end;
    const size_t length = strlen(cell);
    if (length == 0 || length >= sizeof text || strpbrk(cell, "xXpP"))
        return NAN;
    memcpy(text, cell, length + 1);
    char *point = strchr(text, '.');
    if (point)
        *point = *localeconv()->decimal_point;
    const double value = strtod(text, &end);
    return *end ? NAN : value;
}

/* Find the place and the factor to SI of time and each signal. */
static void find_columns(
    Space *space, const char *path, char **cells, int count, int *places, double *factors, const char **headers)
{
    for (int column = 0; column < COLUMNS; column++) {
        int found = 0;
        for (int i = 0; i < count; i++) {
            for (size_t k = 0; k < sizeof HEADERS / sizeof HEADERS[0]; k++) {
                if (HEADERS[k].column == column && strcmp(HEADERS[k].header, cells[i]) == 0) {
                    places[column] = i;
                    factors[column] = HEADERS[k].factor;
                    headers[column] = HEADERS[k].header;
                    found++;
                }
            }
        }
        if (found == 0)
            refuse(space, "the log %s has no column %s", path, WANTED[column]);
        if (found > 1)
            refuse(space, "the log %s has %d columns %s", path, found, WANTED[column]);
    }
}

Log read_log(Space *space, const char *path)
{
    int places[COLUMNS] = {0}, count = 0;
    double factors[COLUMNS] = {0}, row[COLUMNS] = {0};
    const char *headers[COLUMNS] = {0};
    if (!path[0])
        refuse(space, "log.path is empty: set it to a CSV log before initialisation ends");
    char **cells = space_take(space, MOST_CELLS, sizeof *cells);
    char *at = contents(space, path);
    int64_t line = 0, most = 1;
    for (const char *c = at; *c; c++)
        most += *c == '\n' || *c == '\r';
    at = split(at, cells, &count, &line);
    find_columns(space, path, cells, count, places, factors, headers);
    Log log = {
        0, space_take(space, most, sizeof(double)), space_take(space, most, LOG_SIGNALS * sizeof(double))};
    double first = 0.0, last = 0.0;
    while (at) {
        at = split(at, cells, &count, &line);
        if (count == 1 && !cells[0][0])
            continue;
        for (int column = 0; column < COLUMNS; column++) {
            const char *cell = places[column] < count ? cells[places[column]] : "";
            row[column] = number(cell) * factors[column];
            if (!isfinite(row[column]))
                refuse(
                    space, "the log %s, row %lld, column '%s': '%s' is not a finite number", path, (long long)line,
                    headers[column], cell);
        }
        if (log.count && row[0] <= last)
            refuse(
                space, "the log %s, row %lld: time = %g s must be greater than %g s, the time of the row before", path,
                (long long)line, row[0], last);
        last = row[0];
        if (!log.count)
            first = row[0];
        log.times[log.count] = row[0] - first;
        memcpy(log.rows + log.count * LOG_SIGNALS, row + 1, LOG_SIGNALS * sizeof(double));
        log.count++;
    }
    if (!log.count)
        refuse(space, "the log %s has no rows below its header", path);
    return log;
}
