"""Native twins: the units translated from the same Python source to C, which needs no Python on the host.

    build("HelicopterPlant", "build", native=True)          FMI 2.0, binaries and sources

:mod:`.translator` turns the typed subset of Python into C99, the folder ``c`` holds what is written by hand: the life
of a unit, its memory, the functions of FMI, and for each unit which variable goes where.
"""

from .builder import NATIVE_UNITS, controller_sources
from .toolchain import missing_compilers, runs_here

__all__ = ["NATIVE_UNITS", "controller_sources", "runs_here", "missing_compilers"]
