"""Controllers judged around the estimated plant and around every plant that the data allow, and a design of two.

What a design promises is what :data:`CONFIDENCE` of the plants keep, all figures at once. The margins are those of the
loop with the period between reading and acting and with the input delay.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from math import ceil, inf, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from heli_identifier.provenance import provenance
from heli_identifier.results import to_plain
from heli_identifier.tools import margins
from heli_identifier.tools.linearisation import linear_system
from heli_identifier.tools.loop import Settings, StepResponse, settling_time, step_response
from heli_identifier.tools.margins import LOOPS, Array, Plants
from heli_plant.control import PidSettings
from heli_plant.effects import AXES
from heli_plant.state_feedback import FeedbackSettings

SCHEMA, LINEAR_SCHEMA = "heli-controller/1", "heli-linear-model/2"

CONFIDENCE = 0.95  # share of the plants that keep what is promised
LONGEST = 40.0  # length [s] of the steps whose settling is judged
SHOWN = {"pitch": 12.0, "elevation": 12.0, "travel": 30.0}  # length [s] of the steps that are shown
MARGINS = margins.Margins._fields
UNSTABLE = margins.Margins(gain=1.0, phase=0.0, sensitivity=inf, crossover=nan)  # nothing may change

SMALLER_IS_BETTER = ("sensitivity", "settling")
"""Last part of the names of figures that a good loop has small."""


@dataclass(frozen=True)
class Figure:
    """One figure of a loop: of the estimated plant, with the interval that holds 95 % of the drawn ones.

    ``promised`` is what is kept, ``worst`` that of the worst plant of all, never better than the estimated one's.
    """

    value: float
    interval: tuple[float, float]
    promised: float
    worst: float


@dataclass(frozen=True, eq=False)
class Judged:
    """A controller around the plant and around every plant that the data allow."""

    settings: Settings
    figures: dict[str, Figure]
    """``LOOP.NAME`` with the names of :class:`Margins`; ``disk``, the disk margin at both actuators at once;
    ``AXIS.settling``, the time [s] of a linear reference step."""
    is_stable: bool
    stable: float
    """Whether the loop with the estimated plant is stable; share of the drawn plants for which it is."""
    poles: NDArray[Any]
    """Of the closed loop with the estimated plant [1/s], shape (n,)."""
    disks: Array
    """Disk margin of every plant, shape (M,)."""
    steps: tuple[StepResponse, ...]
    band: dict[str, Array]
    """Steps of the whole plant; lowest and highest response to a unit step among 95 % of the plants, by axis, at the
    times of the steps after 0, shape (2, N)."""

    @property
    def document(self) -> dict[str, Any]:
        """What a JSON file holds of it."""
        own, figures, gains = self.settings, self.figures, {}
        if isinstance(own, PidSettings):
            gains = {"gains": {axis: getattr(own, axis)._asdict() for axis in LOOPS}, "trim_V": own.trim}
        return {
            **gains,
            "stable_share": self.stable,
            "disk_margin": figures["disk"],
            "margins": {loop: {name: figures[f"{loop}.{name}"] for name in MARGINS} for loop in LOOPS},
            "settling_time_s": {step.axis: figures[f"{step.axis}.settling"] for step in self.steps},
            "steps": {
                step.axis: {"size_rad": step.size, "overshoot": step.overshoot, "settling_time_s": step.settling_time}
                for step in self.steps
            },
            "poles": [[pole.real, pole.imag] for pole in self.poles.tolist()],
        }


def judge_controller(plants: Plants, settings: Settings, axes: Sequence[str]) -> Judged:
    """Judge a controller of ``axes`` around the estimated plant and around every drawn one."""
    model, period = plants.model, plants.model.sampled.dt
    loops = [margins.close_loop(one, settings) for one in (model, *plants.drawn)]
    stable = np.array([margins.is_stable(loop) for loop in loops])
    law = margins.controller_response(settings, period, plants.omega)
    columns: dict[str, Array] = {}
    for index, name in enumerate(LOOPS):
        gains = margins.loop_gain(plants.responses, law, index)
        found = np.transpose([
            margins.loop_margins(gain, plants.omega) if is_stable else UNSTABLE
            for gain, is_stable in zip(gains, stable, strict=True)
        ])  # fmt: skip
        columns |= {f"{name}.{own}": column for own, column in zip(MARGINS, found, strict=True)}
    columns["disk"] = np.where(stable, margins.disk_margins(plants.responses, law), 0.0)
    band = {}
    with np.errstate(over="ignore", invalid="ignore"):
        for axis in axes:
            index = AXES.index(axis)
            paths = np.array([margins.unit_step(loop, index, round(LONGEST / period))[:, index] for loop in loops])
            columns[f"{axis}.settling"] = np.array([settling_time(path, period) for path in paths])
            band[axis] = np.quantile(paths[1:, : round(SHOWN[axis] / period)], (0.025, 0.975), axis=0)
    # those of shift registers and of what nothing moves are left out
    z = np.linalg.eigvals(loops[0].A).astype(complex)
    poles = np.log(z[np.abs(z) > 1e-3]) / period
    return Judged(
        settings=settings,
        figures=_figures(columns),
        is_stable=bool(stable[0]),
        stable=float(np.mean(stable[1:])),
        poles=poles[np.abs(poles) > 1e-6],
        disks=columns["disk"][1:],
        steps=tuple(step_response(model, settings, axis, duration=SHOWN[axis]) for axis in axes),
        band=band,
    )


def _figures(columns: Mapping[str, Array]) -> dict[str, Figure]:
    """Figures of columns (M + 1,), that of the estimated plant first."""
    rows = np.column_stack(list(columns.values()))
    sign = np.array([-1.0 if name.endswith(SMALLER_IS_BETTER) else 1.0 for name in columns])
    # as figures may be infinite, quantiles without interpolation
    low, high = np.quantile(rows[1:], (0.025, 0.975), axis=0, method="nearest")
    promised, worst = sign * joint_bounds(sign * rows[1:]), sign * (sign * rows).min(axis=0)
    each = zip(columns, rows[0].tolist(), low.tolist(), high.tolist(), promised.tolist(), worst.tolist(), strict=True)
    return {name: Figure(value, (low, high), kept, least) for name, value, low, high, kept, least in each}


def joint_bounds(figures: Array) -> Array:
    """Return what :data:`CONFIDENCE` of M plants keep of all figures (M, J) at once, shape (J,); larger is better.

    Plants are ranked in every figure; those whose worst rank is lowest are left out, and the least that the others have
    is kept by all of them.

    Source: J. Besag et al., Statistical Science 10 (1995) 3, section 6.3 (simultaneous credible regions from ranks).
    """
    known = np.where(np.isnan(figures), -np.inf, figures)
    worst_rank = rankdata(known, method="max", axis=0).min(axis=1)
    few = len(known) - ceil(CONFIDENCE * len(known))
    return np.asarray(known[np.argsort(worst_rank, kind="stable")[few:]].min(axis=0))


@dataclass(frozen=True, eq=False)
class Design:
    """Two controllers of one kind around an identified plant.

    ``kind`` is pid, lqr or lqi, ``axes`` the controlled angles, ``plants`` those over which both were judged:
    ``baseline`` is what the weights say, or the present PID, ``robust`` the other design, or the retuned PID.
    ``flown`` is what is delivered: the robust one, but of a PID the present gains of loops that are not to be flown as
    they are retuned. ``notes`` are on the plant, the search and these loops; ``continuous`` is the first design in
    continuous time, None of a PID.
    """

    kind: str
    axes: tuple[str, ...]
    plants: Plants
    baseline: Judged
    robust: Judged
    flown: Settings
    notes: tuple[str, ...]
    continuous: FeedbackSettings | None = None

    @property
    def by_name(self) -> dict[str, Judged]:
        """Both controllers by what they are called; the first alone where the other is the same."""
        first, second = ("present", "retuned") if self.kind == "pid" else ("nominal", "robust")
        return {first: self.baseline} | ({second: self.robust} if self.robust is not self.baseline else {})

    def document(self) -> dict[str, Any]:
        """Return the content of design.json; null stands for an infinite value."""
        model, own = self.plants.model, self.continuous
        gains = {"K": own.gain, "K_z": own.integral, "L": own.innovation, "N": own.reference} if own else {}
        return to_plain(
            {
                "schema": SCHEMA,
                "kind": self.kind,
                "axes": self.axes,
                "operating_point": model.point,
                "period_s": model.sampled.dt,
                "input_delay_s": model.plant.input_delay_rotors,
                "plants": len(self.plants.drawn),
                "confidence": CONFIDENCE,
                "nominal": self.baseline.document,
                "robust": self.robust.document,
                "continuous": gains,
                "notes": self.notes,
                "provenance": provenance(),
            }
        )

    def linear_document(self) -> dict[str, Any]:
        """Return the content of linear_model.json: the matrices by their names, and the loops."""
        loops = {"before": self.baseline.document, "after": self.robust.document}
        about = {"notes": self.notes, "provenance": provenance()}
        return to_plain({"schema": LINEAR_SCHEMA, **self.matrices, "loops": loops, **about})

    @cached_property
    def matrices(self) -> dict[str, Any]:
        """A, B, C, D continuous, F, G sampled every ``period`` [s], names, and 95 % intervals of A and B."""
        model = self.plants.model
        continuous, *drawn = (linear_system(one.plant, one.point) for one in (model, *self.plants.drawn))
        found = {
            **{key: getattr(continuous, key) for key in "ABCD"},
            "F": model.sampled.A,
            "G": model.sampled.B,
            "period": model.sampled.dt,
            "states": continuous.state_labels,
            "inputs": continuous.input_labels,
            "outputs": continuous.output_labels,
            "operating_point": asdict(model.point),
            "input_delay": model.plant.input_delay_rotors,
        }
        for name in "AB":
            ends = np.quantile([getattr(one, name) for one in drawn], (0.025, 0.975), axis=0)
            found[f"{name}_low"], found[f"{name}_high"] = ends
        return found
