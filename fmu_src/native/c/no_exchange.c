/* A unit without Model Exchange. */
#include "unit.h"

const Exchange *const EXCHANGE = NULL;

void exchange_begin(Unit *unit)
{
    (void)unit;
}

void exchange_refresh(Unit *unit)
{
    unit->stale = false;
}
