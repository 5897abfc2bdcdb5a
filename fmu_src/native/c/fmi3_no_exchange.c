/* A unit of FMI 3.0 without Model Exchange. */
#include "absent.h"

ABSENT(EnterEventMode, fmi3Instance instance)
ABSENT(UpdateDiscreteStates, fmi3Instance instance, fmi3Boolean* discreteStatesNeedUpdate,
    fmi3Boolean* terminateSimulation, fmi3Boolean* nominalsOfContinuousStatesChanged,
    fmi3Boolean* valuesOfContinuousStatesChanged, fmi3Boolean* nextEventTimeDefined, fmi3Float64* nextEventTime)
ABSENT(EnterContinuousTimeMode, fmi3Instance instance)
ABSENT(CompletedIntegratorStep, fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
    fmi3Boolean* enterEventMode, fmi3Boolean* terminateSimulation)
ABSENT(SetTime, fmi3Instance instance, fmi3Float64 time)
ABSENT(SetContinuousStates, fmi3Instance instance, const fmi3Float64 continuousStates[], size_t nContinuousStates)
ABSENT(GetContinuousStateDerivatives, fmi3Instance instance, fmi3Float64 derivatives[], size_t nContinuousStates)
ABSENT(GetEventIndicators, fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators)
ABSENT(GetContinuousStates, fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates)
ABSENT(GetNominalsOfContinuousStates, fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates)
ABSENT(GetNumberOfEventIndicators, fmi3Instance instance, size_t* nEventIndicators)
ABSENT(GetNumberOfContinuousStates, fmi3Instance instance, size_t* nContinuousStates)
ABSENT(GetDirectionalDerivative, fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
    fmi3Float64 sensitivity[], size_t nSensitivity)
