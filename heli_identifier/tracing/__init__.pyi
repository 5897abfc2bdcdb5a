__all__ = [
    "BASE",
    "CURVE",
    "Fit",
    "IdentifiedPlant",
    "Likelihood",
    "Progress",
    "Rig",
    "Scores",
    "coordinates_of",
    "fit",
    "helicopter",
    "identify_plant",
    "instruments",
    "known_fit",
    "lag_voltages",
    "plausible_range",
    "record_start",
    "select",
]

from .fit import Fit, fit, known_fit
from .helicopter import BASE, CURVE, Rig, helicopter, plausible_range
from .identification import IdentifiedPlant, Progress, identify_plant
from .instruments import instruments
from .likelihood import Likelihood
from .motion import lag_voltages, record_start
from .noise import coordinates_of
from .score import Scores
from .select import select
