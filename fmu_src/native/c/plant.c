/* HelicopterPlant: connects its variables with the translated model. */
#include "plant.h"
#include "variables.h"

void plant_publish(const Model *model, Unit *unit)
{
    const Row6 shown = communication_read_sensors(&model->memory.state, &model->counts);
    unit_show(unit, REF_pitch, &shown.x0, sizeof shown / sizeof shown.x0);
}

static void take_parameters(Model *model, Unit *unit)
{
    PlantParameters *p = &model->parameters;
    set_PlantParameters(p, unit->values);
    if (laws_motor_time_constant(p) < 0.0)
        refuse(
            &unit->space, "motor.time_constant + effects.motor_lag.rotors = %g s must not be negative",
            laws_motor_time_constant(p));
    model->delay = laws_input_delay(p);
}

static void initialise(Model *model, Unit *unit)
{
    const Value *values = unit->values;
    const bool enabled = values[REF_encoder_enabled].real != 0.0;
    take_parameters(model, unit);
    model->longest_step = values[REF_solver_step].real;
    if (enabled)
        model->counts = (EncoderCounts){
            values[REF_encoder_counts_pitch].real, values[REF_encoder_counts_elevation].real,
            values[REF_encoder_counts_travel].real};
    const Row3 rates = {
        values[REF_initial_pitch_rate].real, values[REF_initial_elevation_rate].real,
        values[REF_initial_travel_rate].real};
    const PlantState first = state_start_state(
        values[REF_initial_pitch].real, values[REF_initial_elevation].real, values[REF_initial_travel].real,
        values[REF_initial_v_front].real, values[REF_initial_v_rear].real, rates);
    model->memory = communication_start_memory(&first, &model->parameters);
    plant_publish(model, unit);
}

static void advance(Model *model, Unit *unit, double time, double step)
{
    const Value *values = unit->values;
    take_parameters(model, unit);
    slave_base_check_substeps(&unit->space, step, model->longest_step, "solver.step", time);
    const PlantMemory next = communication_communicate(
        &unit->space, &model->memory, values[REF_v_front].real, values[REF_v_rear].real,
        values[REF_mass_position].real, time, unit->start_time, step, model->longest_step, model->delay,
        &model->parameters);
    if (!communication_is_finite(&next.state))
        refuse(&unit->space, "the plant leaves the finite range in the step from t = %g s", time);
    model->memory = next;
    plant_publish(model, unit);
}

static void pass(Model *model, Bytes *bytes)
{
    pass_PlantMemory(bytes, &model->memory);
}

const ModelFunctions MODEL = {sizeof(Model), initialise, advance, pass};
