/* The functions of FMI 3.0; the time is the last variable. */
#include "fmi3Functions.h"
#include "unit.h"

#include <math.h>

typedef fmi3Instance Instance;
typedef fmi3ValueReference Reference;
typedef fmi3FMUState fmi3FMUstate;
#define FMI(name) fmi3##name
#define fmi3GetFMUstate fmi3GetFMUState
#define fmi3SetFMUstate fmi3SetFMUState
#define fmi3FreeFMUstate fmi3FreeFMUState
#define fmi3SerializeFMUstate fmi3SerializeFMUState
#define fmi3DeSerializeFMUstate fmi3DeserializeFMUState
#define fmi3SerializedFMUstateSize fmi3SerializedFMUStateSize
#define SIZE , size_t size
#define FITS fits(unit, count, size)
#define READ get_number

static bool fits(Unit *unit, size_t references, size_t values)
{
    if (references != values)
        unit_log(unit, ERROR, "%zu value references are given with %zu values", references, values);
    return references == values;
}

static Status get_number(Unit *unit, Kind kind, Reference reference, double *value)
{
    if (kind != REAL || reference != VARIABLE_COUNT)
        return unit_get(unit, kind, reference, value);
    *value = unit->reached;
    return OK;
}

#include "fmi.h"

static void report(Unit *unit, Status status, const char *message)
{
    const fmi3LogMessageCallback log = (fmi3LogMessageCallback)unit->log;
    if (unit->logging && log)
        log(unit->environment, (fmi3Status)status, CATEGORIES[status], message);
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const Reference required[], size_t required_count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    return instantiate(name, token, false, (void (*)(void))log, environment, logging);
}

fmi3Instance fmi3InstantiateModelExchange(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    return instantiate(name, token, true, (void (*)(void))log, environment, logging);
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback clock_update,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    if (log)
        log(environment, fmi3Error, "logStatusError", "instantiate: the unit has no scheduled execution");
    return NULL;
}

fmi3Status fmi3EnterInitializationMode(
    fmi3Instance unit, fmi3Boolean tolerance_defined, fmi3Float64 tolerance, fmi3Float64 start,
    fmi3Boolean stop_defined, fmi3Float64 stop)
{
    const Status status = unit_setup(unit, start);
    return (fmi3Status)(status == OK ? unit_enter_initialisation(unit) : status);
}

fmi3Status fmi3DoStep(
    fmi3Instance unit, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_earlier_state, fmi3Boolean *event,
    fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    const Status status = unit_step(unit, time, step);
    *event = *terminate = *early = fmi3False;
    *last = ((const Unit *)unit)->reached;
    return (fmi3Status)status;
}

NUMBERS(Float64, REAL)
NUMBERS(Int32, INTEGER)
NUMBERS(Boolean, BOOLEAN)

/* Model Exchange */

PASS(GetContinuousStateDerivatives, (Instance unit, double x[], size_t count), exchange_get_rates, unit, x, count)

fmi3Status fmi3UpdateDiscreteStates(
    fmi3Instance unit, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals_changed,
    fmi3Boolean *states_changed, fmi3Boolean *next_defined, fmi3Float64 *next_time)
{
    *next_time = INFINITY;
    const Status status = exchange_update(unit, next_time);
    *again = *terminate = *nominals_changed = *states_changed = fmi3False;
    *next_defined = *next_time < INFINITY;
    return (fmi3Status)status;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance unit, size_t *count)
{
    *count = EXCHANGE ? EXCHANGE->states : 0;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance unit, size_t *count)
{
    *count = 0;
    return fmi3OK;
}

/* What the model description says that the unit does not offer */

#define NO_TYPE(Type) \
    ABSENT(Get##Type, const Reference vr[], size_t n, fmi3##Type x[], size_t size) \
    ABSENT(Set##Type, const Reference vr[], size_t n, const fmi3##Type x[], size_t size)
NO_TYPE(Float32) NO_TYPE(Int8) NO_TYPE(UInt8) NO_TYPE(Int16) NO_TYPE(UInt16)
NO_TYPE(UInt32) NO_TYPE(Int64) NO_TYPE(UInt64)
ABSENT(GetBinary, const Reference vr[], size_t n, size_t sizes[], fmi3Binary x[], size_t size)
ABSENT(SetBinary, const Reference vr[], size_t n, const size_t sizes[], const fmi3Binary x[], size_t size)
ABSENT(GetClock, const Reference vr[], size_t n, fmi3Clock x[])
ABSENT(SetClock, const Reference vr[], size_t n, const fmi3Clock x[])
ABSENT(GetNumberOfVariableDependencies, Reference vr, size_t *count)
ABSENT(GetVariableDependencies, Reference dependent, size_t of_dependent[], Reference independents[],
       size_t of_independents[], fmi3DependencyKind kinds[], size_t count)
#define NO_DERIVATIVE(call) \
    ABSENT(call, const Reference unknowns[], size_t unknown_count, const Reference knowns[], size_t known_count, \
           const fmi3Float64 seed[], size_t seeds, fmi3Float64 sensitivity[], size_t sensitivities)
NO_DERIVATIVE(GetDirectionalDerivative)
NO_DERIVATIVE(GetAdjointDerivative)
ABSENT_WITH(EnterConfigurationMode, (Instance unit))
ABSENT_WITH(ExitConfigurationMode, (Instance unit))
ABSENT(GetIntervalDecimal, const Reference vr[], size_t n, fmi3Float64 x[], fmi3IntervalQualifier qualifiers[])
ABSENT(GetIntervalFraction, const Reference vr[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
       fmi3IntervalQualifier qualifiers[])
ABSENT(GetShiftDecimal, const Reference vr[], size_t n, fmi3Float64 x[])
ABSENT(GetShiftFraction, const Reference vr[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
ABSENT(SetIntervalDecimal, const Reference vr[], size_t n, const fmi3Float64 x[])
ABSENT(SetIntervalFraction, const Reference vr[], size_t n, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT(SetShiftDecimal, const Reference vr[], size_t n, const fmi3Float64 x[])
ABSENT(SetShiftFraction, const Reference vr[], size_t n, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT_WITH(EvaluateDiscreteStates, (Instance unit))
ABSENT_WITH(EnterStepMode, (Instance unit))
ABSENT(GetOutputDerivatives, const Reference vr[], size_t n, const fmi3Int32 orders[], fmi3Float64 x[], size_t size)
ABSENT(ActivateModelPartition, Reference clock, fmi3Float64 time)
