r"""The mean of one coefficient over several rigs, by a random-effects model.

Rig i gives an estimate y_i with standard error s_i. The model is

    y_i = mu + u_i + e_i,   u_i ~ N(0, tau^2),   e_i ~ N(0, s_i^2)

with the mean mu of the make, the spread tau between its rigs, and the weights w_i = 1 / (s_i^2 + tau^2).

* tau solves sum w_i (y_i - mu)^2 = k - 1 for k rigs (Paule and Mandel 1982; DerSimonian and Kacker 2007, eq. 10).
* The variance of the mean is max(1, q) / sum w_i with q = sum w_i (y_i - mu)^2 / (k - 1), and its quantiles are those
  of Student's t with k - 1 degrees of freedom (Hartung and Knapp 2001). The lower bound of 1 keeps a few rigs that
  agree by chance from giving too short an interval (Röver, Knapp and Friede 2015).
* Q = sum (y_i - m)^2 / s_i^2 about the fixed-effect mean m tests whether all rigs have one value, by chi-squared with
  k - 1 degrees of freedom (Cochran 1954). I^2 = max(0, 1 - (k - 1) / Q) is the share of the variance of the estimates
  that the rigs' differences make (Higgins and Thompson 2002, eq. 10).
* Intervals of tau and of the value of a further rig of the make follow from the distribution of Q(tau), as
  :mod:`heli_identifier.workbench.fleet.spread` says.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from heli_identifier.errors import IdentifierError
from heli_identifier.workbench.fleet.spread import prediction_interval, spreads, weighted

LEVEL = 0.95
"""Probability of all intervals."""

LARGEST_LIKE_SPREAD = 0.5
"""Spread over the size of the mean up to which coefficients are alike: 97.7 % of those of a normal distribution then
have the sign of the mean."""


@dataclass(frozen=True)
class Pooled:
    """The random-effects mean of one coefficient, in the unit of the coefficient.

    Attributes
    ----------
    mean, standard_error : float
    interval : tuple of float
        95 % interval of the mean, by Hartung and Knapp.
    p : float
        Two-sided probability of such a mean if the true one is zero, whatever the spread.
    none_p : float
        Two-sided probability of such estimates if no rig has the effect: of the fixed-effect mean m over its standard
        error, a normal variable. It is far smaller than p where the rigs are few, as it does without the spread.
    spread : float
        tau, the standard deviation between the rigs.
    spread_interval : tuple of float
        95 % interval of tau.
    prediction : tuple of float or None
        95 % interval of the true value of a further rig; None for two rigs, whose interval says nothing.
    Q, Q_p : float
        Statistic of Cochran's test that all rigs have one value, and its probability.
    I2 : float
        Share of the variance of the estimates that the rigs' differences make, 0 to 1.
    rigs : int
        Number of rigs, k.
    """

    mean: float
    standard_error: float
    interval: tuple[float, float]
    p: float
    none_p: float
    spread: float
    spread_interval: tuple[float, float]
    prediction: tuple[float, float] | None
    Q: float
    Q_p: float
    I2: float
    rigs: int

    @property
    def alike(self) -> bool:
        """Whether the spread between the rigs is at most half of the mean."""
        return self.spread <= LARGEST_LIKE_SPREAD * abs(self.mean)


def pooled(values: Sequence[float], standard_errors: Sequence[float]) -> Pooled:
    """Pool the estimates of one coefficient.

    Parameters
    ----------
    values, standard_errors : sequence of float, k of each
        Estimates of at least two rigs; the standard errors are finite and positive.

    Returns
    -------
    Pooled

    Raises
    ------
    IdentifierError
        Fewer than two estimates, or one that is not finite or has no positive standard error.
    """
    from scipy.stats import chi2, norm, t

    y, s = np.array(values, dtype=float), np.array(standard_errors, dtype=float)
    k = len(y)
    if k < 2 or len(s) != k or not (np.isfinite(y).all() and np.isfinite(s).all() and (s > 0.0).all()):
        raise IdentifierError(
            f"estimates {y.tolist()} with standard errors {s.tolist()} cannot be pooled; two or more finite estimates "
            "with a positive standard error each are needed."
        )
    (fixed,), (Q,), (fixed_precision,) = weighted(y, s, [0.0])
    (tau,) = spreads(y, s, [k - 1.0])
    ((m,), (q,), (precision,)) = weighted(y, s, [tau])
    error = float(np.sqrt(max(1.0, q / (k - 1)) / precision))
    half = float(t.isf(0.5 - 0.5 * LEVEL, k - 1)) * error
    low, high = spreads(y, s, chi2.isf([0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], k - 1))
    return Pooled(
        mean=float(m),
        standard_error=error,
        interval=(float(m) - half, float(m) + half),
        p=float(2.0 * t.sf(abs(m) / error, k - 1)),
        none_p=float(2.0 * norm.sf(abs(fixed) * np.sqrt(fixed_precision))),
        spread=float(tau),
        spread_interval=(float(low), float(high)),
        prediction=prediction_interval(y, s, LEVEL) if k > 2 else None,
        Q=float(Q),
        Q_p=float(chi2.sf(Q, k - 1)),
        I2=float(1.0 - (k - 1) / Q) if Q > k - 1 else 0.0,
        rigs=k,
    )
