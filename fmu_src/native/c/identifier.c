/* AdaptiveIdentifier: connects its variables with the translated estimation. */
#include "unit.h"
#include "model.h"
#include "variables.h"

struct Model {
    Plan plan;
    bool warned;
    Maybe_Sampled sampled;
};

static void show(Model *model, Unit *unit, const IdentifierOutput *output)
{
    const bool closed = loop_is_closed(output->feedback);
    const Row49 shown = adaptive_identifier_output_values(output, closed);
    unit_show(unit, REF_a_wx, &shown.x0, sizeof shown / sizeof shown.x0);
    if (closed && !model->warned && !model->plan.predicting) {
        model->warned = true;
        unit_log(
            unit, WARNING,
            "the voltages follow the measured angles: a controller closes the loop. The paper's adaptation is wrong "
            "there by more than its standard errors say; set method to prediction_error");
    }
}

static void initialise(Model *model, Unit *unit)
{
    const Value *values = unit->values;
    const double hold = values[REF_adaptation_hold_time].real;
    IdentifierSettings settings = settings_default_settings(&unit->permanent);
    set_IdentifierSettings(&settings, values);
    settings.method = values[REF_method].text;
    if (!(hold < 0.0))
        settings.hold_time = (Maybe_f){true, hold};
    if (values[REF_pitch_rest_angle_known].real != 0.0)
        settings.rest_angle = (Maybe_f){true, values[REF_pitch_rest_angle].real};
    settings_IdentifierSettings__post_init(&unit->permanent, &settings);
    model->plan = settings_prepare(&unit->permanent, &settings);
    model->sampled.some = model->warned = false;
    const IdentifierOutput first = identifier_before_samples(&unit->permanent, &model->plan);
    show(model, unit, &first);
}

static void advance(Model *model, Unit *unit, double time, double step)
{
    Row5 now;
    Row3 references;
    unit_read(unit, REF_v_front, &now.x0, 5);
    unit_read(unit, REF_pitch_reference, &references.x0, 3);
    if (!model->sampled.some) {
        model->sampled.value = identifier_begin_sampling(&unit->space, time, now, &model->plan, references);
        model->sampled.some = true;
        return;
    }
    const Row_Sampled_Maybe_IdentifierOutput next = adaptive_identifier_take_samples(
        &unit->space, &model->sampled.value, time, step, now, references, &model->plan);
    model->sampled.value = next.x0;
    if (next.x1.some)
        show(model, unit, &next.x1.value);
}

static void pass(Model *model, Bytes *bytes)
{
    pass_bool(bytes, &model->warned);
    pass_Maybe_Sampled(bytes, &model->sampled);
}

const ModelFunctions MODEL = {sizeof(Model), initialise, advance, pass};
