"""Scenarios and parameter sets as SSP 1.0 files, for tools other than the master."""

from .archive import write_ssp
from .parameter_set import read_parameter_set, write_parameter_set

__all__ = ["read_parameter_set", "write_parameter_set", "write_ssp"]
