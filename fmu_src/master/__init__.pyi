from .loop import run
from .process import run_apart
from .result import Result

__all__ = ["Result", "run", "run_apart"]
