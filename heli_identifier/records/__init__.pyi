from .configuration import (
    CONFIGURATION_NAME,
    CONTRACT,
    ControllerConfiguration,
    Geometry,
    LogFormat,
    RigConfiguration,
    Weights,
    check_given,
    read_configuration,
)
from .data_set import (
    DEMO_RIGS,
    check_apart,
    check_excitation,
    check_moving,
    common_configuration,
    counted_once,
    demo_logs,
    excitation_notes,
    named_apart,
    read_data_set,
    read_logs,
)
from .guess import Guess, guess
from .log import Log, write_log
from .overlap import shared_flight
from .reading import read_log
from .response import suspicions
from .template import write_template
from .timing import GAP_STEPS, LOWEST_RATE_HZ
from .units import CONTRACT_HEADERS, factor_to_si, understood

__all__ = [
    "CONFIGURATION_NAME",
    "CONTRACT",
    "CONTRACT_HEADERS",
    "ControllerConfiguration",
    "DEMO_RIGS",
    "GAP_STEPS",
    "Geometry",
    "Guess",
    "LOWEST_RATE_HZ",
    "Log",
    "LogFormat",
    "RigConfiguration",
    "Weights",
    "check_apart",
    "check_excitation",
    "check_given",
    "check_moving",
    "common_configuration",
    "counted_once",
    "demo_logs",
    "excitation_notes",
    "factor_to_si",
    "guess",
    "named_apart",
    "read_configuration",
    "read_data_set",
    "read_log",
    "read_logs",
    "shared_flight",
    "suspicions",
    "understood",
    "write_log",
    "write_template",
]
