from .loop import run
from .process import Child, die_with_parent, run_apart, run_many_apart, waiting_child
from .result import Bands, Result

__all__ = ["Bands", "Child", "Result", "die_with_parent", "run", "run_apart", "run_many_apart", "waiting_child"]
