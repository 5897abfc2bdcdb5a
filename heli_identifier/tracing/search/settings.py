"""Levels of the search, and the band in which it looks for lines."""

from dataclasses import dataclass

HIGHEST_LINE = 3.0
"""Highest frequency [Hz] of a line: above it the pattern of an encoder's counts under steady motion passes for one."""

LOWEST_LINE = 0.06
"""Lowest frequency [Hz] of a line: below it a record holds too few periods to tell a line from drift."""


@dataclass(frozen=True)
class SelectionSettings:
    """Levels of the search.

    Attributes
    ----------
    significance : float
        Probability that a record of the bare model has any effect shown.
    shortlist : int
        Candidates that are refitted in a round.
    shape_price : float
        Gain in twice the log-likelihood that a free shape parameter must bring: the Bayesian criterion's log(n) for
        the some thousand independent samples of a data set.
    law_share : float
        Laws are idealisations: of trials whose gains differ by less than this share, the one with the fewest shape
        parameters is taken.
    unknown_least : float
        Surplus that an unknown torque must reach whatever its probability: less is a ripple, not an effect.
    unknown_factor, unknown_margin : float
        An unknown torque must gain this factor times what the best named effect gains, plus this margin.
    unknown_share : float
        Beside a named effect on its axis, an unknown torque must gain this share of what the named effects gained:
        a law is never exact, and what is left of it is not a discovery.
    share_beside_named, share_beside_unknown : float
        A further named effect must gain this share of what named effects, or an unknown torque, gained on its axes.
    share_beside_kin : float
        The same for another law of a mechanism that the model has on that axis already.
    companion_score : float
        Score of a coupling on an axis once the same coupling is shown on another: it is no longer searched for among
        the whole catalogue but expected there.
    unknown_significance : float
        Probability that a record of the bare model shows an unknown torque.
    most : int
        Most effects in a model.
    """

    significance: float = 0.005
    shortlist: int = 4
    shape_price: float = 8.0
    law_share: float = 0.03
    unknown_least: float = 45.0
    unknown_factor: float = 1.2
    unknown_margin: float = 10.0
    unknown_share: float = 0.25
    share_beside_named: float = 0.01
    share_beside_unknown: float = 0.1
    share_beside_kin: float = 0.2
    companion_score: float = 3.0
    unknown_significance: float = 1e-5
    most: int = 8
