__all__ = [
    "Diagnosis",
    "DiagnosisSettings",
    "Log",
    "LogFormat",
    "RigConfiguration",
    "demo_logs",
    "diagnose",
    "read_configuration",
    "read_data_set",
    "read_log",
    "read_logs",
    "write_results",
]

from .records import Log, LogFormat, RigConfiguration, demo_logs, read_configuration, read_data_set, read_log, read_logs
from .tracing import DiagnosisSettings
from .workbench.interface import Diagnosis, diagnose, write_results
