/* PidController: connects its variables with the translated model. */
#include "unit.h"
#include "model.h"
#include "variables.h"

struct Model {
    PidSettings settings;
    Maybe_PidState state;
};

static void initialise(Model *model, Unit *unit)
{
    set_PidSettings(&model->settings, unit->values);
    model->state.some = false;
    const double voltage = motor_saturate(0.5 * model->settings.trim, model->settings.voltage_limit);
    unit_show(unit, REF_v_front, (double[]){voltage, voltage}, 2);
}

static void advance(Model *model, Unit *unit, double time, double step)
{
    Row5 inputs;
    Row7 given;
    unit_read(unit, REF_pitch, &inputs.x0, 5);
    unit_read(unit, REF_reference_pitch, &given.x0, 7);
    const Row_PidState_Row2 next = controllers_pid_voltages(
        model->state, inputs, given, time, time - unit->start_time, step, &model->settings);
    model->state = (Maybe_PidState){true, next.x0};
    unit_show(unit, REF_v_front, &next.x1.x0, 2);
}

static void pass(Model *model, Bytes *bytes)
{
    pass_Maybe_PidState(bytes, &model->state);
}

const ModelFunctions MODEL = {sizeof(Model), initialise, advance, pass};
