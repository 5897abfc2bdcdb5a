"""The master: runs a scenario of the wiring table on built units.

``run`` steps the units in this process; ``run_apart`` does the same in a process of its own, which callers should
prefer (:mod:`fmu_src.master.process` says why).
"""

from .loop import run
from .process import run_apart
from .result import Result

__all__ = ["Result", "run", "run_apart"]
