"""Levels of the search, and the band in which it looks for periodic torques."""

HIGHEST_FREQUENCY = 3.0
"""Highest frequency [Hz] of a periodic torque: above it an encoder's counts under steady motion look like one."""

LOWEST_FREQUENCY = 0.06
"""Lowest frequency [Hz] of a periodic torque: below it a record holds too few periods to tell it from drift."""

SIGNIFICANCE = 0.005
"""Probability that a record of the null model has any effect shown."""

SHOWN_SCORE = 4.0
"""Least score that shows an effect in open loop."""

SHOWN_SCORE_CLOSED = 5.0
"""The same in closed loop, where a coloured residual comes back through the voltages, and for short logs, of which few
blocks make the surrogates."""

SHORT_LOGS = 179.0
"""Length of all logs together [s] below which they are short: three minutes, less what rounding takes."""

SHORTLIST, CONTENDING_SHARE = 4, 0.4
"""Most candidates that are refitted at a time, and their least share of the best one's likelihood ratio."""

SHAPE_PRICE = 8.0
"""Likelihood ratio that a free shape parameter must bring: log(n) of the Bayesian criterion, n some thousand."""

LAW_SHARE = 0.03
"""Laws are idealisations: of trials that differ by less than this share, the one with the fewest shapes is taken."""

UNKNOWN_LEVEL = 45.0
"""Least likelihood ratio (chi-squared of one degree) of an unknown torque: less is a ripple, not an effect.

The search looks at some 30 curves and, per axis, at some 600 resolvable frequencies. Chance alone would ask for 34:
a probability of 1e-5 that a record of the null model shows an unknown torque.
"""

UNKNOWN_FACTOR, UNKNOWN_MARGIN = 1.2, 10.0
"""In place of named effects, an unknown torque must have this factor times their likelihood ratio, plus the margin."""

UNKNOWN_SHARE = 0.25
"""Share of the named effects' likelihood ratio that an unknown torque beside them must have: no law is exact."""

SHARE_BESIDE_NAMED, SHARE_BESIDE_UNKNOWN = 0.01, 0.1
"""Share of the likelihood ratio of named effects, or of an unknown torque, that a further named effect must have."""

SHARE_BESIDE_SAME_MECHANISM = 0.2
"""The same for another law of a mechanism that the model has on that axis already."""

COMPANION_SCORE = 3.0
"""Score of a coupling on an axis once the same coupling is shown on another: it is expected there, not searched for."""

MOST_EFFECTS = 8
"""Most effects in a model."""
