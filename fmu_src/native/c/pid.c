/* PidController: connects its variables with the translated model. */
#include "unit.h"
#include "model.h"
#include "variables.h"

struct Model {
    PidSettings settings;
    Maybe_PidState state;
};

static void show(const Model *model, Unit *unit, double v_front, double v_rear)
{
    unit->values[REF_v_front].real = motor_saturate(v_front, model->settings.voltage_limit);
    unit->values[REF_v_rear].real = motor_saturate(v_rear, model->settings.voltage_limit);
}

static void initialise(Model *model, Unit *unit)
{
    set_PidSettings(&model->settings, unit->values);
    model->state.some = false;
    show(model, unit, 0.5 * model->settings.trim, 0.5 * model->settings.trim);
}

static void advance(Model *model, Unit *unit, double time, double step)
{
    const Value *values = unit->values;
    const double pitch = values[REF_pitch].real, elevation = values[REF_elevation].real;
    const double travel = values[REF_travel].real;
    const Row3 given = {
        values[REF_reference_pitch].real, values[REF_reference_elevation].real, values[REF_reference_travel].real};
    const Row3 rises = {
        values[REF_reference_step_pitch].real, values[REF_reference_step_elevation].real,
        values[REF_reference_step_travel].real};
    const double since = time - unit->start_time, early = slave_base_time_tolerance(time, since, step);
    const Row3 references = control_step_references(
        given, rises, since, values[REF_reference_step_time].real - early);
    const PidState state = model->state.some ? model->state.value : control_start_pid(pitch, elevation, travel);
    const Row_PidState_Row2 next = control_pid_step(
        &state, pitch, elevation, travel, references, step, &model->settings);
    model->state = (Maybe_PidState){true, next.x0};
    show(
        model, unit, next.x1.x0 + values[REF_excitation_front].real, next.x1.x1 + values[REF_excitation_rear].real);
}

static void pass(Model *model, Bytes *bytes)
{
    pass_Maybe_PidState(bytes, &model->state);
}

const ModelFunctions MODEL = {sizeof(Model), initialise, advance, pass};
