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
    return instantiate(name, token, type == fmi2ModelExchange, log, environment, logging);
}

PASS(SetupExperiment, (
         Instance unit, fmi2Boolean has_tolerance, double tolerance, double start, fmi2Boolean has_stop, double stop),
     unit_setup, unit, start)
PASS(DoStep, (Instance unit, double time, double step, fmi2Boolean no_earlier_state), unit_step, unit, time, step)
PASS(EnterInitializationMode, (Instance unit), unit_enter_initialisation, unit)
PASS(GetDerivatives, (Instance unit, double rates[], size_t count), exchange_get_rates, unit, rates, count)
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

ABSENT(GetDirectionalDerivative, const fmi2ValueReference unknown[], size_t unknowns, const fmi2ValueReference known[],
       size_t knowns, const fmi2Real seed[], fmi2Real sensitivity[])
ABSENT(SetRealInputDerivatives, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], const fmi2Real x[])
ABSENT(GetRealOutputDerivatives, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], fmi2Real x[])
ABSENT_WITH(CancelStep, (Instance unit))

/* After a step that was refused: the unit is at the end of the last step, and does not ask to end the run. */
#define STATUS(Type, type, known, answer) \
    fmi2Status fmi2Get##Type(fmi2Component unit, const fmi2StatusKind kind, type *value) \
    { \
        if (!(known)) \
            return fmi2Discard; \
        *value = answer; \
        return fmi2OK; \
    }
STATUS(RealStatus, fmi2Real, kind == fmi2LastSuccessfulTime, ((const Unit *)unit)->reached)
STATUS(BooleanStatus, fmi2Boolean, kind == fmi2Terminated, fmi2False)
STATUS(Status, fmi2Status, false, fmi2OK) /* of steps that take place beside the host's work */
STATUS(IntegerStatus, fmi2Integer, false, 0)
STATUS(StringStatus, fmi2String, false, NULL)

/* A unit in a master's loop: its functions, its references, and the addresses of its values. */
typedef struct {
    fmi2Component unit;
    fmi2DoStepTYPE *step;
    fmi2SetRealTYPE *set;
    const fmi2ValueReference *inputs;
    size_t input_count;
    const double *fed;
    fmi2GetRealTYPE *get;
    const fmi2ValueReference *outputs;
    size_t output_count;
    double *shown;
    const int64_t *worst; /* worst status in the unit's log */
} Linked;

/* A master's loop over native units of one process: ``count`` steps from number ``first`` on. Before a step each input
 * gets the output whose index is in ``sources``; after it all outputs are copied to a row of ``record``. The first
 * status worse than a warning is returned, with step, unit and call in ``refusal``.
 */
FMI2_Export fmi2Status heli_play(
    const Linked units[], size_t unit_count, const intptr_t sources[], size_t fed_count, double fed[],
    const double shown[], size_t shown_count, double record[], int64_t first, int64_t count, double step,
    int64_t refusal[3])
{
    for (int64_t k = first; k < first + count; k++, record += shown_count) {
        for (size_t i = 0; i < fed_count; i++)
            fed[i] = shown[sources[i]];
        for (const Linked *unit = units; unit < units + unit_count; unit++) {
            for (int64_t call = 0; call < 3; call++) {
                const fmi2Status status =
                    call == 0   ? unit->set(unit->unit, unit->inputs, unit->input_count, unit->fed)
                    : call == 1 ? unit->step(unit->unit, (double)k * step, step, fmi2True)
                                : unit->get(unit->unit, unit->outputs, unit->output_count, unit->shown);
                if (status > fmi2Warning || *unit->worst > fmi2Warning) {
                    memcpy(refusal, (int64_t[]){k, unit - units, call}, 3 * sizeof *refusal);
                    return status;
                }
            }
        }
        memcpy(record, shown, shown_count * sizeof *record);
    }
    return fmi2OK;
}
