__all__ = [
    "Check",
    "Comparison",
    "Diagnosis",
    "DiagnosisSettings",
    "Identification",
    "Log",
    "LogFormat",
    "Look",
    "ParameterSet",
    "RigConfiguration",
    "Simulation",
    "__version__",
    "build",
    "check",
    "compare",
    "demo_logs",
    "diagnose",
    "identify",
    "linearise",
    "look",
    "read_configuration",
    "read_data_set",
    "read_log",
    "read_logs",
    "read_parameters",
    "simulate",
]

from .provenance import __version__
from .records import Log, LogFormat, RigConfiguration, demo_logs, read_configuration, read_data_set, read_log, read_logs
from .results import (
    Check,
    Comparison,
    Diagnosis,
    Look,
    ParameterSet,
    Simulation,
    build,
    check,
    compare,
    diagnose,
    look,
    read_parameters,
    simulate,
)
from .tools.identification import Identification, identify
from .tools.linearisation import linearise
from .tracing import DiagnosisSettings
