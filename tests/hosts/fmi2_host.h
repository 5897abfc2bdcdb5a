/* What the hosts in C share: loading a unit, its functions, callbacks, and a check of every status. */
#ifndef FMI2_HOST_H
#define FMI2_HOST_H

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
static void *load(const char *path) { return (void *)LoadLibraryA(path); }
static void *find(void *library, const char *name) { return (void *)GetProcAddress((HMODULE)library, name); }
#else
#include <dlfcn.h>
static void *load(const char *path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static void *find(void *library, const char *name) { return dlsym(library, name); }
#endif

enum { OK = 0, DISCARD = 2, FAILURE = 3, MOST = 256 };

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
    void *found = find(library, name);
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

typedef struct {
    void *(*instantiate)(const char *, int, const char *, const char *, const Callbacks *, int, int);
    int (*setup)(void *, int, double, double, int, double);
    int (*enter)(void *);
    int (*leave)(void *);
    int (*set_real)(void *, const unsigned *, size_t, const double *);
    int (*get_real)(void *, const unsigned *, size_t, double *);
    int (*set_string)(void *, const unsigned *, size_t, const char *const *);
    int (*step)(void *, double, double, int);
    int (*terminate)(void *);
    void (*release)(void *);
} Functions;

/* Functions of the library of a unit. */
static Functions functions_of(void *library)
{
    Functions f;
    *(void **)&f.instantiate = symbol(library, "fmi2Instantiate");
    *(void **)&f.setup = symbol(library, "fmi2SetupExperiment");
    *(void **)&f.enter = symbol(library, "fmi2EnterInitializationMode");
    *(void **)&f.leave = symbol(library, "fmi2ExitInitializationMode");
    *(void **)&f.set_real = symbol(library, "fmi2SetReal");
    *(void **)&f.get_real = symbol(library, "fmi2GetReal");
    *(void **)&f.set_string = symbol(library, "fmi2SetString");
    *(void **)&f.step = symbol(library, "fmi2DoStep");
    *(void **)&f.terminate = symbol(library, "fmi2Terminate");
    *(void **)&f.release = symbol(library, "fmi2FreeInstance");
    return f;
}

typedef struct {
    int (*save)(void *, void **);
    int (*restore)(void *, void *);
    int (*release)(void *, void **);
    int (*size_of)(void *, void *, size_t *);
    int (*serialise)(void *, void *, char *, size_t);
    int (*deserialise)(void *, const char *, size_t, void **);
} States;

/* Functions of the library of a unit for its states. */
static States states_of(void *library)
{
    States s;
    *(void **)&s.save = symbol(library, "fmi2GetFMUstate");
    *(void **)&s.restore = symbol(library, "fmi2SetFMUstate");
    *(void **)&s.release = symbol(library, "fmi2FreeFMUstate");
    *(void **)&s.size_of = symbol(library, "fmi2SerializedFMUstateSize");
    *(void **)&s.serialise = symbol(library, "fmi2SerializeFMUstate");
    *(void **)&s.deserialise = symbol(library, "fmi2DeSerializeFMUstate");
    return s;
}

/* Load the library at ``path``, or end. */
static void *opened(const char *path)
{
    void *library = load(path);
    if (!library) {
        fprintf(stderr, "%s cannot be loaded\n", path);
        exit(3);
    }
    return library;
}

/* Initialise an instance at t = 0; a ``reference`` of -1 sets no text. */
static void initialise(const Functions *f, void *unit, int reference, const char *text)
{
    const unsigned place = (unsigned)reference;
    check(f->setup(unit, 0, 0.0, 0.0, 0, 0.0), OK, "fmi2SetupExperiment");
    if (reference >= 0)
        check(f->set_string(unit, &place, 1, &text), OK, "fmi2SetString");
    check(f->enter(unit), OK, "fmi2EnterInitializationMode");
    check(f->leave(unit), OK, "fmi2ExitInitializationMode");
}

#endif
