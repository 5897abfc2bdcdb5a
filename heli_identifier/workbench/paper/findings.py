"""The results of the tables and figures in sentences."""

from collections.abc import Mapping, Sequence
from math import pi, sqrt

import numpy as np

from heli_identifier.workbench.paper.open_loop import SideBySide
from heli_identifier.workbench.paper.published import EXPERIMENTS, PITCH
from heli_identifier.workbench.paper.runs import FREE, KNOWN, Run
from heli_identifier.workbench.paper.spread import AS_GOOD, HALF_WIDTHS, Explanation
from heli_identifier.workbench.paper.tables import CERTAIN_GAIN, found_range, table_2, worst_deviation
from heli_identifier.workbench.paper.within import TorqueSpread
from heli_plant.encoders import EncoderCounts

BAR = 1e-3
"""Largest acceptable deviation of an estimate from the truth [1]."""

_ROUNDING = 0.3
"""Misfits [half widths] below it are equally good: three decimals give a_wx to a third of a half width."""


def sentences(
    pitch_runs: Sequence[Run],
    joint_runs: Sequence[Run],
    pair: SideBySide,
    differences: Mapping[str, float],
    explained: Sequence[Explanation],
    spreads: Sequence[TorqueSpread],
) -> tuple[str, ...]:
    """Return the sentences; ``differences`` are those in closed loop by model [rad]."""
    return (
        _table_1(pitch_runs),
        _table_2(pitch_runs, joint_runs),
        _figures(pair, differences),
        *_between(explained),
        *_within(pitch_runs, spreads),
    )


def _table_1(runs: Sequence[Run]) -> str:
    parts = []
    for rest_angle, names in ((KNOWN, PITCH), (FREE, (*PITCH, "theta0"))):
        worst = {name: worst_deviation(runs, name, rest_angle) for name in names}
        name = max(worst, key=worst.__getitem__)
        parts.append(f"{100.0 * worst[name]:.2g} % with theta0 {rest_angle} (worst: {name})")
    return f"Table 1: all {len(runs)} pitch runs end within {' and '.join(parts)} of Table 2."


def _table_2(pitch_runs: Sequence[Run], joint_runs: Sequence[Run]) -> str:
    rows = table_2(pitch_runs, joint_runs)
    mean = max(rows, key=lambda row: abs(row.deviation))
    above = [f"{row.name} {100.0 * row.worst:.2g} %" for row in rows if row.worst > BAR]
    single = f"; single runs within {100.0 * BAR:g} %" + (f" but for {', '.join(above)}" if above else "")
    return (
        f"Table 2: from Gamma(0) = {CERTAIN_GAIN:g} on the means are within {100.0 * abs(mean.deviation):.2g} % "
        f"(worst: {mean.name}){single}."
    )


def _figures(pair: SideBySide, differences: Mapping[str, float]) -> str:
    rounding = 2.0 * pi / EncoderCounts().pitch / sqrt(12.0)
    loops = ", ".join(f"{model.replace('_', ' ')} {1e3 * worst:.1f} mrad" for model, worst in differences.items())
    return (
        f"Figure 3: the model of experiment 1 follows experiment 2 to {1e3 * pair.error:.2f} mrad rms (the encoder's "
        f"rounding alone: {1e3 * rounding:.2f} mrad). Figure 4: farthest from the plant in closed loop: {loops}."
    )


def _between(explained: Sequence[Explanation]) -> tuple[str, ...]:
    """Say how well no effect, the best one and the best two explain the paper's Table 1."""
    said = []
    none = next(one for one in explained if not one.effects)
    for count, kind in ((1, "one effect"), (2, "two effects")):
        sized = [one for one in explained if len(one.effects) == count]
        best = [one for one in sized if one.misfit < max(AS_GOOD * sized[0].misfit, _ROUNDING)]
        if best and best[0].misfit * AS_GOOD < none.misfit:
            said.append(
                f"Spread between the paper's experiments: {none.misfit:.2f} half widths without an effect, with {kind} "
                f"{best[0].misfit:.2f} ({best[0].inside} of 6 estimates inside the paper's ranges): "
                f"{'; or '.join(_named(one) for one in best)}."
            )
    return tuple(said) or (f"Spread between the paper's experiments: no effect helps ({none.misfit:.2f} half widths).",)


def _named(one: Explanation) -> str:
    parts = zip(one.effects, one.coefficients, strict=True)
    return " with ".join(f"{effect.name} on {effect.axis}, c = {c:.2g} {effect.unit}" for effect, c in parts)


def _within(runs: Sequence[Run], spreads: Sequence[TorqueSpread]) -> tuple[str, ...]:
    """Say how wide the ranges are with encoders and different starts, and with random torques."""
    found = [[found_range(runs, experiment, name, KNOWN).half_width for name in PITCH] for experiment in EXPERIMENTS]
    said = [
        "Spread within an experiment: encoders, starts, Omega(0) and Gamma(0) make ranges of at most "
        f"{100.0 * np.max(np.array(found) / HALF_WIDTHS):.1f} % of the paper's."
    ]
    if spreads:
        torques = ", ".join(
            f"{one.deviation:.2g} rad/s^2 of {one.correlation_time:g} s memory "
            f"({np.min(one.widths / (2.0 * HALF_WIDTHS)):.1f} to {np.max(one.widths / (2.0 * HALF_WIDTHS)):.1f} times)"
            for one in spreads
        )
        said.append(
            "Spread within an experiment: in geometric mean a random torque makes ranges as wide as the paper's with "
            f"{torques}."
        )
    return tuple(said)
