from .loop import run
from .process import die_with_parent, run_apart, run_many_apart
from .result import Bands, Result

__all__ = ["Bands", "Result", "die_with_parent", "run", "run_apart", "run_many_apart"]
