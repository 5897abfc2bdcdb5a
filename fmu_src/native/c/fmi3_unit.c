/* The functions of FMI 3.0 that every unit has, on top of unit.h; those of model exchange are in fmi3_exchange.c. */
#include "fmi3Functions.h"
#include "calls.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
    fmi3Boolean logging;
} Host;

static void report(Unit *unit, Status status, const char *message)
{
    const Host *host = unit->host;
    if (host->logging && host->log)
        host->log(host->environment, (fmi3Status)status, CATEGORIES[status], message);
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t count, const fmi3String categories[])
{
    (void)count;
    (void)categories;
    ((Host *)((Unit *)instance)->host)->logging = on;
    return fmi3OK;
}

static fmi3Instance instantiated(
    fmi3String name, fmi3String token, fmi3Boolean logging, bool exchange, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback log)
{
    Host *host = calloc(1, sizeof *host);
    if (!host)
        return NULL;
    host->log = log;
    host->environment = environment;
    host->logging = logging;
    Unit *unit = unit_new(name, report, host);
    const char *problem = NULL;
    if (!unit)
        problem = "instantiate: there is no memory left";
    else if (exchange && !EXCHANGE)
        problem = "instantiate: the unit is for co-simulation only";
    else if (!token || strcmp(token, UNIT_TOKEN) != 0)
        problem = "instantiate: the token is that of another model description";
    if (!problem) {
        unit->exchange = exchange;
        return unit;
    }
    if (log)
        log(environment, fmi3Error, "logStatusError", problem);
    unit_free(unit);
    free(host);
    return NULL;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference required[], size_t required_count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    (void)resources;
    (void)visible;
    (void)event_mode;
    (void)early_return;
    (void)required;
    (void)required_count;
    (void)update;
    return instantiated(name, token, logging, false, environment, log);
}

fmi3Instance fmi3InstantiateModelExchange(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    (void)resources;
    (void)visible;
    return instantiated(name, token, logging, true, environment, log);
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback clock_update,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)clock_update;
    (void)lock;
    (void)unlock;
    if (log)
        log(environment, fmi3Error, "logStatusError", "instantiate: the unit has no scheduled execution");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    Unit *unit = instance;
    if (!unit)
        return;
    free(unit->host);
    unit_free(unit);
}

fmi3Status fmi3EnterInitializationMode(
    fmi3Instance instance, fmi3Boolean tolerance_defined, fmi3Float64 tolerance, fmi3Float64 start,
    fmi3Boolean stop_defined, fmi3Float64 stop)
{
    (void)tolerance_defined;
    (void)tolerance;
    (void)stop_defined;
    (void)stop;
    const Status status = unit_setup(instance, start);
    return (fmi3Status)(status == OK ? unit_enter_initialisation(instance) : status);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    return (fmi3Status)unit_exit_initialisation(instance);
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    return (fmi3Status)unit_terminate(instance);
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    return (fmi3Status)unit_reset(instance);
}

fmi3Status fmi3DoStep(
    fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_earlier_state, fmi3Boolean *event,
    fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    (void)no_earlier_state;
    const Status status = unit_step(instance, time, step);
    *event = *terminate = *early = fmi3False;
    *last = status == OK ? time + step : time;
    return (fmi3Status)status;
}

/* Values; the time stands behind the other variables. */

static bool fits(fmi3Instance instance, size_t references, size_t values, Status *status)
{
    if (references == values)
        return true;
    *status = unit_say(instance, ERROR, "%zu value references are given with %zu values", references, values);
    return false;
}

fmi3Status fmi3GetFloat64(
    fmi3Instance instance, const fmi3ValueReference vr[], size_t count, fmi3Float64 values[], size_t size)
{
    Status worst = OK;
    for (size_t i = 0; fits(instance, count, size, &worst) && i < count; i++) {
        if (vr[i] == VARIABLE_COUNT)
            values[i] = ((Unit *)instance)->reached;
        else
            note(&worst, unit_get(instance, REAL, vr[i], &values[i]));
    }
    return (fmi3Status)worst;
}

fmi3Status fmi3GetInt32(
    fmi3Instance instance, const fmi3ValueReference vr[], size_t count, fmi3Int32 values[], size_t size)
{
    Status worst = OK;
    for (size_t i = 0; fits(instance, count, size, &worst) && i < count; i++) {
        double value = 0.0;
        note(&worst, unit_get(instance, INTEGER, vr[i], &value));
        values[i] = (fmi3Int32)value;
    }
    return (fmi3Status)worst;
}

fmi3Status fmi3GetBoolean(
    fmi3Instance instance, const fmi3ValueReference vr[], size_t count, fmi3Boolean values[], size_t size)
{
    Status worst = OK;
    for (size_t i = 0; fits(instance, count, size, &worst) && i < count; i++) {
        double value = 0.0;
        note(&worst, unit_get(instance, BOOLEAN, vr[i], &value));
        values[i] = value != 0.0;
    }
    return (fmi3Status)worst;
}

fmi3Status fmi3GetString(
    fmi3Instance instance, const fmi3ValueReference vr[], size_t count, fmi3String values[], size_t size)
{
    Status worst = OK;
    for (size_t i = 0; fits(instance, count, size, &worst) && i < count; i++)
        note(&worst, unit_get_text(instance, vr[i], &values[i]));
    return (fmi3Status)worst;
}

