/* Exciter: connects its variables with the translated signals, which are functions of the time since the start. */
#include "unit.h"
#include "model.h"
#include "variables.h"

enum { NONE, EXPERIMENT_1, EXPERIMENT_2, MULTISINE };

static const char *const CHANNELS[] = {"both", "difference", "total"};

/* A signal on the difference or on the sum of the voltages: the paper's, a multisine, or none. */
typedef struct {
    Maybe_SquareChirp square;
    List_Row2 tones;
    double rms;
} Signal;

struct Model {
    double base, limit;
    Signal difference, total;
};

static double at(const Signal *signal, double time)
{
    if (signal->square.some)
        return excitation_SquareChirp_at(&signal->square.value, time);
    return signal->tones.count > 0 ? excitation_multisine_value(signal->rms, signal->tones, time) : 0.0;
}

static void show(const Model *model, Unit *unit, double time)
{
    const Row2 voltages = excitation_combine(
        model->base, at(&model->difference, time), at(&model->total, time), model->limit);
    unit->values[REF_v_front].real = voltages.x0;
    unit->values[REF_v_rear].real = voltages.x1;
}

static Signal multisine(Unit *unit, double rms, int64_t seed)
{
    const Value *values = unit->values;
    const double lowest = values[REF_multisine_lowest].real, highest = values[REF_multisine_highest].real;
    const double period = values[REF_multisine_period].real;
    const int64_t tones = (int64_t)values[REF_multisine_tones].real;
    return (Signal){
        .tones = excitation_multisine_components(&unit->permanent, lowest, highest, tones, period, seed),
        .rms = rms};
}

static void initialise(Model *model, Unit *unit)
{
    const Value *values = unit->values;
    const int experiment = (int)values[REF_excitation_experiment].real;
    const char *channel = CHANNELS[(int)values[REF_excitation_channel].real];
    model->base = values[REF_excitation_base].real;
    model->limit = values[REF_excitation_limit].real;
    model->difference = model->total = (Signal){0};
    if (experiment == EXPERIMENT_1 || experiment == EXPERIMENT_2) {
        const Row_Maybe_SquareChirp_Maybe_SquareChirp paper = excitation_paper_channels(experiment, channel);
        model->difference.square = paper.x0;
        model->total.square = paper.x1;
    } else if (experiment == MULTISINE) {
        const int64_t seed = (int64_t)values[REF_multisine_seed].real;
        const Signal difference = multisine(unit, values[REF_multisine_rms_difference].real, seed);
        const Signal total = multisine(unit, values[REF_multisine_rms_sum].real, seed + 1);
        if (strcmp(channel, "total") != 0)
            model->difference = difference;
        if (strcmp(channel, "difference") != 0)
            model->total = total;
    }
    excitation_check_bounds(&unit->permanent, model->base, model->limit);
    show(model, unit, 0.0);
}

static void advance(Model *model, Unit *unit, double time, double step)
{
    show(model, unit, time + step - unit->start_time);
}

const ModelFunctions MODEL = {sizeof(Model), initialise, advance, NULL}; /* outputs follow from the time */
