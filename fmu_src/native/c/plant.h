/* Memory of HelicopterPlant. */
#ifndef PLANT_H
#define PLANT_H

#include "model.h"
#include "unit.h"

struct Model {
    PlantParameters parameters;
    double delay, longest_step;
    EncoderCounts counts;
    PlantMemory memory;
};

void plant_publish(const Model *model, Unit *unit);

#endif