fmi3Status fmi3SetFloat64(
    fmi3Instance instance, const fmi3ValueReference vr[], size_t count, const fmi3Float64 values[], size_t size)
{
    Status worst = OK;
    for (size_t i = 0; fits(instance, count, size, &worst) && i < count; i++)
        note(&worst, unit_set(instance, REAL, vr[i], values[i]));
    return (fmi3Status)worst;
}

fmi3Status fmi3SetInt32(
    fmi3Instance instance, const fmi3ValueReference vr[], size_t count, const fmi3Int32 values[], size_t size)
{
    Status worst = OK;
    for (size_t i = 0; fits(instance, count, size, &worst) && i < count; i++)
        note(&worst, unit_set(instance, INTEGER, vr[i], values[i]));
    return (fmi3Status)worst;
}

fmi3Status fmi3SetBoolean(
    fmi3Instance instance, const fmi3ValueReference vr[], size_t count, const fmi3Boolean values[], size_t size)
{
    Status worst = OK;
    for (size_t i = 0; fits(instance, count, size, &worst) && i < count; i++)
        note(&worst, unit_set(instance, BOOLEAN, vr[i], values[i]));
    return (fmi3Status)worst;
}

fmi3Status fmi3SetString(
    fmi3Instance instance, const fmi3ValueReference vr[], size_t count, const fmi3String values[], size_t size)
{
    Status worst = OK;
    for (size_t i = 0; fits(instance, count, size, &worst) && i < count; i++)
        note(&worst, unit_set_text(instance, vr[i], values[i]));
    return (fmi3Status)worst;
}

/* The state */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    return (fmi3Status)state_get(instance, "getFMUState", state);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state)
{
    return (fmi3Status)state_set(instance, "setFMUState", state);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    (void)instance;
    state_free(state);
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    (void)instance;
    *size = state_size(state);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    return (fmi3Status)state_serialise(instance, "serializeFMUState", state, bytes, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    return (fmi3Status)state_deserialise(instance, "deserializeFMUState", bytes, size, state);
}

/* What the model description says that the unit does not offer; importers ask that every function is exported. */

#include "absent.h"

ABSENT(GetFloat32, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, fmi3Float32 values[], size_t size)
ABSENT(SetFloat32, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, const fmi3Float32 values[], size_t size)
ABSENT(GetInt8, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, fmi3Int8 values[], size_t size)
ABSENT(SetInt8, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, const fmi3Int8 values[], size_t size)
ABSENT(GetUInt8, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, fmi3UInt8 values[], size_t size)
ABSENT(SetUInt8, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, const fmi3UInt8 values[], size_t size)
ABSENT(GetInt16, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, fmi3Int16 values[], size_t size)
ABSENT(SetInt16, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, const fmi3Int16 values[], size_t size)
ABSENT(GetUInt16, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, fmi3UInt16 values[], size_t size)
ABSENT(SetUInt16, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, const fmi3UInt16 values[], size_t size)
ABSENT(GetUInt32, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, fmi3UInt32 values[], size_t size)
ABSENT(SetUInt32, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, const fmi3UInt32 values[], size_t size)
ABSENT(GetInt64, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, fmi3Int64 values[], size_t size)
ABSENT(SetInt64, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, const fmi3Int64 values[], size_t size)
ABSENT(GetUInt64, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, fmi3UInt64 values[], size_t size)
ABSENT(SetUInt64, fmi3Instance instance, const fmi3ValueReference vr[], size_t count, const fmi3UInt64 values[], size_t size)
ABSENT(GetBinary, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    size_t valueSizes[], fmi3Binary values[], size_t nValues)
ABSENT(SetBinary, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
ABSENT(GetClock, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Clock values[])
ABSENT(SetClock, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Clock values[])
ABSENT(GetNumberOfVariableDependencies, fmi3Instance instance, fmi3ValueReference valueReference,
    size_t* nDependencies)
ABSENT(GetVariableDependencies, fmi3Instance instance, fmi3ValueReference dependent,
    size_t elementIndicesOfDependent[], fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
    fmi3DependencyKind dependencyKinds[], size_t nDependencies)
ABSENT(GetAdjointDerivative, fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
    fmi3Float64 sensitivity[], size_t nSensitivity)
ABSENT(EnterConfigurationMode, fmi3Instance instance)
ABSENT(ExitConfigurationMode, fmi3Instance instance)
ABSENT(GetIntervalDecimal, fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
ABSENT(GetIntervalFraction, fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
ABSENT(GetShiftDecimal, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Float64 shifts[])
ABSENT(GetShiftFraction, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3UInt64 counters[], fmi3UInt64 resolutions[])
ABSENT(SetIntervalDecimal, fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Float64 intervals[])
ABSENT(SetIntervalFraction, fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT(SetShiftDecimal, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Float64 shifts[])
ABSENT(SetShiftFraction, fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT(EvaluateDiscreteStates, fmi3Instance instance)
ABSENT(EnterStepMode, fmi3Instance instance)
ABSENT(GetOutputDerivatives, fmi3Instance instance, const fmi3ValueReference valueReferences[],
    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
ABSENT(ActivateModelPartition, fmi3Instance instance, fmi3ValueReference clockReference, fmi3Float64 activationTime)
