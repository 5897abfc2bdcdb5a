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
    set_FeedbackSettings(&model->settings, unit->values);
    model->held.some = false;
    const double limit = model->settings.voltage_limit;
    const Rotors *hover = &model->settings.hover;
    unit_show(unit, REF_v_front, (double[]){motor_saturate(hover->front, limit), motor_saturate(hover->rear, limit)}, 2);
}

static void advance(Model *model, Unit *unit, double time, double step)
{
    Row5 inputs;
    Row7 given;
    unit_read(unit, REF_pitch, &inputs.x0, 5);
    unit_read(unit, REF_reference_pitch, &given.x0, 7);
    const SampledFeedback next = controllers_feedback_voltages(
        &unit->space, model->held, inputs, given, time, time - unit->start_time, step, &model->settings);
    model->held = (Maybe_SampledFeedback){true, next};
    unit_show(unit, REF_v_front, (double[]){next.v_front, next.v_rear}, 2);
}

static void pass(Model *model, Bytes *bytes)
{
    pass_Maybe_SampledFeedback(bytes, &model->held);
}

const ModelFunctions MODEL = {sizeof(Model), initialise, advance, pass};
