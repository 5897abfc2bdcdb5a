/* The functions of FMI 2.0 that every unit has, on top of unit.h; those of model exchange are in fmi2_exchange.c. */
#include "fmi2Functions.h"
#include "calls.h"

#include <stdlib.h>
#include <string.h>

#define NOT_HERE(call) (unit_say(c, ERROR, "%s: this unit does not offer it", call), fmi2Error)

typedef struct {
    fmi2CallbackLogger log;
    fmi2ComponentEnvironment environment;
    fmi2Boolean logging;
} Host;

static void report(Unit *unit, Status status, const char *message)
{
    const Host *host = unit->host;
    if (host->logging && host->log)
        host->log(host->environment, unit->name, (fmi2Status)status, CATEGORIES[status], "%s", message);
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[])
{
    (void)count;
    (void)categories;
    ((Host *)((Unit *)c)->host)->logging = on;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(
    fmi2String name, fmi2Type type, fmi2String token, fmi2String resources, const fmi2CallbackFunctions *functions,
    fmi2Boolean visible, fmi2Boolean logging)
{
    (void)resources;
    (void)visible;
    Host *host = calloc(1, sizeof *host);
    if (!host)
        return NULL;
    if (functions) {
        host->log = functions->logger;
        host->environment = functions->componentEnvironment;
    }
    host->logging = logging;
    Unit *unit = unit_new(name, report, host);
    const char *problem = NULL;
    if (!unit)
        problem = "there is no memory left";
    else if (type != fmi2CoSimulation && !EXCHANGE)
        problem = "the unit is for co-simulation only";
    else if (!token || strcmp(token, UNIT_TOKEN) != 0)
        problem = "the GUID is that of another model description";
    if (!problem) {
        unit->exchange = type == fmi2ModelExchange;
        return unit;
    }
    if (host->log)
        host->log(host->environment, name ? name : "", fmi2Error, "logStatusError", "instantiate: %s", problem);
    unit_free(unit);
    free(host);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c)
{
    Unit *unit = c;
    if (!unit)
        return;
    free(unit->host);
    unit_free(unit);
}

fmi2Status fmi2SetupExperiment(
    fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start, fmi2Boolean stop_defined,
    fmi2Real stop)
{
    (void)tolerance_defined;
    (void)tolerance;
    (void)stop_defined;
    (void)stop;
    return (fmi2Status)unit_setup(c, start);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return (fmi2Status)unit_enter_initialisation(c);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    return (fmi2Status)unit_exit_initialisation(c);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    return (fmi2Status)unit_terminate(c);
}

fmi2Status fmi2Reset(fmi2Component c)
{
    return (fmi2Status)unit_reset(c);
}

/* Values */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2Real value[])
{
    Status worst = OK;
    for (size_t i = 0; i < count; i++)
        note(&worst, unit_get(c, REAL, vr[i], &value[i]));
    return (fmi2Status)worst;
}

static fmi2Status get_whole(fmi2Component c, Kind kind, const fmi2ValueReference vr[], size_t count, int value[])
{
    Status worst = OK;
    for (size_t i = 0; i < count; i++) {
        double real = 0.0;
        note(&worst, unit_get(c, kind, vr[i], &real));
        value[i] = (int)real;
    }
    return (fmi2Status)worst;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2Integer value[])
{
    return get_whole(c, INTEGER, vr, count, value);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2Boolean value[])
{
    return get_whole(c, BOOLEAN, vr, count, value);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2String value[])
{
    Status worst = OK;
    for (size_t i = 0; i < count; i++)
        note(&worst, unit_get_text(c, vr[i], &value[i]));
    return (fmi2Status)worst;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2Real value[])
{
    Status worst = OK;
    for (size_t i = 0; i < count; i++)
        note(&worst, unit_set(c, REAL, vr[i], value[i]));
    return (fmi2Status)worst;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2Integer value[])
{
    Status worst = OK;
    for (size_t i = 0; i < count; i++)
        note(&worst, unit_set(c, INTEGER, vr[i], value[i]));
    return (fmi2Status)worst;
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2Boolean value[])
{
    Status worst = OK;
    for (size_t i = 0; i < count; i++)
        note(&worst, unit_set(c, BOOLEAN, vr[i], value[i] != fmi2False));
    return (fmi2Status)worst;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2String value[])
{
    Status worst = OK;
    for (size_t i = 0; i < count; i++)
        note(&worst, unit_set_text(c, vr[i], value[i]));
    return (fmi2Status)worst;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_earlier_state)
{
    (void)no_earlier_state;
    return (fmi2Status)unit_step(c, time, step);
}

/* The state */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return (fmi2Status)state_get(c, "getFMUstate", state);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    return (fmi2Status)state_set(c, "setFMUstate", state);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    state_free(state);
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c;
    *size = state_size(state);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    return (fmi2Status)state_serialise(c, "serializeFMUstate", state, bytes, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    return (fmi2Status)state_deserialise(c, "deSerializeFMUstate", bytes, size, state);
}

/* What the model description says that the unit does not offer */

fmi2Status fmi2SetRealInputDerivatives(
    fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2Integer order[], const fmi2Real value[])
{
    (void)vr;
    (void)count;
    (void)order;
    (void)value;
    return NOT_HERE("setRealInputDerivatives");
}

fmi2Status fmi2GetRealOutputDerivatives(
    fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2Integer order[], fmi2Real value[])
{
    (void)vr;
    (void)count;
    (void)order;
    (void)value;
    return NOT_HERE("getRealOutputDerivatives");
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    return NOT_HERE("cancelStep");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)kind;
    (void)value;
    return NOT_HERE("getStatus");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    (void)kind;
    (void)value;
    return NOT_HERE("getRealStatus");
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)kind;
    (void)value;
    return NOT_HERE("getIntegerStatus");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    (void)kind;
    (void)value;
    return NOT_HERE("getBooleanStatus");
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)kind;
    (void)value;
    return NOT_HERE("getStringStatus");
}
