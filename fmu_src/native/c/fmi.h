/* The functions that FMI 2.0 and 3.0 have in common, on top of unit.h.
 *
 * The file that includes it defines FMI(name), which is fmi2name or fmi3name, and Instance, a pointer to the unit.
 */
#include <stdlib.h>
#include <string.h>

typedef FMI(Status) Answer;

/* Category of the log, by the status of the message. */
static const char *const CATEGORIES[] = {
    "logAll", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusError"};

static void report(Unit *unit, Status status, const char *message);

/* Return the importer's new unit, or NULL, and log the reason. */
static Instance instantiate(
    const char *name, const char *token, bool exchange, void (*log)(void), void *environment, bool logging)
{
    Unit *unit = unit_new(name);
    if (!unit)
        return NULL;
    unit->report = report;
    unit->log = log;
    unit->environment = environment;
    unit->logging = true;
    unit->exchange = exchange;
    if (exchange && !EXCHANGE)
        unit_log(unit, ERROR, "instantiate: the unit is for co-simulation only");
    else if (!token || strcmp(token, UNIT_TOKEN) != 0)
        unit_log(unit, ERROR, "instantiate: the GUID (token) is that of another model description");
    else {
        unit->logging = logging;
        return unit;
    }
    unit_free(unit);
    return NULL;
}

const char *FMI(GetVersion)(void)
{
    return FMI(Version);
}

Answer FMI(SetDebugLogging)(Instance unit, FMI(Boolean) on, size_t count, const FMI(String) categories[])
{
    ((Unit *)unit)->logging = on;
    return (Answer)OK;
}

void FMI(FreeInstance)(Instance unit)
{
    unit_free(unit);
}

/* Functions that only forward their arguments. */
#define PASS(call, parameters, function, ...) \
    Answer FMI(call) parameters { return (Answer)function(__VA_ARGS__); }
PASS(ExitInitializationMode, (Instance unit), unit_exit_initialisation, unit)
PASS(Terminate, (Instance unit), unit_terminate, unit)
PASS(Reset, (Instance unit), unit_reset, unit)
PASS(GetFMUstate, (Instance unit, FMI(FMUstate) *state), state_get, unit, state)
PASS(SetFMUstate, (Instance unit, FMI(FMUstate) state), state_set, unit, state)
PASS(SerializeFMUstate, (Instance unit, FMI(FMUstate) state, FMI(Byte) bytes[], size_t size),
     state_serialise, unit, state, bytes, size)
PASS(DeSerializeFMUstate, (Instance unit, const FMI(Byte) bytes[], size_t size, FMI(FMUstate) *state),
     state_deserialise, unit, bytes, size, state)
PASS(SetTime, (Instance unit, double time), exchange_set_time, unit, time)
PASS(SetContinuousStates, (Instance unit, const double x[], size_t count), exchange_set_states, unit, x, count)
PASS(GetContinuousStates, (Instance unit, double x[], size_t count), exchange_get_states, unit, x, count)
PASS(GetNominalsOfContinuousStates, (Instance unit, double x[], size_t count), exchange_get_nominals, unit, x, count)

Answer FMI(FreeFMUstate)(Instance unit, FMI(FMUstate) *state)
{
    free(*state);
    *state = NULL;
    return (Answer)OK;
}

Answer FMI(SerializedFMUstateSize)(Instance unit, FMI(FMUstate) state, size_t *size)
{
    *size = ((const State *)state)->size;
    return (Answer)OK;
}

/* There are no state events, and the unit finds events in time itself. */
#define ACCEPT(call) \
    Answer FMI(call)(Instance unit) { return (Answer)OK; }
ACCEPT(EnterEventMode)
ACCEPT(EnterContinuousTimeMode)

Answer FMI(CompletedIntegratorStep)(
    Instance unit, FMI(Boolean) no_earlier_state, FMI(Boolean) *event, FMI(Boolean) *terminate)
{
    *event = *terminate = false;
    return (Answer)OK;
}

Answer FMI(GetEventIndicators)(Instance unit, double indicators[], size_t count)
{
    return (Answer)(count == 0 ? OK : unit_log(unit, ERROR, "getEventIndicators: the unit has none"));
}

/* All values are set or read, and the worst status is returned. The including file defines SIZE, a further parameter,
 * FITS, whether it is right, and READ, which reads one number.
 */
#define VALUES(call, values_type, statement) \
    Answer FMI(call)(Instance unit, const FMI(ValueReference) vr[], size_t count, values_type values[] SIZE) \
    { \
        Status worst = OK, status = OK; \
        if (!FITS) \
            return (Answer)ERROR; \
        for (size_t i = 0; i < count; i++) { \
            statement; \
            worst = status > worst ? status : worst; \
        } \
        return (Answer)worst; \
    }
#define NUMBERS(Type, KIND) \
    VALUES(Get##Type, FMI(Type), double x = 0.0; status = READ(unit, KIND, vr[i], &x); values[i] = (FMI(Type))x) \
    VALUES(Set##Type, const FMI(Type), \
           status = unit_set(unit, KIND, vr[i], KIND == BOOLEAN ? values[i] != 0 : (double)values[i]))
VALUES(GetString, FMI(String), status = unit_get_text(unit, vr[i], &values[i]))
VALUES(SetString, const FMI(String), status = unit_set_text(unit, vr[i], values[i]))

/* A function that the unit does not offer; importers ask that every function is exported. */
#define ABSENT(call, ...) ABSENT_WITH(call, (Instance unit, __VA_ARGS__))
#define ABSENT_WITH(call, parameters) \
    Answer FMI(call) parameters { return (Answer)unit_log(unit, ERROR, "%s: this unit does not offer it", #call); }
