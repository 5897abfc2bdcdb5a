"""On-line adaptive identification of all three axes as pure steps; standard library only.

The symbols are the paper's: theta, epsilon, lambda for pitch, elevation, travel; omega_f, rho of the state filters
(11); phi, Omega, Gamma, alpha, sigma of the adaptation (7).
"""

from .candidates import WATCHABLE
from .identifier import Estimate, IdentifierState, Plan, estimate_of, prepare, restored, start, step
from .parameters import ModelParameters
from .score import Score
from .settings import IdentifierSettings

__all__ = [
    "WATCHABLE",
    "Estimate",
    "IdentifierSettings",
    "IdentifierState",
    "ModelParameters",
    "Plan",
    "Score",
    "estimate_of",
    "prepare",
    "restored",
    "start",
    "step",
]
