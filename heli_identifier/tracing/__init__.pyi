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
    "DiagnosisSettings",
    "EffectCurve",
    "ErrorFigure",
    "Event",
    "Fit",
    "FoundEffect",
    "HeldOutLikelihood",
    "HeldOutSeries",
    "Identification",
    "LOWEST_FREQUENCY",
    "Likelihood",
    "LikelihoodSettings",
    "NamedShape",
    "Outcome",
    "ParameterReport",
    "PeriodicShape",
    "Rig",
    "RigVerdict",
    "Scores",
    "Use",
    "Verdict",
    "diagnose",
    "find_events",
    "find_references",
    "fit",
    "helicopter",
    "hold_to",
    "identify_plant",
    "observer_start",
    "scan",
    "sign_notes",
]

from .determination import ParameterReport
from .diagnosis.diagnose import diagnose
from .diagnosis.result import Diagnosis, EffectCurve, HeldOutSeries, PossibleEffect, RigVerdict
from .diagnosis.settings import DiagnosisSettings
from .diagnosis.signs import sign_notes
from .events.event import Event
from .events.finding import find_events
from .identification import Identification, identify_plant
from .likelihood import Likelihood
from .prediction.fit import BASE, fit
from .prediction.observer import observer_start
from .prediction.problem import Problem
from .prediction.torque import torque_filter
from .prediction.workers import use_threads
from .search.candidates import candidates, stepping_at
from .search.experiments import experiment_for
from .search.found_effect import CurveShape, EffectShape, FoundEffect, NamedShape, PeriodicShape
from .search.scan import Scan, scan
from .search.settings import HIGHEST_FREQUENCY, LOWEST_FREQUENCY
from .search.verdict import CatalogueVerdict, Verdict, Withdrawal
from .settings import LikelihoodSettings
from .validation.figures import AxisError, AxisReport, ErrorFigure
from .validation.gate import Outcome, hold_to
