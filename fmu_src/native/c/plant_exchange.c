/* HelicopterPlant for Model Exchange: the translated differential equation and its states. */
#include "plant.h"
#include "variables.h"

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

static double next_event(const Model *model, double time)
{
    return laws_next_step_time(time, &model->parameters);
}

static const Exchange PLANT = {10, REF_state_pitch, begin, state, rates, plant_publish, next_event};
const Exchange *const EXCHANGE = &PLANT;
