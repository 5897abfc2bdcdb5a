from .loop import run
from .process import run_apart
from .result import Bands, Result

__all__ = ["Bands", "Result", "run", "run_apart"]
