"""A translator from the typed subset of Python in which the units are written to C99.

    translation = Translation()
    entry = translation.entry(function)                 refuses with file, line and reason what it does not know
    header(translation), source(translation)            text

One definition per equation stays: the functions are read from the project's own sources, also those that
:mod:`heli_plant.laws` composes of the effects' laws.
"""

from .body import Untranslatable
from .program import Translation, Unit, header, parts_of, persistence, source
from .types import BOOL, INT, CType, Struct, choose
from .values import quoted

__all__ = [
    "BOOL", "INT", "CType", "Struct", "Translation", "Unit", "Untranslatable", "choose", "header",
    "parts_of", "persistence", "quoted", "source",
]  # fmt: skip
