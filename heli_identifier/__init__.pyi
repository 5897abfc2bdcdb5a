__all__ = [
    "Check",
    "Comparison",
    "Diagnosis",
    "DiagnosisSettings",
    "Event",
    "Identification",
    "Log",
    "LogFormat",
    "Look",
    "ParameterSet",
    "RigConfiguration",
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
from .records import (
    Event,
    Log,
    LogFormat,
    RigConfiguration,
    demo_logs,
    read_configuration,
    read_data_set,
    read_log,
    read_logs,
)
from .results import (
    Check,
    Comparison,
    Diagnosis,
    Look,
    ParameterSet,
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
