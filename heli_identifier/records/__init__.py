"""Measured logs: reading, checking, conversion, and the configuration of a rig with its own ways."""

from heli_identifier.records.configuration import CONFIGURATION_NAME, RigConfiguration, read_configuration
from heli_identifier.records.data_set import (
    check_apart,
    check_excitation,
    check_moving,
    named_apart,
    read_data_set,
    read_logs,
)
from heli_identifier.records.demo import DEMO_RIGS, demo_logs
from heli_identifier.records.format import CONTRACT, LogFormat
from heli_identifier.records.log import Log, log_from_samples
from heli_identifier.records.reading import read_log
from heli_identifier.records.template import write_template
from heli_identifier.records.writing import write_log, write_whole

__all__ = [
    "CONFIGURATION_NAME",
    "CONTRACT",
    "DEMO_RIGS",
    "Log",
    "LogFormat",
    "RigConfiguration",
    "check_apart",
    "check_excitation",
    "check_moving",
    "demo_logs",
    "log_from_samples",
    "named_apart",
    "read_configuration",
    "read_data_set",
    "read_log",
    "read_logs",
    "write_log",
    "write_template",
    "write_whole",
]
