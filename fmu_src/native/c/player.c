/* LogPlayer: shows at each time the last row of a log up to that time.
 *
 * It reads the same CSV as fmu_src/units/log_player.py, with the same messages if the log cannot be played.
 */
#define _POSIX_C_SOURCE 200809L
#include "unit.h"
#include "variables.h"

#include <errno.h>
#include <locale.h>
#include <stdio.h>
#include <sys/stat.h>

#ifndef S_ISREG
#define S_ISREG(mode) (((mode) & S_IFMT) == S_IFREG)
#endif

#ifdef _WIN32 /* names of FMI are UTF-8, those of fopen and stat in the code page of the system */
__declspec(dllimport) int __stdcall MultiByteToWideChar(unsigned, unsigned long, const char *, int, wchar_t *, int);
typedef struct _stat64 FileStatus;

static const wchar_t *wide(Space *space, const char *path)
{
    const int size = (int)strlen(path) + 1; /* no text is longer in UTF-16 */
    wchar_t *name = space_take(space, size, sizeof *name);
    MultiByteToWideChar(65001, 0, path, -1, name, size); /* from UTF-8 */
    return name;
}
#define READ_STATUS(path, status) _wstat64(wide(space, path), status)
#define OPEN(path) _wfopen(wide(space, path), L"rb")
#else
typedef struct stat FileStatus;
#define READ_STATUS(path, status) stat(path, status)
#define OPEN(path) fopen(path, "rb")
#endif

enum { SIGNALS = 5, COLUMNS = SIGNALS + 1, QUOTED_LENGTH = 300 };

static const double DEGREE = 0.017453292519943295; /* math.radians(1.0) [rad] */
static const char BLANKS[] = " \t\r\v\f";

/* Accepted headers of each column, the first in SI, the second in degrees. */
static const char *const HEADERS[COLUMNS][2] = {
    {"time [s]", NULL}, {"v_front [V]", NULL}, {"v_rear [V]", NULL}, {"pitch [rad]", "pitch [deg]"},
    {"elevation [rad]", "elevation [deg]"}, {"travel [rad]", "travel [deg]"}};

struct Model {
    int64_t count;
    double (*rows)[COLUMNS]; /* time since the first row [s], front and rear voltage [V], pitch, elevation, travel [rad] */
};

/* The file as a text that ends in a zero, without the byte order mark of UTF-8. */
static char *read_text(Space *space, const char *path)
{
    FileStatus status = {0};
    if (!path[0])
        refuse(space, "log.path is empty: set it to a CSV log before initialisation ends");
    if (READ_STATUS(path, &status) == 0 && !S_ISREG(status.st_mode))
        refuse(space, "the log %s is no file", path);
    const size_t size = (size_t)status.st_size;
    char *text = space_take(space, (int64_t)size + 1, 1);
    FILE *file = OPEN(path);
    if (!file)
        refuse(space, "the log %s cannot be read: %s", path, strerror(errno));
    const size_t bytes_read = fread(text, 1, size, file);
    fclose(file);
    if (bytes_read != size)
        refuse(space, "the log %s cannot be read: %s", path, strerror(EIO));
    if (memchr(text, '\0', size))
        refuse(space, "the log %s holds a NUL byte: it is no text", path);
    text[size] = '\0';
    if (strchr(text, '"'))
        refuse(space, "the log %s holds a quote: write its cells without quotes", path);
    return strncmp(text, "\xef\xbb\xbf", 3) == 0 ? text + 3 : text;
}

/* The beginning of a text as ASCII. */
static const char *ascii(Space *space, const char *text)
{
    char *out = space_take(space, QUOTED_LENGTH + 1, 1);
    int i = 0;
    for (; i < QUOTED_LENGTH && text[i]; i++)
        out[i] = (unsigned char)text[i] < 128 ? text[i] : '?';
    out[i] = '\0';
    return out;
}

/* End the line at ``at`` with a zero; return the next one, or NULL. */
static char *end_line(char *at)
{
    char *end = strchr(at, '\n');
    if (end)
        *end++ = '\0';
    return end;
}

/* Take the next cell of a line, in place and without the blanks around it; false after the last one. */
static bool next_cell(char **at, char **cell)
{
    if (!*at)
        return false;
    char *end = *at + strcspn(*at, ",");
    *cell = *at + strspn(*at, BLANKS);
    *at = *end ? end + 1 : NULL;
    *end = '\0';
    while (end > *cell && strchr(BLANKS, end[-1]))
        *--end = '\0';
    return true;
}

