/* StateFeedback between FMI and the translated model: which variable goes where. */
#include "unit.h"
#include "model.h"
#include "variables.h"

static const double SAMPLE_EARLY = 1e-6;    /* of a period: EARLY of heli_plant/state_feedback.py */

struct Model {
    FeedbackSettings settings;
    Row3 rises;
    double step_time;
    Maybe_Held held;
};

static void initialise(Model *model, Unit *unit)
{
    Value *values = unit->values;
    set_FeedbackSettings(&model->settings, values);
    model->rises = (Row3){
        values[REF_reference_step_pitch].real, values[REF_reference_step_elevation].real,
        values[REF_reference_step_travel].real};
    model->step_time = values[REF_reference_step_time].real - EARLY;
    model->held.some = false;
    const double limit = model->settings.voltage_limit;
    values[REF_v_front].real = motor_saturate(model->settings.hover.front, limit);
    values[REF_v_rear].real = motor_saturate(model->settings.hover.rear, limit);
}

static void advance(Model *model, Unit *unit, double time, double step)
{
    Value *values = unit->values;
    const double period = model->settings.period, since = time - unit->start_time;
    if (step > (1.0 + SAMPLE_EARLY) * period)
        refuse(
            &unit->space, "a step of %.6g s leaves out samples of sample.time = %.6g s; take steps no longer", step,
            period);
    const Angles angles = {values[REF_pitch].real, values[REF_elevation].real, values[REF_travel].real};
    const Row3 given = {
        values[REF_reference_pitch].real, values[REF_reference_elevation].real, values[REF_reference_travel].real};
    const Rotors added = {values[REF_excitation_front].real, values[REF_excitation_rear].real};
    const Row3 references = control_step_references(given, model->rises, since, model->step_time);
    const Held held = model->held.some
        ? model->held.value
        : state_feedback_start_holding(angles.pitch, angles.elevation, angles.travel, &model->settings);
    const Held next = state_feedback_sample_and_hold(&held, since, step, &angles, references, &added, &model->settings);
    if (!isfinite(next.state.now.front + next.state.now.rear))
        refuse(
            &unit->space,
            "the voltages are no longer finite in the step from t = %g s; check the transition and innovation matrices",
            time);
    model->held = (Maybe_Held){true, next};
    values[REF_v_front].real = next.v_front;
    values[REF_v_rear].real = next.v_rear;
}

static void pass(Model *model, Bytes *bytes)
{
    pass_Maybe_Held(bytes, &model->held);
}

const ModelFunctions MODEL = {sizeof(Model), initialise, advance, pass};
