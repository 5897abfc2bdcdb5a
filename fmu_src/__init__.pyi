from .builder import UNITS, build, build_all, check_start_values, number_or_text, parameters_of, unit_class
from .errors import BuildError, FmuError, MasterError, Refusal, WiringError
from .units.signals import AXES
from .variables import TYPES, Value, Variable, field_of, problem_with, with_fields
from .wiring import CLOSED_LOOP, OPEN_LOOP, SCENARIOS, VOLTAGES, Scenario, scenario

__all__ = [
    "AXES",
    "CLOSED_LOOP",
    "OPEN_LOOP",
    "SCENARIOS",
    "TYPES",
    "UNITS",
    "VOLTAGES",
    "BuildError",
    "FmuError",
    "MasterError",
    "Refusal",
    "Scenario",
    "Value",
    "Variable",
    "WiringError",
    "build",
    "build_all",
    "check_start_values",
    "field_of",
    "number_or_text",
    "parameters_of",
    "problem_with",
    "scenario",
    "unit_class",
    "with_fields",
]
