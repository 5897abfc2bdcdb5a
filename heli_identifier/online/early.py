"""Early forgetting: what was learnt while the noise model was still wrong does not stay.

With omega_o too small by a quarter, the innovations have four times their intensity at low frequencies, where the
parameters are learnt: (4/5)^-6. The first seconds then count for more than they tell, under a controller to wrong
values. In the beginning the estimation therefore forgets faster (Ljung and Soderstrom, Theory and Practice of Recursive
Identification, 1983, section 5.6), by alpha + alpha_0 with

    alpha_0(t) = A/tau exp(-t/tau),    over samples n .. m kept: exp(-A (exp(-n h/tau) - exp(-m h/tau)))

so that samples of the first second weigh exp(-A) at last, and those of 2 tau after the beginning two thirds.
"""

from math import exp

_FORGOTTEN, _TIME = 3.0, 6.0
"""A [1] and tau [s]. Chosen with generated rigs of another seed than those that results are reported on."""

_OVER = 12.0 * _TIME
"""Time after which nothing more is forgotten early [s]: A exp(-12) is 2e-5."""


def kept_early(count: int, samples: int, h: float) -> float:
    """Return the share of the information that is kept over ``samples`` of ``h`` [s] up to the one numbered ``count``.

    ``count`` numbers the samples from the beginning of the estimation, from 0.
    """
    end = (count + 1) * h
    if end > _OVER:
        return 1.0
    return exp(-_FORGOTTEN * (exp((samples * h - end) / _TIME) - exp(-end / _TIME)))
