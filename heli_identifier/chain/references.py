"""Which signals moved the rig from outside: references that are logged, rebuilt from the voltages, or the voltages.

Such a signal does not depend on the air, so it can serve as an instrument (:mod:`heli_identifier.tracing.instruments`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from heli_identifier.records import Array, Log

from .answers import CHANNELS
from .causality import feedback, refusal
from .controllers import LawRegression


@dataclass(frozen=True, eq=False)
class References:
    """The signals that moved the rig from outside, log by log."""

    names: tuple[str, ...]
    """The m signals: an axis [rad] where logged, a channel of the voltages [V] where rebuilt or in open loop."""
    signals: tuple[Array, ...]
    """For each log an array of shape (N, m); a column of zeros where a log does not have that signal."""
    origin: str
    """`voltages` (open loop), `logged`, `rebuilt`, several of them, or `none`."""
    closed_loop: bool
    """Whether a controller flew in any of the logs."""
    notes: tuple[str, ...] = ()
    """Which signals were refused and why, one sentence each."""


def find_references(logs: Sequence[Log]) -> References:
    """Find in each log what came from outside: logged references by test, else rebuilt ones, else the voltages.

    There are no signals (m = 0) if nothing came from outside.
    """
    closed, found, origins, notes = [feedback(log) for log in logs], dict[tuple[int, str], Array](), set(), list[str]()
    for channel, (sign, axes, _) in CHANNELS.items():
        answering: dict[int, LawRegression] = {}
        for i, log in enumerate(logs):
            if not closed[i]:
                found[i, channel] = log.voltages[:, 0] + sign * log.voltages[:, 1]
                origins.add("voltages")
                continue
            for axis in (axis for axis in axes if axis in log.references):
                if reason := refusal(log.references[axis], log.angles, log.rate_hz):
                    notes.append(f"{log.name}: the {axis} reference is not used, since {reason}.")
                else:
                    found[i, axis] = log.references[axis]
                    origins.add("logged")
            if not any((i, axis) in found for axis in axes):
                answering[i] = LawRegression(log, channel)
        for i, law in answering.items():
            law.search(list(answering.values()))
            _, signal, reason = law.rebuild()
            if signal is None:
                notes.append(f"{logs[i].name}: {channel} holds no reference: {reason}.")
            else:
                found[i, channel] = signal
                origins.add("rebuilt")
    every = [name for channel, (_, axes, _) in CHANNELS.items() for name in (*axes, channel)]
    names = tuple(name for name in every if any((i, name) in found for i in range(len(logs))))
    signals = tuple(np.zeros((len(log.angles), len(names))) for log in logs)
    for (i, name), signal in found.items():
        signals[i][:, names.index(name)] = signal
    return References(names, signals, " and ".join(sorted(origins)) or "none", any(closed), tuple(notes))
