"""On-line adaptive identification of all three axes as pure steps; standard library only, since it travels in FMUs.

The symbols are the paper's: theta, epsilon, lambda for pitch, elevation, travel; omega_f, rho of the state filters
(11); phi, Omega, Gamma, alpha, sigma of the adaptation (7). The excitation signals have a door of their own,
:mod:`heli_identifier.online.excitation`.
"""

from .adaptation import adapt
from .candidates import WATCHABLE
from .estimate import Estimate
from .identifier import IdentifierOutput, IdentifierState, Plan, output_of, prepare, restored, start, step
from .parameters import ModelParameters
from .score import Score
from .settings import IdentifierSettings
from .signals import (
    advance_signals,
    elevation_regression,
    pitch_regression,
    pitch_regression_free,
    travel_regression,
)

__all__ = [
    "WATCHABLE",
    "Estimate",
    "IdentifierOutput",
    "IdentifierSettings",
    "IdentifierState",
    "ModelParameters",
    "Plan",
    "Score",
    "adapt",
    "advance_signals",
    "elevation_regression",
    "output_of",
    "pitch_regression",
    "pitch_regression_free",
    "prepare",
    "restored",
    "start",
    "step",
    "travel_regression",
]
