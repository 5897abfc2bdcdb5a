/* A unit without FMI: its values, its phases, its state to save and to restore.
 *
 * A unit is instantiated, initialising, stepping, terminated. Parameters may be set up to the end of the
 * initialisation; outputs are right from the start time on, also while the unit is initialising. A value that is not
 * finite or out of range is refused when it is set, and steps are refused until the variable has a good one.
 * fmi2.c and fmi3.c add the functions of the standard; each unit has its model (plant.c, ...).
 */
#ifndef UNIT_H
#define UNIT_H

#include "memory.h"

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } Status;
typedef enum { REAL, INTEGER, BOOLEAN, STRING } Kind;
typedef enum { INPUT, OUTPUT, PARAMETER, LOCAL } Causality;
typedef enum { INSTANTIATED, INITIALISING, STEPPING, TERMINATED } Phase;

typedef struct {
    const char *name;
    Kind kind;
    Causality causality;
    bool tunable;
    const char *physical_unit; /* empty: none, or 1 */
    double minimum, maximum;   /* of a Real or Integer */
    double nominal, start;
    const char *text; /* start of a String */
} Variable;

typedef struct {
    double real;       /* of a Real, Integer or Boolean */
    char *text;        /* of a String */
    bool refused;      /* the last value was bad */
    double refused_as; /* that value */
} Value;

typedef struct Unit Unit;
typedef struct Model Model;

/* Functions of a model. The first two may refuse, which changes nothing. The last is NULL if there is no memory. */
typedef struct {
    size_t size; /* of Model */
    void (*initialise)(Model *model, Unit *unit);
    void (*advance)(Model *model, Unit *unit, double time, double step);
    void (*pass)(Model *model, Bytes *bytes); /* writes the memory to bytes, or reads it */
} ModelFunctions;
extern const ModelFunctions MODEL;

/* Functions of a model for Model Exchange, in which the importer integrates its states; NULL in other units.
 *
 * The variables of the states begin at ``first_state``, followed by those of their derivatives. There are only events
 * in time: no law steps with the state, and the solver handles corners.
 */
typedef struct {
    size_t states, first_state; /* their number, the first value reference */
    void (*begin)(Model *model, Unit *unit); /* may refuse */
    double *(*state)(Model *model);
    void (*rates)(const Model *model, const Unit *unit, double time, double rates[]);
    void (*show)(const Model *model, Unit *unit);
    double (*next_event)(const Model *model, double time); /* since the start; infinity if there is none */
} Exchange;
extern const Exchange *const EXCHANGE;

/* Generated from the unit's definition: variables.c. A value reference is a place in VARIABLES. */
extern const Variable VARIABLES[];
extern const size_t VARIABLE_COUNT;
extern const char UNIT_TOKEN[];

extern const bool HAS_PAST; /* whether outputs depend on earlier steps; if not, a step may begin at any time */

struct Unit {
    Phase phase;
    double start_time, reached; /* start of the run, end of the last step [s] */
    Value *values;
    size_t refused_count;
    bool outdated;    /* the outputs have not been computed from the values yet */
    bool initialised; /* the model has been initialised with the present values */
    char failure[MESSAGE_SIZE]; /* why the initialisation failed; the unit can then only be reset */
    Model *model;
    Space space;     /* of the model's memory between steps */
    Space spare;     /* target of that memory when it is compacted */
    Space permanent; /* of values that the model computes once, from its parameters */
    size_t live;     /* bytes of the memory after it was last compacted */
    Refusal refusal;
    bool exchange; /* instantiated for model exchange */
    bool stale;    /* variables of model exchange have not been computed from state and time yet */
    double passed, next_event; /* events in time, since the start [s] */
    void (*report)(Unit *unit, Status status, const char *message);
    void (*log)(void); /* the host's callback, its argument, whether it wants messages */
    void *environment;
    bool logging;
    char *name;
};

/* unit.c: from the first call to the last. */
Unit *unit_new(const char *name);
void unit_free(Unit *unit);
void unit_free_parts(Unit *unit, const Unit *other); /* values and model, and what ``other`` does not share */
Status unit_reset(Unit *unit);
Status unit_setup(Unit *unit, double start_time);
Status unit_enter_initialisation(Unit *unit);
Status unit_exit_initialisation(Unit *unit);
Status unit_step(Unit *unit, double time, double step);
Status unit_terminate(Unit *unit);
Status unit_log(Unit *unit, Status status, const char *format, ...);

/* Compute state and outputs at the start time from the values; the first may refuse, the second logs a refusal. */
void unit_initialise(Unit *unit);
Status unit_prepare(Unit *unit, const char *call);

void unit_swap_spaces(Unit *unit); /* exchange the space and the spare space */

/* values.c: values by reference. A Boolean is 0 or 1. */
Status unit_set(Unit *unit, Kind kind, uint32_t reference, double value);
Status unit_set_text(Unit *unit, uint32_t reference, const char *text);
Status unit_get(Unit *unit, Kind kind, uint32_t reference, double *value);
Status unit_get_text(Unit *unit, uint32_t reference, const char **text);
void unit_show(Unit *unit, size_t first, const double values[], size_t count); /* set consecutive variables */
void unit_read(const Unit *unit, size_t first, double values[], size_t count);  /* read them */
bool unit_set_starts(Unit *unit);
char *copy_text(const char *text); /* on the heap, or NULL */

/* Write why a value is refused. */
const char *out_of_range(size_t reference, double value, char reason[MESSAGE_SIZE]);

/* state.c: the complete state as bytes, which the host keeps. A refused state changes nothing. */
typedef struct {
    size_t size;
    unsigned char bytes[];
} State;
Status state_get(Unit *unit, void **state);
Status state_set(Unit *unit, const State *state);
Status state_serialise(Unit *unit, const State *state, void *bytes, size_t size);
Status state_deserialise(Unit *unit, const void *bytes, size_t size, void **state);

/* exchange.c: Model Exchange. */
void exchange_begin(Unit *unit); /* may refuse */
void exchange_refresh(Unit *unit); /* compute the variables that follow from state and time */
Status exchange_set_time(Unit *unit, double time);
Status exchange_set_states(Unit *unit, const double states[], size_t count);
Status exchange_get_states(Unit *unit, double states[], size_t count);
Status exchange_get_rates(Unit *unit, double rates[], size_t count);
Status exchange_get_nominals(Unit *unit, double nominals[], size_t count);

/* Pass a due event; return the time of the next one, or infinity. */
Status exchange_update(Unit *unit, double *next);

#endif
