/* HelicopterPlant for Model Exchange: the translated differential equation, its states and slopes. */
#include "plant.h"
#include "variables.h"

enum { STATES = 10, INPUTS = 3, OUTPUTS = 6 };

static void begin(Model *model, Unit *unit)
{
    if (model->delay > 0.0)
        refuse(
            &unit->space,
            "effects.input_delay.rotors = %g s has no place in model exchange: set it to 0 and delay the voltages "
            "outside, or take co-simulation",
            model->delay);
    if (unit->values[REF_encoder_enabled].real != 0.0)
        refuse(
            &unit->space,
            "encoder.enabled must be false in model exchange: outputs would step all the time; round them outside, or "
            "take co-simulation");
}

static double *state(Model *model)
{
    return &model->memory.state.pitch; /* the first fields of PlantState are the states */
}

static void rates(const Model *model, const Unit *unit, double time, double rates[])
{
    const PlantState *x = &model->memory.state;
    const Value *u = unit->values;
    const Row10 rate = plant_rates_of_change(
        time, x->pitch, x->elevation, x->travel, x->pitch_rate, x->elevation_rate, x->travel_rate, x->nu_front,
        x->nu_rear, x->bending, x->bending_rate, u[REF_v_front].real, u[REF_v_rear].real, u[REF_mass_position].real,
        x->cable_rest, &model->parameters);
    memcpy(rates, &rate, sizeof rate);
}

static void slopes(
    const Model *model, const Unit *unit, double time, const double states[], const double inputs[], double rates[],
    double outputs[])
{
    const double *values = &model->memory.state.pitch;
    Dual x[STATES], u[INPUTS];
    for (int i = 0; i < STATES; i++)
        x[i] = (Dual){values[i], states[i]};
    for (int i = 0; i < INPUTS; i++)
        u[i] = (Dual){unit->values[i].real, inputs[i]};
    const Row_d_d_d_d_d_d_d_d_d_d rate = plant_rates_of_change_dual(
        time, x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], u[0], u[1], u[2],
        model->memory.state.cable_rest, &model->parameters);
    const Row_d_d_d_d_d_d out = plant_measured_motion_dual(x[0], x[1], x[2], x[3], x[4], x[5], x[8], x[9]);
    const Dual *all_rates = &rate.x0, *all_outputs = &out.x0;
    for (int i = 0; i < STATES; i++)
        rates[i] = all_rates[i].slope;
    for (int i = 0; i < OUTPUTS; i++)
        outputs[i] = all_outputs[i].slope;
}

static double next_event(const Model *model, double time)
{
    return laws_next_step_time(time, &model->parameters);
}

static const Exchange PLANT = {STATES, INPUTS, OUTPUTS, REF_state_pitch, REF_pitch, begin, state, rates, plant_publish,
                               slopes, next_event};
const Exchange *const EXCHANGE = &PLANT;
