/* HelicopterPlant between FMI and the translated model: which variable goes where. */
#include "plant.h"
#include "variables.h"

static const double OBSERVER_TRAVEL_BANDWIDTH = 1.26; /* as in heli_plant/observer.py */

void plant_publish(const Model *model, Unit *unit)
{
    const Shown shown = communication_shown(&model->memory.state, &model->counts);
    unit->values[REF_pitch].real = shown.pitch;
    unit->values[REF_elevation].real = shown.elevation;
    unit->values[REF_travel].real = shown.travel;
    unit->values[REF_pitch_rate].real = shown.pitch_rate;
    unit->values[REF_elevation_rate].real = shown.elevation_rate;
    unit->values[REF_travel_rate].real = shown.travel_rate;
}

/* A parameter with its correction, which has to lie in the parameter's range. */
static double corrected(Unit *unit, int reference, double value, double correction)
{
    const Variable *variable = &VARIABLES[reference];
    const double sum = value + correction;
    if (!(variable->minimum <= sum && sum <= variable->maximum))
        refuse(
            &unit->space, "%s = %s %s must lie in [%.6g, %.6g] %s", variable->name, shortest(&unit->space, sum),
            variable->physical_unit, variable->minimum, variable->maximum, variable->physical_unit);
    return sum;
}

/* Read the parameters, which are tunable, and their corrections; return the rotors' shares of thrust with them. */
static Correction take_parameters(Model *model, Unit *unit)
{
    PlantParameters *p = &model->parameters;
    Correction c;
    set_PlantParameters(p, unit->values);
    set_Correction(&c, unit->values);
    const struct {
        int reference;
        double *value;
        double correction;
    } all[] = {CORRECTIONS}; /* in the order of the parameters: of several that are out of range the first one is named */
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        if (all[i].correction != 0.0)
            *all[i].value = corrected(unit, all[i].reference, *all[i].value, all[i].correction);
    }
    if (laws_motor_time_constant(p) < 0.0)
        refuse(
            &unit->space, "motor.time_constant + effects.motor_lag.rotors = %g s must not be negative",
            laws_motor_time_constant(p));
    model->delay = laws_input_delay(p);
    return c;
}

static void initialise(Model *model, Unit *unit)
{
    const Value *values = unit->values;
    const bool enabled = values[REF_encoder_enabled].real != 0.0;
    take_parameters(model, unit);
    model->torque = (Torque){0.0, 0.0, 0.0};
    model->longest_step = values[REF_solver_step].real;
    if (enabled)
        set_EncoderCounts(&model->counts, values);
    const Row3 rates = {
        values[REF_initial_pitch_rate].real, values[REF_initial_elevation_rate].real,
        values[REF_initial_travel_rate].real};
    const PlantState first = state_start_state(
        values[REF_initial_pitch].real, values[REF_initial_elevation].real, values[REF_initial_travel].real,
        values[REF_initial_v_front].real, values[REF_initial_v_rear].real, rates);
    model->memory = communication_begin(&first, &model->parameters);
    plant_publish(model, unit);
}

static void advance(Model *model, Unit *unit, double time, double step)
{
    const Value *values = unit->values;
    const Correction correction = take_parameters(model, unit);
    if (step > (double)MOST_SUBSTEPS * model->longest_step)
        refuse(
            &unit->space,
            "the step of %g s from t = %g s needs %.3g steps of solver.step = %g s; at most %lld are taken, take a "
            "shorter step",
            step, time, step / model->longest_step, model->longest_step, (long long)MOST_SUBSTEPS);
    const double limit = model->parameters.v_max, bandwidth = values[REF_observer_bandwidth].real;
    const double front = observer_with_share(values[REF_v_front].real, 1.0 + correction.front, limit);
    const double rear = observer_with_share(values[REF_v_rear].real, 1.0 + correction.rear, limit);
    PlantMemory before = model->memory;
    Torque torque = model->torque;
    ObserverGains gains;
    if (bandwidth > 0.0) {
        gains = observer_observer_gains(bandwidth, step);
        if (values[REF_measured_fresh].real > 0.5) {
            const ObserverGains on_travel = observer_observer_gains(OBSERVER_TRAVEL_BANDWIDTH * bandwidth, step);
            const Kept kept = observer_measured_against(
                &before.state, &torque, values[REF_measured_pitch].real, values[REF_measured_elevation].real,
                values[REF_measured_travel].real, &gains, &gains, &on_travel);
            before.state = kept.state;
            torque = kept.torque;
        }
    }
    PlantMemory next = communication_communicate(
        &unit->space, &before, front, rear, values[REF_mass_position].real, time, unit->start_time, step,
        model->longest_step, model->delay, &model->parameters);
    if (bandwidth > 0.0) {
        const Kept kept = observer_predicted(&next.state, &torque, step, &gains);
        next.state = kept.state;
        torque = kept.torque;
    }
    if (!communication_is_finite(&next.state))
        refuse(&unit->space, "the plant leaves the finite range in the step from t = %g s", time);
    model->memory = next;
    model->torque = torque;
    plant_publish(model, unit);
}

static void write(const Model *model, Bytes *bytes)
{
    write_PlantMemory(bytes, &model->memory);
    write_Torque(bytes, &model->torque);
}

static void read(Model *model, Bytes *bytes)
{
    read_PlantMemory(bytes, &model->memory);
    read_Torque(bytes, &model->torque);
}

const ModelFunctions MODEL = {sizeof(Model), initialise, advance, write, read};
