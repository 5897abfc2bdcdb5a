/* The life of a unit, without FMI: its values, its phases, its state to save and to restore.
 *
 * A unit is instantiated, initialising, stepping, terminated. Parameters may be set up to the end of the
 * initialisation; outputs are right from the start time on, also while the unit is initialising. A value that is not
 * finite or out of range is refused where it is set, and steps are refused until the variable has a good one.
 * fmi2_unit.c and fmi3_unit.c put the functions of the standard on top, a model (plant.c, ...) lies below.
 */
#ifndef UNIT_H
#define UNIT_H

#include "space.h"

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } Status;
typedef enum { REAL, INTEGER, BOOLEAN, STRING } Kind;
typedef enum { INPUT, OUTPUT, PARAMETER, LOCAL } Causality;
typedef enum { INSTANTIATED, INITIALISING, STEPPING, TERMINATED } Phase;

typedef struct {
    const char *name;
    Kind kind;
    Causality causality;
    bool tunable;
    const char *physical_unit; /* empty: none */
    double minimum, maximum;   /* of a Real or Integer */
    double nominal, start;
    const char *text; /* start of a String */
} Variable;

/* Generated from the unit's definition: variables.c. A value reference is a place in VARIABLES. */
extern const Variable VARIABLES[];
extern const size_t VARIABLE_COUNT;
extern const char UNIT_NAME[], UNIT_TOKEN[];

/* The limits of the unit in Python: fmu_src/slave_base.py. */
extern const bool HAS_PAST;          /* whether outputs depend on earlier steps; if not, a step may begin at any time */
extern const double LONGEST_STEP;    /* of a communication step [s]; this also keeps infinity out */
extern const int64_t MOST_SUBSTEPS;  /* inside of one communication step */
extern const double CLOCK_TOLERANCE; /* of the begin of a step, as a share of the step */

typedef struct {
    double real; /* of a Real, Integer or Boolean */
    char *text;  /* of a String */
} Value;

typedef struct Unit Unit;
typedef struct Model Model;
typedef void (*Reporter)(Unit *unit, Status status, const char *message);

/* What a model that has Model Exchange gives; NULL in other units (exchange.h). */
typedef struct Exchange Exchange;
extern const Exchange *const EXCHANGE;

struct Unit {
    Phase phase;
    double start_time, reached; /* start of the run, end of the last step [s] */
    Value *values;
    bool *refused;      /* variables whose last value was bad */
    double *refused_as; /* that value */
    size_t refused_count;
    bool outdated;   /* the outputs do not follow from the values yet */
    bool exchange;   /* instantiated for model exchange */
    bool stale;      /* variables of model exchange do not follow from state and time yet */
    double passed, next_event; /* events in time, since the start [s] */
    char failure[MESSAGE_SIZE]; /* why the initialisation failed; the unit can then only be reset */
    bool initialised; /* the model has been initialised with the values as they are */
    Space *space;    /* of the model's memory between steps */
    Space *spare;    /* where that is moved when it is tidied up */
    Space *settled;  /* of what the model computes once, from its parameters */
    size_t live;     /* bytes of the memory when it was last tidied up */
    Model *model;
    Reporter report;
    void *host; /* of the layer above */
    char *name;
};

/* What a model gives. The first three may refuse; then the model is as it was. */
extern const size_t MODEL_SIZE;
void model_initialise(Model *model, Unit *unit);
void model_advance(Model *model, Unit *unit, double time, double step);
void model_read(Model *model, Bytes *bytes);
void model_write(const Model *model, Bytes *bytes);
void model_keep(Model *model, Space *space); /* copy all lists between steps to another space */

Unit *unit_new(const char *name, Reporter report, void *host);
void unit_free(Unit *unit);
Status unit_reset(Unit *unit);

Status unit_setup(Unit *unit, double start_time);
Status unit_enter_initialisation(Unit *unit);
Status unit_exit_initialisation(Unit *unit);
Status unit_step(Unit *unit, double time, double step);
Status unit_terminate(Unit *unit);

/* Values by reference. A Boolean is 0 or 1. */
Status unit_set(Unit *unit, Kind kind, uint32_t reference, double value);
Status unit_set_text(Unit *unit, uint32_t reference, const char *text);
Status unit_get(Unit *unit, Kind kind, uint32_t reference, double *value);
Status unit_get_text(Unit *unit, uint32_t reference, const char **text);

/* The whole state as bytes; unit_restore refuses those of another unit and then changes nothing. */
size_t unit_state_size(Unit *unit);
Status unit_save(Unit *unit, unsigned char *at, size_t size);
Status unit_restore(Unit *unit, const unsigned char *at, size_t size);

/* Compute state and outputs at the start time from the values that are set. */
Status unit_prepare(Unit *unit, const char *call);

/* Begin model exchange, where the unit does: may refuse. In exchange.c, or nothing in units without it. */
void exchange_begin(Unit *unit);
/* Compute the variables that follow from state and time. */
void exchange_refresh(Unit *unit);

/* Whether a variable may be set once the initialisation has ended: not a parameter of states that an importer integrates. */
bool exchange_lets_change(const Unit *unit, uint32_t reference);

char *unit_copied(const char *text); /* on the heap, or NULL */
Status unit_say(Unit *unit, Status status, const char *format, ...);

#endif
