"""Settings of the following twin, and the constants of its steps that follow from them."""

from math import log
from typing import NamedTuple

from heli_plant.laws import input_delay
from heli_plant.observer import TRAVEL_BANDWIDTH
from heli_plant.parameters import PlantParameters

from .changes import list_changes, prior_deviations
from .covariance import find_steady_state, gap_memory
from .evidence import start_sums

_BLOCK_TIME = 1.0  # length of a block of sums, about [s]
_COARSE_TIME = 0.05  # step of the copies that run 1 s ahead, about [s]: a hundredth of the motion's shortest period
SAMPLE_TIME = 0.01  # between two samples of the twin [s]: encoders err alike for about as long
_LAUNCH_TIME, _HORIZON_TIME = 0.2, 1.0  # time between two starts of copies, and time that a copy runs, about [s]
_WINDOW_TIME = 10.0  # over which errors 1 s ahead are compared [s]
_SETTLING_TIME = 3.0  # time until the observer has settled [s]
_STOP_TIME = 0.2  # time without a sample after which the stream counts as stopped [s]
_SLACK = 1.0  # by which the bound on false alarms is lowered [1]: its tests are alike (docs, "Noticing")
_STUCK_TIME = 0.5  # time at one count after which an encoder is ignored [s]


class FollowSettings(NamedTuple):
    """Everything that can be set on the following twin, which is a set of the plant's parameters.

    Time between two samples h [s]; ``parameters`` in use at the start; smallest mean time between two false alarms [s];
    bandwidth of the observer's poles on pitch and elevation [rad/s] (:mod:`heli_plant.observer`); ``correcting``:
    whether changes are adopted or only reported. The unit Corrector checks the bounds of these settings.
    """

    sample_time: float = SAMPLE_TIME
    parameters: PlantParameters = PlantParameters()
    false_alarm_time: float = 36000.0
    observer_bandwidth: float = 6.6
    correcting: bool = True


class FollowPlan:
    """Constants of every step, computed once from the settings.

    ``changes``: what may change. ``alone``: the twin of the start. ``deviations``: standard deviations of the errors of
    the twin's coefficients of the regressors, for each axis; ``no_sums``: empty sums of these regressors, and the block
    that they make (``no_block``); ``steady``: the observer of each axis without gaps; ``delay``: the plant's input
    delay [s]; ``threshold``: Lorden's bound less the slack of tests that are alike [1].

    In samples: the ``coarse`` step of copies, the time between two starts of copies (``launch``), the ``horizon`` to
    which they run, a ``block`` of sums, ``settling``, ``stop``, ``stuck``, and ``gap_memory``, in which a gap is
    forgotten. ``window``: number of comparisons in a window.
    """

    def __init__(self, settings: FollowSettings) -> None:
        h, p, bandwidth = settings.sample_time, settings.parameters, settings.observer_bandwidth
        self.settings, self.alone = settings, p
        self.changes, self.deviations = list_changes(p), prior_deviations(p)
        self.no_sums = tuple([start_sums(len(row)) for row in self.deviations])
        self.no_block = tuple([sums.products for sums in self.no_sums])
        self.steady = tuple([find_steady_state(factor * bandwidth, h) for factor in (1.0, 1.0, TRAVEL_BANDWIDTH)])
        self.delay = input_delay(p)
        self.threshold = log(2 * len(self.changes) * settings.false_alarm_time / _BLOCK_TIME) - _SLACK

        def samples(time: float, multiple_of: int = 1) -> int:
            return multiple_of * max(1, round(time / (multiple_of * h)))

        self.coarse = samples(_COARSE_TIME)
        self.launch = samples(_LAUNCH_TIME, self.coarse)
        self.horizon, self.block = samples(_HORIZON_TIME, self.launch), samples(_BLOCK_TIME, self.coarse)
        self.settling, self.stop, self.stuck = samples(_SETTLING_TIME), samples(_STOP_TIME), samples(_STUCK_TIME)
        self.gap_memory = gap_memory(bandwidth, h)
        self.window = round(_WINDOW_TIME / (self.launch * h))
