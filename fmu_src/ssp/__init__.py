"""Scenarios and parameter sets as SSP 1.0 files, for tools other than the master."""

from .parameter_set import read_parameter_set, write_parameter_set
from .scenario_file import write_ssp

__all__ = ["read_parameter_set", "write_parameter_set", "write_ssp"]
