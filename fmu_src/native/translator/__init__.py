"""A translator from the typed subset of Python in which the units are written to C99.

    translation = Translation()
    entry = translation.entry(function)                 refuses with file, line and reason what it does not know
    header(translation, ...), source([entry], ...)      text

One definition per equation stays: the functions are read from the project's own sources, also those that
:mod:`heli_plant.laws` composes of the effects' laws.
"""

from .emission import header, source
from .functions import Translation, Unit
from .persistence import text as persistence
from .refusal import Untranslatable
from .types import BOOL, INT, Choice, CType, Struct, choose, fields

__all__ = [
    "BOOL",
    "INT",
    "CType",
    "Choice",
    "Struct",
    "Translation",
    "Unit",
    "Untranslatable",
    "choose",
    "fields",
    "header",
    "persistence",
    "source",
]
