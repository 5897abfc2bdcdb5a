/* LogPlayer: shows at each time the row of a log with the latest time up to it. */
#include "unit.h"
#include "log_file.h"
#include "variables.h"

static const double EARLY = 1e-9; /* [s]; communication points k H have rounding errors */

struct Model {
    Log log;
};

static void show(const Model *model, Unit *unit, double time)
{
    const Log *log = &model->log;
    const double since_first = time - unit->start_time + unit->values[REF_log_start].real + EARLY;
    int64_t first = 0, beyond = log->count; /* the first row that is later */
    while (first < beyond) {
        const int64_t middle = (first + beyond) / 2;
        if (since_first < log->times[middle])
            beyond = middle;
        else
            first = middle + 1;
    }
    const int64_t row = first > 0 ? first - 1 : 0;
    for (int k = 0; k < LOG_SIGNALS; k++)
        unit->values[k].real = log->rows[row * LOG_SIGNALS + k]; /* the first of VARIABLES */
}

static void initialise(Model *model, Unit *unit)
{
    model->log = read_log(&unit->settled, unit->values[REF_log_path].text);
    show(model, unit, unit->start_time);
}

static void advance(Model *model, Unit *unit, double time, double step)
{
    show(model, unit, time + step);
}

const ModelFunctions MODEL = {sizeof(Model), initialise, advance, NULL, NULL}; /* outputs follow from the time */
