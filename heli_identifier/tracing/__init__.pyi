__all__ = [
    "AxisError",
    "AxisReport",
    "BASE",
    "CatalogueVerdict",
    "CurveShape",
    "Diagnosis",
    "DiagnosisSettings",
    "EffectCurve",
    "EffectShape",
    "ErrorFigure",
    "FoundEffect",
    "HIGHEST_LINE",
    "HeldOutSeries",
    "LOWEST_LINE",
    "NamedShape",
    "Outcome",
    "PeriodicShape",
    "Problem",
    "Record",
    "RigVerdict",
    "Scan",
    "Verdict",
    "Withdrawal",
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
from .diagnosis.result import Diagnosis, EffectCurve, HeldOutSeries, RigVerdict
from .diagnosis.settings import DiagnosisSettings
from .diagnosis.signs import sign_notes
from .prediction.fit import BASE, fit
from .prediction.problem import Problem
from .prediction.record import Record
from .prediction.torque import torque_filter
from .prediction.workers import use_threads
from .search.candidates import candidates, stepping_at
from .search.experiments import experiment_for
from .search.found_effect import CurveShape, EffectShape, FoundEffect, NamedShape, PeriodicShape
from .search.scan import Scan, scan
from .search.settings import HIGHEST_LINE, LOWEST_LINE
from .search.verdict import CatalogueVerdict, Verdict, Withdrawal
from .validation.figures import AxisError, AxisReport, ErrorFigure
from .validation.free_run import run_start
from .validation.gate import Outcome, hold_to
