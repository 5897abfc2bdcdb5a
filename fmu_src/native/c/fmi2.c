/* The functions of FMI 2.0. */
#include "fmi2Functions.h"
#include "unit.h"

#include <math.h>

typedef fmi2Component Instance;
#define FMI(name) fmi2##name
#define SIZE
#define FITS true
#define READ unit_get
#include "fmi.h"

static void report(Unit *unit, Status status, const char *message)
{
    const fmi2CallbackLogger log = (fmi2CallbackLogger)unit->log;
    if (unit->logging && log)
        log(unit->environment, unit->name, (fmi2Status)status, CATEGORIES[status], "%s", message);
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

fmi2Component fmi2Instantiate(
    fmi2String name, fmi2Type type, fmi2String token, fmi2String resources, const fmi2CallbackFunctions *functions,
    fmi2Boolean visible, fmi2Boolean logging)
{
    void (*log)(void) = functions ? (void (*)(void))functions->logger : NULL;
    void *environment = functions ? functions->componentEnvironment : NULL;
    return instantiated(name, token, type == fmi2ModelExchange, log, environment, logging);
}

fmi2Status fmi2SetupExperiment(
    fmi2Component unit, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start, fmi2Boolean stop_defined,
    fmi2Real stop)
{
    return (fmi2Status)unit_setup(unit, start);
}

fmi2Status fmi2DoStep(fmi2Component unit, fmi2Real time, fmi2Real step, fmi2Boolean no_earlier_state)
{
    return (fmi2Status)unit_step(unit, time, step);
}

PASS(EnterInitializationMode, (Instance unit), unit_enter_initialisation, unit)
PASS(GetDerivatives, (Instance unit, double rates[], size_t count), exchange_get_rates, unit, rates, count)
PASS(GetDirectionalDerivative, (
         Instance unit, const fmi2ValueReference unknown[], size_t unknowns, const fmi2ValueReference known[],
         size_t knowns, const double seed[], double sensitivity[]),
     exchange_slopes, unit, unknown, unknowns, known, knowns, seed, sensitivity)
NUMBERS(Real, REAL)
NUMBERS(Integer, INTEGER)
NUMBERS(Boolean, BOOLEAN)

fmi2Status fmi2NewDiscreteStates(fmi2Component unit, fmi2EventInfo *info)
{
    double next = INFINITY;
    const Status status = exchange_update(unit, &next);
    *info = (fmi2EventInfo){.nextEventTimeDefined = next < INFINITY, .nextEventTime = next};
    return (fmi2Status)status;
}

ABSENT(SetRealInputDerivatives, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], const fmi2Real x[])
ABSENT(GetRealOutputDerivatives, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], fmi2Real x[])
ABSENT_WITH(CancelStep, (Instance unit))
ABSENT(GetStatus, const fmi2StatusKind kind, fmi2Status *value)
ABSENT(GetRealStatus, const fmi2StatusKind kind, fmi2Real *value)
ABSENT(GetIntegerStatus, const fmi2StatusKind kind, fmi2Integer *value)
ABSENT(GetBooleanStatus, const fmi2StatusKind kind, fmi2Boolean *value)
ABSENT(GetStringStatus, const fmi2StatusKind kind, fmi2String *value)
