"""On-line adaptive identification of all three axes as pure steps; standard library only, because FMUs contain it.

The symbols are the paper's: theta, epsilon, lambda for pitch, elevation, travel; omega_f, rho of the state filters
(11); phi, Omega, Gamma, alpha, sigma of the adaptation (7); e, G, nu, lambda of the prediction errors.
"""

# ruff: noqa: F401 - the names are the subpackage's interface
from .adaptation import combinations, gain_matrix
from .identifier import (
    IdentifierOutput,
    IdentifierState,
    Sampled,
    before_samples,
    begin_sampling,
    next_due,
    output_of,
    start,
    step,
    take_samples,
)
from .instruments import CONTRADICTION, GAINS
from .linear_algebra import total
from .loop import CLOSED, is_closed, shares
from .prediction_error import noise_of
from .settings import (
    ADAPTATION,
    PREDICTION_ERROR,
    Estimate,
    IdentifierSettings,
    ModelParameters,
    Plan,
    default_settings,
    is_determined,
    prepare,
)
from .whitening import Noise
