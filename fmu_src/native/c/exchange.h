/* Model Exchange: the importer integrates the states; the unit gives their rates, outputs, slopes and events.
 *
 * The variables of the states stand at FIRST_STATE, those of their derivatives behind them. Continuous inputs are the
 * first variables of the unit. Events are in time only: no law steps with the state, corners are left to the solver.
 */
#ifndef EXCHANGE_H
#define EXCHANGE_H

#include "unit.h"

struct Exchange {
    size_t states, inputs, outputs;  /* their numbers */
    size_t first_state, first_output; /* their value references */
    void (*begin)(Model *model, Unit *unit); /* may refuse */
    double *(*state)(Model *model);
    void (*rates)(const Model *model, const Unit *unit, double time, double rates[]);
    void (*show)(Model *model, Unit *unit);
    /* Slopes of rates and outputs in the direction of ``states`` and ``inputs``, at ``time`` since the start. */
    void (*slopes)(
        const Model *model, const Unit *unit, double time, const double states[], const double inputs[],
        double rates[], double outputs[]);
    double (*next_event)(const Model *model, double time); /* since the start; infinity if there is none */
};

Status exchange_set_time(Unit *unit, double time);
Status exchange_set_states(Unit *unit, const double states[], size_t count);
Status exchange_get_states(Unit *unit, double states[], size_t count);
Status exchange_get_rates(Unit *unit, double rates[], size_t count);
Status exchange_get_nominals(Unit *unit, double nominals[], size_t count);

/* Pass an event that is due; return the time of the next one, or infinity. */
Status exchange_update(Unit *unit, double *next);

/* Product of the Jacobian with a seed: of derivatives and outputs by states and continuous inputs. */
Status exchange_slopes(
    Unit *unit, const uint32_t unknowns[], size_t unknown_count, const uint32_t knowns[], size_t known_count,
    const double seed[], double sensitivity[]);

#endif