/* The decimal number in a cell, with a point in any locale of the host; NaN if it is none. */
static double read_number(Space *space, char *cell)
{
    static const char DIGITS[] = "0123456789";
    const char *at = cell + (*cell == '+' || *cell == '-');
    const size_t whole = strspn(at, DIGITS);
    char *point = cell + (at - cell) + whole;
    const size_t decimals = *point == '.' ? strspn(point + 1, DIGITS) : 0;
    at = point + (*point == '.') + decimals;
    if (*at == 'e' || *at == 'E') {
        at += 1 + (at[1] == '+' || at[1] == '-');
        const size_t exponent = strspn(at, DIGITS);
        at = exponent ? at + exponent : cell;
    }
    if (whole + decimals == 0 || *at)
        return NAN;
    const char *mark = localeconv()->decimal_point;
    if (*point != '.')
        return strtod(cell, NULL);
    if (mark[1]) { /* of several bytes, as in ps_AF */
        const size_t size = strlen(cell) + strlen(mark);
        char *text = space_take(space, (int64_t)size, 1);
        snprintf(text, size, "%.*s%s%s", (int)(point - cell), cell, mark, point + 1);
        return strtod(text, NULL);
    }
    *point = *mark;
    const double value = strtod(cell, NULL);
    *point = '.';
    return value;
}

/* Find the place and the factor to SI of time and each signal. */
static void find_columns(
    Space *space, const char *path, char *line, int64_t places[], double factors[], const char *headers[])
{
    int found[COLUMNS] = {0};
    const char *shown = ascii(space, line);
    char *cell = NULL;
    for (int64_t i = 0; next_cell(&line, &cell); i++) {
        for (int k = 0; k < 2 * COLUMNS; k++) {
            if (HEADERS[k / 2][k % 2] && strcmp(HEADERS[k / 2][k % 2], cell) == 0) {
                places[k / 2] = i;
                factors[k / 2] = k % 2 ? DEGREE : 1.0;
                headers[k / 2] = HEADERS[k / 2][k % 2];
                found[k / 2]++;
            }
        }
    }
    for (int k = 0; k < COLUMNS; k++) {
        char count[32] = "no column";
        const char *const *accepted = HEADERS[k];
        if (found[k] > 1)
            snprintf(count, sizeof count, "%d columns", found[k]);
        if (found[k] != 1)
            refuse(
                space, "the log %s has %s '%s'%s%s%s; its header is: %s", path, count, accepted[0],
                accepted[1] ? " or '" : "", accepted[1] ? accepted[1] : "", accepted[1] ? "'" : "", shown);
    }
}

static void read_log(Model *model, Space *space, const char *path)
{
    int64_t places[COLUMNS], most = 1;
    double factors[COLUMNS], first = 0.0, last = 0.0;
    const char *headers[COLUMNS];
    char *line = read_text(space, path), *next = end_line(line);
    find_columns(space, path, line, places, factors, headers);
    for (const char *c = next; c && *c; c = strchr(c + 1, '\n'))
        most++;
    model->rows = space_take(space, most, sizeof *model->rows);
    for (long long row = 2; (line = next); row++) {
        char *cells[COLUMNS] = {"", "", "", "", "", ""}, *cell = NULL;
        double *values = model->rows[model->count];
        next = end_line(line);
        if (line[strspn(line, BLANKS)] == '\0')
            continue;
        for (int64_t i = 0; next_cell(&line, &cell); i++) {
            for (int k = 0; k < COLUMNS; k++)
                cells[k] = places[k] == i ? cell : cells[k];
        }
        for (int k = 0; k < COLUMNS; k++) {
            values[k] = read_number(space, cells[k]) * factors[k];
            if (!isfinite(values[k]))
                refuse(
                    space, "the log %s, row %lld, column '%s': '%s' is not a finite number", path, row, headers[k],
                    ascii(space, cells[k]));
        }
        if (model->count && values[0] <= last)
            refuse(
                space, "the log %s, row %lld: time = %g s must be greater than %g s, the time of the row before", path,
                row, values[0], last);
        last = values[0];
        if (model->count++ == 0)
            first = last;
        values[0] -= first;
    }
    if (!model->count)
        refuse(space, "the log %s has no rows below its header", path);
}

static void show(const Model *model, Unit *unit, double time, double step)
{
    const double elapsed = time - unit->start_time, since_first = elapsed + unit->values[REF_log_start].real;
    int64_t first = 1, beyond = model->count; /* the first row that is later, from the second one on */
    while (first < beyond) {
        const int64_t middle = (first + beyond) / 2;
        if (since_first < model->rows[middle][0])
            beyond = middle;
        else
            first = middle + 1;
    }
    if (first < model->count) {
        const double due = model->rows[first][0], interval = due - model->rows[first - 1][0];
        first += due - since_first <= slave_base_time_tolerance(time, elapsed, fmin(step, interval));
    }
    for (int k = 0; k < SIGNALS; k++)
        unit->values[k].real = model->rows[first - 1][k + 1]; /* the first of VARIABLES */
}

static void initialise(Model *model, Unit *unit)
{
    read_log(model, &unit->permanent, unit->values[REF_log_path].text);
    show(model, unit, unit->start_time, INFINITY);
}

static void advance(Model *model, Unit *unit, double time, double step)
{
    show(model, unit, time + step, step);
}

const ModelFunctions MODEL = {sizeof(Model), initialise, advance, NULL}; /* outputs follow from the time */
