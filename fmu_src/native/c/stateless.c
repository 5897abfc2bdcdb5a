/* A model whose outputs follow from the time and its parameters: there is nothing to keep between steps. */
#include "unit.h"

void model_keep(Model *model, Space *space)
{
    (void)model;
    (void)space;
}

void model_write(const Model *model, Bytes *bytes)
{
    (void)model;
    (void)bytes;
}

void model_read(Model *model, Bytes *bytes)
{
    (void)model;
    (void)bytes;
}
