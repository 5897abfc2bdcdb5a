__all__ = [
    "Agreement",
    "AxisError",
    "AxisReport",
    "BASE",
    "CatalogueVerdict",
    "CurveShape",
    "DataEntry",
    "Determination",
    "Diagnosis",
    "DiagnosisFile",
    "DiagnosisSettings",
    "EffectCurve",
    "ErrorFigure",
    "Fit",
    "FoundEffect",
    "HeldOutLikelihood",
    "HeldOutSeries",
    "LogFault",
    "Identification",
    "Likelihood",
    "NamedShape",
    "Outcome",
    "ParameterReport",
    "PeriodicShape",
    "Progress",
    "Model",
    "Rig",
    "RigVerdict",
    "Scores",
    "Use",
    "Verdict",
    "around",
    "coordinates_of",
    "diagnose",
    "errors_ahead",
    "find_references",
    "fit",
    "helicopter",
    "hold_to",
    "identify_plant",
    "instruments",
    "lag_voltages",
    "log_likelihood",
    "plausible_range",
    "record_start",
    "rms_figures",
    "select",
    "sign_notes",
    "variable_name",
]

from .diagnose import diagnose
from .fit import Fit, around, fit
from .held_out import Outcome, errors_ahead, hold_to, log_likelihood, rms_figures
from .helicopter import BASE, Rig, helicopter, lag_voltages, plausible_range, record_start
from .identification import Identification, Progress, identify_plant
from .instruments import instruments
from .likelihood import Likelihood
from .noise import coordinates_of
from .prediction import Model
from .references import find_references
from .result import (
    Agreement,
    AxisError,
    AxisReport,
    CatalogueVerdict,
    CurveShape,
    DataEntry,
    Determination,
    Diagnosis,
    DiagnosisFile,
    EffectCurve,
    ErrorFigure,
    FoundEffect,
    HeldOutLikelihood,
    HeldOutSeries,
    LogFault,
    NamedShape,
    ParameterReport,
    PeriodicShape,
    RigVerdict,
    Use,
    Verdict,
    variable_name,
)
from .score import Scores
from .select import select
from .settings import DiagnosisSettings
from .strangers import sign_notes
