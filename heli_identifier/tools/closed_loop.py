"""A flight that is flown again in closed loop, by a plant and the controller that flew."""

from collections.abc import Sequence
from functools import lru_cache, partial
from math import inf

import numpy as np

from heli_identifier.errors import refuse
from heli_identifier.records import LogSource, read_logs
from heli_identifier.results import STRETCH, Check, Outcome, PlantSource, errors_in_loop, to_plant
from heli_identifier.tools.loop import Array, Settings
from heli_identifier.tools.margins import controller_system
from heli_plant.effects import AXES
from heli_plant.state_feedback import FeedbackSettings


def check_closed_loop(
    logs: LogSource | Sequence[LogSource], parameters: PlantSource, settings: Settings, limit: float = inf
) -> Check:
    """Fly logs again, 3 s at a time from the measured motion, with the controller that flew.

    The simulated voltages are the measured ones plus the answer of the controller, without its limits, to simulated
    less measured angles: what came from outside stays in them, and no reference has to be known. Errors of the followed
    axes up to ``limit`` [rad] pass. ConfigurationError if the sampling of a log does not fit a state feedback.
    """
    plant, outcomes = to_plant(parameters), list[Outcome]()
    followed = ("elevation", "travel" if settings.travel_enabled else "pitch")
    for log in read_logs(logs):
        figures = dict(zip(AXES, errors_in_loop(plant, log, partial(answer_deviations, settings)), strict=True))
        outcomes += [Outcome(log.name, axis, figures[axis], limit) for axis in followed]
    return Check(tuple(outcomes), (), "closed_loop_3s")


def answer_deviations(settings: Settings, delta: Array, step: float) -> Array:
    """Return the voltages (n, 2) [V] with which a controller answers deviations (n, 3) [rad], a ``step`` [s] apart."""
    period = settings.period if isinstance(settings, FeedbackSettings) else step
    every = round(period / step)
    refuse(
        every < 1 or abs(every * step - period) > 0.01 * step,
        f"the log has a sample every {step:g} s and this controller acts every {period:g} s; the controller's period "
        "must be a multiple of the log's.",
    )
    read, responses = delta[::every], _impulse_response(settings, period)
    volts = np.zeros((len(read), 2))
    for rotor, axis in np.ndindex(2, 3):
        volts[:, rotor] += np.convolve(read[:, axis], responses[:, rotor, axis])[: len(read)]
    # the voltages appear a period after the angles that they react to
    return np.vstack([np.zeros((every, 2)), np.repeat(volts, every, axis=0)])[: len(delta)]


@lru_cache(maxsize=8)
def _impulse_response(settings: Settings, period: float) -> Array:
    """Return the voltages with which a controller answers an impulse of each angle, (n, 2, 3) [V/rad]."""
    K = controller_system(settings, period)
    found, state = [K.D[:, :3]], K.B[:, :3]
    for _ in range(round(STRETCH / period)):
        found.append(K.C @ state)
        state = K.A @ state
    return np.array(found)
