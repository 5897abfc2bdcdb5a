/* An FMI 2.0 host in C, as a tool without Python is: it loads a unit, steps it 50 times and prints its outputs.
 *
 * Usage: c_host LIBRARY RESOURCES_URI GUID STRING_REFERENCE STRING_VALUE INPUTS OUTPUTS
 * INPUTS and OUTPUTS are counts followed by value references; a STRING_REFERENCE of -1 sets no text.
 * After the steps it sends a NaN, expects fmi2Discard from the next step, then a good value and expects fmi2OK.
 */
#include <dlfcn.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { OK = 0, DISCARD = 2, MOST = 64 };

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

static int messages = 0;

static void logger(void *environment, const char *name, int status, const char *category, const char *format, ...)
{
    va_list values;
    (void)environment;
    messages++;
    fprintf(stderr, "[%s %d %s] ", name, status, category ? category : "");
    va_start(values, format);
    vfprintf(stderr, format, values);
    va_end(values);
    fputc('\n', stderr);
}

static void *symbol(void *library, const char *name)
{
    void *found = dlsym(library, name);
    if (!found) {
        fprintf(stderr, "no symbol %s\n", name);
        exit(3);
    }
    return found;
}

static void check(int status, int expected, const char *call)
{
    if (status != expected) {
        fprintf(stderr, "%s answered %d, not %d\n", call, status, expected);
        exit(4);
    }
}

static size_t references(int *argument, char **argv, unsigned *out)
{
    size_t count = (size_t)atoi(argv[(*argument)++]);
    for (size_t i = 0; i < count; i++)
        out[i] = (unsigned)atoi(argv[(*argument)++]);
    return count;
}

int main(int argc, char **argv)
{
    unsigned read[MOST], shown[MOST];
    double fed[MOST], values[MOST];
    int argument = 6;
    if (argc < 8)
        return 2;
    void *library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fprintf(stderr, "%s\n", dlerror());
        return 3;
    }
    void *(*instantiate)(const char *, int, const char *, const char *, const Callbacks *, int, int) =
        symbol(library, "fmi2Instantiate");
    int (*setup)(void *, int, double, double, int, double) = symbol(library, "fmi2SetupExperiment");
    int (*enter)(void *) = symbol(library, "fmi2EnterInitializationMode");
    int (*leave)(void *) = symbol(library, "fmi2ExitInitializationMode");
    int (*set_real)(void *, const unsigned *, size_t, const double *) = symbol(library, "fmi2SetReal");
    int (*get_real)(void *, const unsigned *, size_t, double *) = symbol(library, "fmi2GetReal");
    int (*set_string)(void *, const unsigned *, size_t, const char *const *) = symbol(library, "fmi2SetString");
    int (*step)(void *, double, double, int) = symbol(library, "fmi2DoStep");
    int (*terminate)(void *) = symbol(library, "fmi2Terminate");
    void (*release)(void *) = symbol(library, "fmi2FreeInstance");

    Callbacks callbacks = {logger, calloc, free, NULL, NULL};
    void *unit = instantiate("unit", 1, argv[3], argv[2], &callbacks, 0, 1);
    if (!unit)
        return 5;
    check(setup(unit, 0, 0.0, 0.0, 0, 0.0), OK, "fmi2SetupExperiment");
    if (atoi(argv[4]) >= 0) {
        unsigned reference = (unsigned)atoi(argv[4]);
        const char *text = argv[5];
        check(set_string(unit, &reference, 1, &text), OK, "fmi2SetString");
    }
    check(enter(unit), OK, "fmi2EnterInitializationMode");
    check(leave(unit), OK, "fmi2ExitInitializationMode");
    size_t inputs = references(&argument, argv, read), outputs = references(&argument, argv, shown);
    for (int k = 0; k < 50; k++) {
        for (size_t i = 0; i < inputs; i++)
            fed[i] = 0.01 * k * (double)(i + 1);
        check(set_real(unit, read, inputs, fed), OK, "fmi2SetReal");
        check(step(unit, 0.01 * k, 0.01, 1), OK, "fmi2DoStep");
    }
    check(get_real(unit, shown, outputs, values), OK, "fmi2GetReal");
    check(messages, 0, "the log");
    for (size_t i = 0; i < outputs; i++)
        printf("%.17g\n", values[i]);
    if (inputs > 0) {
        double good = fed[0], bad = NAN;
        check(set_real(unit, read, 1, &bad), OK, "fmi2SetReal of a NaN");
        check(step(unit, 0.5, 0.01, 1), DISCARD, "fmi2DoStep after a NaN");
        check(step(unit, 0.5, 0.01, 1), DISCARD, "fmi2DoStep after a NaN, again");
        check(set_real(unit, read, 1, &good), OK, "fmi2SetReal after a NaN");
        check(step(unit, 0.5, 0.01, 1), OK, "fmi2DoStep after a good value");
        check(messages, 3, "the log of the NaN");
    }
    check(terminate(unit), OK, "fmi2Terminate");
    release(unit);
    fflush(stdout);
    _exit(0); /* pythonfmu's binary may abort while the interpreter ends */
}
