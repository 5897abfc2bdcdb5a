from .loop import run
from .process import Child, run_apart, run_many_apart, waiting_child
from .result import Bands, Result

__all__ = ["Bands", "Child", "Result", "run", "run_apart", "run_many_apart", "waiting_child"]
