"""On-line adaptive identification of all three axes as pure steps; standard library only, since FMUs carry it.

The symbols are the paper's: theta, epsilon, lambda for pitch, elevation, travel; omega_f, rho of the state filters
(11); phi, Omega, Gamma, alpha, sigma of the adaptation (7); e, G, nu, lambda of the prediction errors, which hold
where a controller closes the loop. The excitation signals have a door of their own,
:mod:`heli_identifier.online.excitation`.
"""

from .adaptation import adapt
from .candidates import WATCHABLE
from .estimate import Estimate, ModelParameters, determined
from .feedback import CLOSED
from .identifier import start, step
from .noise_model import Noise
from .plan import Plan, prepare
from .prediction_error import noise_of
from .score import Score
from .settings import ADAPTATION, METHODS, PREDICTION_ERROR, IdentifierSettings
from .signals import (
    advance_signals,
    elevation_regression,
    pitch_regression,
    pitch_regression_free,
    travel_regression,
)
from .state import IdentifierOutput, IdentifierState, Lag, output_of, restored

__all__ = [
    "ADAPTATION",
    "CLOSED",
    "METHODS",
    "PREDICTION_ERROR",
    "WATCHABLE",
    "Estimate",
    "IdentifierOutput",
    "IdentifierSettings",
    "IdentifierState",
    "Lag",
    "ModelParameters",
    "Noise",
    "Plan",
    "Score",
    "adapt",
    "advance_signals",
    "determined",
    "elevation_regression",
    "noise_of",
    "output_of",
    "pitch_regression",
    "pitch_regression_free",
    "prepare",
    "restored",
    "start",
    "step",
    "travel_regression",
]
