__all__ = [
    "Agreement",
    "Array",
    "BASE",
    "CURVE",
    "CatalogueVerdict",
    "CurveShape",
    "Determination",
    "DiagnosisSettings",
    "EffectCurve",
    "Fit",
    "FoundEffect",
    "IdentifiedPlant",
    "Likelihood",
    "LogFault",
    "NamedShape",
    "Number",
    "ParameterReport",
    "PeriodicShape",
    "Progress",
    "Rig",
    "Scores",
    "Verdict",
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
    "sign_notes",
    "variable_name",
]

from .fit import Fit, fit, known_fit
from .helicopter import BASE, CURVE, Rig, helicopter, plausible_range
from .identification import IdentifiedPlant, Progress, identify_plant
from .instruments import instruments
from .likelihood import Likelihood
from .motion import lag_voltages, record_start
from .noise import coordinates_of
from .outlying_logs import sign_notes
from .score import Scores
from .select import select
from .settings import DiagnosisSettings
from .statements import (
    Agreement,
    Array,
    CatalogueVerdict,
    CurveShape,
    Determination,
    EffectCurve,
    FoundEffect,
    LogFault,
    NamedShape,
    Number,
    ParameterReport,
    PeriodicShape,
    Verdict,
    variable_name,
)
