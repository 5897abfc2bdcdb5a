__all__ = [
    "Check",
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

from .records import Log, LogFormat, RigConfiguration, demo_logs, read_configuration, read_data_set, read_log, read_logs
from .tools.identification import Identification, identify
from .tools.linearisation import linearise
from .tracing import DiagnosisSettings
from .workbench.delivery.parameter_file import read_parameters
from .workbench.delivery.parameter_set import ParameterSet
from .workbench.delivery.provenance import __version__
from .workbench.interface.checking import Check, check
from .workbench.interface.diagnosis import Diagnosis, diagnose
from .workbench.interface.looking import Look, look
from .workbench.interface.simulation import Simulation, simulate
from .workbench.interface.units import build
