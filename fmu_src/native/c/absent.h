/* Functions of FMI 3.0 that the unit does not offer; importers ask that every function is exported. */
#ifndef ABSENT_H
#define ABSENT_H

#include "fmi3Functions.h"
#include "unit.h"

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#define ABSENT(call, ...) \
    fmi3Status fmi3##call(__VA_ARGS__) \
    { \
        return (fmi3Status)unit_say(instance, ERROR, "%s: this unit does not offer it", #call); \
    }

#endif
