"""Native units: translated from the same Python source to C, so that the host needs no Python.

    build("HelicopterPlant", "build", native=True)          FMI 2.0, binaries and sources

:mod:`.translator` translates a typed subset of Python to C99. The folder ``c`` contains the code written by hand: the
calls of a unit, its memory, the functions of FMI, and for each unit the connection of variables and functions.
"""

from .builder import NATIVE_UNITS, controller_sources
from .toolchain import missing_compilers, runs_here

__all__ = ["NATIVE_UNITS", "controller_sources", "runs_here", "missing_compilers"]
