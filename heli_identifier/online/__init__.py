"""On-line adaptive identification of all three axes as pure steps; standard library only, since FMUs carry it.

The symbols are the paper's: theta, epsilon, lambda for pitch, elevation, travel; omega_f, rho of the state filters
(11); phi, Omega, Gamma, alpha, sigma of the adaptation (7). The excitation signals have a door of their own,
:mod:`heli_identifier.online.excitation`.
"""

from .adaptation import adapt
from .candidates import WATCHABLE, Candidate, candidate
from .estimate import Estimate, ModelParameters
from .identifier import start, step
from .linear_algebra import total
from .plan import Plan, prepare
from .sampled import Sampled, begin_sampling, take_samples
from .score import Score
from .settings import IdentifierSettings
from .signals import (
    advance_signals,
    elevation_regression,
    pitch_regression,
    pitch_regression_free,
    travel_regression,
)
from .state import IdentifierOutput, IdentifierState, before_samples, output_of, restored

__all__ = [
    "WATCHABLE",
    "Candidate",
    "Estimate",
    "IdentifierOutput",
    "IdentifierSettings",
    "IdentifierState",
    "ModelParameters",
    "Plan",
    "Sampled",
    "Score",
    "adapt",
    "advance_signals",
    "before_samples",
    "begin_sampling",
    "candidate",
    "elevation_regression",
    "output_of",
    "pitch_regression",
    "pitch_regression_free",
    "prepare",
    "restored",
    "start",
    "step",
    "take_samples",
    "total",
    "travel_regression",
]
