/* StateFeedback: connects its variables with the translated model. */
#include "unit.h"
#include "model.h"
#include "variables.h"

struct Model {
    FeedbackSettings settings;
    Maybe_SampledFeedback held;
};

static void initialise(Model *model, Unit *unit)
{
    Value *values = unit->values;
    set_FeedbackSettings(&model->settings, values);
    model->held.some = false;
    const double limit = model->settings.voltage_limit;
    values[REF_v_front].real = motor_saturate(model->settings.hover.front, limit);
    values[REF_v_rear].real = motor_saturate(model->settings.hover.rear, limit);
}

static void advance(Model *model, Unit *unit, double time, double step)
{
    Value *values = unit->values;
    const double since = time - unit->start_time, early = slave_base_time_tolerance(time, since, step);
    const Angles angles = {values[REF_pitch].real, values[REF_elevation].real, values[REF_travel].real};
    const Row3 given = {
        values[REF_reference_pitch].real, values[REF_reference_elevation].real, values[REF_reference_travel].real};
    const Rotors added = {values[REF_excitation_front].real, values[REF_excitation_rear].real};
    const Row3 rises = {
        values[REF_reference_step_pitch].real, values[REF_reference_step_elevation].real,
        values[REF_reference_step_travel].real};
    const Row3 references = control_step_references(
        given, rises, since, values[REF_reference_step_time].real - early);
    const SampledFeedback held = model->held.some
        ? model->held.value
        : state_feedback_start_sampled_feedback(angles.pitch, angles.elevation, angles.travel, &model->settings);
    const SampledFeedback next = state_feedback_sample_and_hold(
        &unit->space, &held, since, step, early, &angles, references, &added, &model->settings);
    model->held = (Maybe_SampledFeedback){true, next};
    values[REF_v_front].real = next.v_front;
    values[REF_v_rear].real = next.v_rear;
}

static void pass(Model *model, Bytes *bytes)
{
    pass_Maybe_SampledFeedback(bytes, &model->held);
}

const ModelFunctions MODEL = {sizeof(Model), initialise, advance, pass};
