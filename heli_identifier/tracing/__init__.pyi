__all__ = [
    "AMBIGUOUS",
    "AxisError",
    "AxisReport",
    "BASE",
    "CatalogueVerdict",
    "Diagnosis",
    "DiagnosisSettings",
    "EFFECTS_SHOWN",
    "EffectCurve",
    "ErrorFigure",
    "FoundEffect",
    "HIGHEST_LINE",
    "HeldOutSeries",
    "LOWEST_LINE",
    "MODEL_ADEQUATE",
    "NOT_SHOWN",
    "NOT_TESTABLE",
    "Outcome",
    "Problem",
    "Record",
    "SHOWN",
    "Scan",
    "UNKNOWN",
    "UNKNOWN_EFFECT",
    "candidates",
    "diagnose",
    "experiment_for",
    "fit",
    "hold_to",
    "stepping_at",
    "run_start",
    "scan",
    "sign_notes",
    "torque_filter",
    "use_threads",
]

from .diagnosis.diagnose import diagnose
from .diagnosis.result import EFFECTS_SHOWN, MODEL_ADEQUATE, UNKNOWN_EFFECT, Diagnosis, EffectCurve, HeldOutSeries
from .diagnosis.settings import DiagnosisSettings
from .diagnosis.signs import sign_notes
from .prediction.fit import BASE, fit
from .prediction.problem import Problem
from .prediction.record import Record
from .prediction.torque import torque_filter
from .prediction.workers import use_threads
from .search.candidates import candidates, stepping_at
from .search.experiments import experiment_for
from .search.findings import AMBIGUOUS, NOT_SHOWN, NOT_TESTABLE, SHOWN, UNKNOWN, CatalogueVerdict, FoundEffect
from .search.scan import Scan, scan
from .search.settings import HIGHEST_LINE, LOWEST_LINE
from .validation.figures import AxisError, AxisReport, ErrorFigure
from .validation.free_run import run_start
from .validation.gate import Outcome, hold_to
