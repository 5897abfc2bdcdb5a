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
from .tracing import Diagnosis, DiagnosisSettings
from .workbench.interface import diagnose, write_results
