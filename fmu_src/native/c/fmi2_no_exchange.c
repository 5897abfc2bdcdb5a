/* A unit of FMI 2.0 without Model Exchange has no directional derivatives. */
#include "fmi2Functions.h"
#include "unit.h"

fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns, const fmi2ValueReference known[],
    size_t knowns, const fmi2Real seed[], fmi2Real sensitivity[])
{
    (void)unknown;
    (void)unknowns;
    (void)known;
    (void)knowns;
    (void)seed;
    (void)sensitivity;
    return (fmi2Status)unit_say(c, ERROR, "getDirectionalDerivative: this unit does not offer it");
}
