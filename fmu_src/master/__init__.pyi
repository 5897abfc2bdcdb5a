from .loop import run
from .process import die_with_parent, run_apart
from .result import Result

__all__ = ["Result", "die_with_parent", "run", "run_apart"]
