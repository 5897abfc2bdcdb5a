"""The excitation that would show an effect, or separate two, within limits of voltage and angle.

The proposals are multisines of three bands, levels and strengths, and the paper's own signals. Each is rehearsed: the
plant is simulated from rest with encoders and a first-order Gauss-Markov torque on each axis. On this record the
signatures of the effects are computed as in a diagnosis: what each would change in the innovations of a filter that
knows plant and air, with the signatures of the fitted parameters projected out. The length of a signature is the
inverse standard error of its coefficient. With rho the correlation of two signatures, each standard error grows by
1 / sqrt(1 - rho^2) if both effects are in question.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import lfilter

from heli_identifier import tracing
from heli_identifier.errors import ConfigurationError, require_range
from heli_identifier.files import write_atomically
from heli_identifier.online.excitation import Excitation, Multisine, paper_channels, voltages
from heli_identifier.records import Log
from heli_identifier.results import Table
from heli_plant.communication import EncoderCounts
from heli_plant.effects import CATALOGUE, Effect
from heli_plant.errors import did_you_mean
from heli_plant.parameters import PlantParameters
from heli_plant.simulation import run_alone
from heli_plant.state import rest_state

Array = NDArray[np.float64]

STEP = 0.01  # sampling period [s]
BANDS = {"slow": (0.03, 0.4), "middle": (0.1, 1.2), "fast": (0.5, 3.0)}  # of the multisines [Hz]

BASES, PAPERS_BASE = (0.0, 0.6, 1.25, 2.5), 1.5
"""Base voltages of each rotor [V], near zero the rotors reverse; that of the paper's signals."""

STRENGTHS = (0.25, 0.6, 1.2)  # root-mean-square values [V] of the signals on the difference and on the sum
TYPICAL = 2.5  # voltage [V] at which gains are slopes: half of full voltage lifts a balanced arm
AIR, AIR_TIME = 0.003, 1.0  # standard deviation [rad/s^2] and correlation time [s] of the random torque on each axis


def air_torque(count: int) -> Array:
    """Draw ``count`` samples of the torque of the air, shape (count, 3), :data:`STEP` apart; the same in every call."""
    kept = float(np.exp(-STEP / AIR_TIME))
    white = np.random.default_rng(0).standard_normal((count, 3)) * AIR * np.sqrt(1.0 - kept * kept)
    return lfilter([1.0], [1.0, -kept], white, axis=0)


def on_encoders(angles: ArrayLike) -> Array:
    """Round angles (..., 3) [rad] to the counts of the encoders."""
    widths = 2.0 * np.pi / np.array(EncoderCounts())
    return np.round(np.asarray(angles) / widths) * widths


@dataclass(frozen=True)
class Limits:
    """Bounds of an experiment: voltage [V] and angles [rad]; the travel is free."""

    voltage: float = 5.0
    pitch: float = 1.2
    elevation: float = 0.8

    def __post_init__(self) -> None:
        require_range("voltage limit", self.voltage, "V", 0.1, 100.0)
        require_range("pitch limit", self.pitch, "rad", 0.01, 100.0)
        require_range("elevation limit", self.elevation, "rad", 0.01, 100.0)


class Proposal(NamedTuple):
    """An excitation in words; in closed loop it is added to the controller's voltages, with steps of references [rad].

    Without an excitation the voltages are zero.
    """

    name: str
    excitation: Excitation | None = None
    pitch_step: float = 0.0
    elevation_step: float = 0.0

    def voltages(self, duration: float) -> Array:
        """Return the voltages (N, 2) [V], sampled every :data:`STEP` for a ``duration`` [s]."""
        count, own = round(duration / STEP), self.excitation
        return np.array([voltages(k * STEP, own) for k in range(count)]) if own else np.zeros((count, 2))


class Outlook(NamedTuple):
    """The expected result of one experiment of a ``duration`` [s].

    ``visibility`` is the share of each effect's signature that the fitted parameters cannot imitate;
    ``standard_errors`` are those of each coefficient if only this effect is added to the model; ``correlation`` is that
    of the two signatures, of the shapes that show most, 0 for a single effect. The largest angles are in [rad].
    """

    proposal: Proposal
    duration: float
    visibility: tuple[float, ...]
    standard_errors: tuple[float, ...]
    correlation: float
    largest_pitch: float
    largest_elevation: float

    @property
    def separated_errors(self) -> tuple[float, ...]:
        """Standard errors if both effects are in question."""
        separable = float(np.sqrt(max(1.0 - self.correlation**2, 1e-12)))
        return tuple(error / separable for error in self.standard_errors)

    def document(self, effects: Sequence[Effect]) -> dict[str, Any]:
        """Give the same for JSON."""
        keys = ("name", "axis", "visibility", "standard_error", "standard_error_separated", "unit")
        each = zip(effects, self.visibility, self.standard_errors, self.separated_errors, strict=True)
        rows = [(own.name, own.axis, *figures, own.unit) for own, *figures in each]
        return {
            "experiment": self.proposal.name,
            "duration_s": self.duration,
            "effects": [dict(zip(keys, row, strict=True)) for row in rows],
            "correlation": self.correlation,
            "largest_pitch_rad": self.largest_pitch,
            "largest_elevation_rad": self.largest_elevation,
        }

    def write_voltages(self, path: Path) -> None:
        """Write time [s], v_front [V], v_rear [V] of the experiment as a CSV file that a rig can play."""
        rows = enumerate(self.proposal.voltages(self.duration))
        lines = ["time [s],v_front [V],v_rear [V]", *(f"{k * STEP:.2f},{one:.5f},{two:.5f}" for k, (one, two) in rows)]
        write_atomically(path, "\n".join(lines) + "\n")


def effects_named(words: Sequence[str]) -> tuple[Effect, ...]:
    """Return the catalogue's entries for words NAME, or NAME:AXIS where the catalogue has the effect on several axes.

    ConfigurationError if a name is unknown (the nearest is proposed), stands for several axes, or twice for one effect.
    """
    found = []
    for word in words:
        name, _, axis = word.partition(":")
        of_name = [entry for entry in CATALOGUE if entry.name == name]
        if not of_name:
            hint = did_you_mean(name, {entry.name for entry in CATALOGUE}) or "; `heli effects` lists them."
            raise ConfigurationError(f"no effect is called {name!r}{hint}")
        fitting = [entry for entry in of_name if axis in ("", entry.axis)]
        if len(fitting) != 1:
            choices = ", ".join(f"{name}:{entry.axis}" for entry in of_name)
            raise ConfigurationError(f"{word!r} is not one entry of the catalogue; choose one of {choices}.")
        found += fitting
    if len(found) == 2 and found[0] == found[1]:
        raise ConfigurationError(f"{words[0]} and {words[1]} are the same effect; two different ones are needed.")
    return tuple(found)


def proposals(limit: float) -> Iterator[Proposal]:
    """Yield the excitations whose base is within plus or minus ``limit`` [V]; their voltages are clipped to it."""
    for experiment in (1, 2) if limit >= PAPERS_BASE else ():
        name = f"the paper's experiment {experiment} on both channels, base {PAPERS_BASE:g} V"
        yield Proposal(name, Excitation(PAPERS_BASE, *paper_channels(experiment, "both"), limit))
    bases = [base for base in BASES if base <= limit]
    for base, on_difference, on_sum, rms in product(bases, BANDS, BANDS, STRENGTHS):
        signals = (
            Multisine(rms, *BANDS[on_difference], period=30.0, seed=1),
            Multisine(rms, *BANDS[on_sum], period=45.0, seed=2),
        )
        bands = f"{on_difference} on v_f - v_r and {on_sum} on v_f + v_r"
        name = f"multisines of {rms:g} V rms, {bands}, base {base:g} V"
        yield Proposal(name, Excitation(base, *signals, limit))


def rehearsed(parameters: PlantParameters, signal: Array) -> Array:
    """Angles (N, 3) [rad] of a rig under ``signal`` (N, 2) [V], from its equilibrium under the first voltages."""
    start = np.array(rest_state(parameters, float(signal[0].sum())), dtype=float)
    return on_encoders(run_alone(signal, STEP, start, parameters, air_torque(len(signal))))


def outlook(
    proposal: Proposal, parameters: PlantParameters, effects: Sequence[Effect], duration: float, limits: Limits
) -> Outlook | None:
    """Simulate one proposal; None where it breaks a limit."""
    signal = proposal.voltages(duration)
    angles = rehearsed(parameters, signal)
    pitch, elevation, _ = np.abs(angles).max(axis=0).tolist()
    if not np.isfinite(angles).all() or pitch > limits.pitch or elevation > limits.elevation:
        return None
    fields = [effect.field for effect in effects]
    # the quadratic form of the likelihood around the plant without the effects in question
    log = Log("rehearsal", 1.0 / STEP, signal, angles)
    rig = tracing.helicopter(tracing.DiagnosisSettings(), [angles], [np.full((1, 2), TYPICAL)])
    rounding = rig.resolution / np.sqrt(12.0)
    likelihood = tracing.Likelihood(rig, tracing.records_of((log,), rig, {}))
    off = parameters._replace(**dict.fromkeys(fields, 0.0))
    air = tracing.coordinates_of(AIR / rounding, np.full(len(rig.axes), 1.0 / AIR_TIME))
    model = tracing.Model(rig, off, air, rounding, likelihood.widths[:3])
    base = [name for name in rig.base if name not in fields]
    known = tracing.around(likelihood, base, likelihood.resting(off, model.z), model.scales(STEP))
    scores = tracing.Scores(known, [effect for effect in rig.effects if effect.field in fields])
    found = scores.scores((), among=fields)
    own = [found[field] for field in fields]
    G = scores.signatures([score.column for score in own], ())
    rho = abs(float(G[0, 1] / np.sqrt(G[0, 0] * G[1, 1]))) if len(own) > 1 else 0.0
    errors = tuple(score.standard_error if score.visibility > 0.0 else np.inf for score in own)
    return Outlook(proposal, duration, tuple(score.visibility for score in own), errors, rho, pitch, elevation)


def designs(
    parameters: PlantParameters,
    effects: Sequence[Effect],
    duration: float,
    limits: Limits,
    progress: Callable[[str, float], None],
) -> list[Outlook]:
    """Simulate every proposal for a ``duration`` [s]; give those within the limits, best first.

    One effect is to be shown, or two are to be separated.
    """
    every, found = list(proposals(limits.voltage)), []
    for count, proposal in enumerate(every):
        progress(f"simulating {count + 1} of {len(every)}", count / len(every))
        if own := outlook(proposal, parameters, effects, duration, limits):
            found.append(own)
    return ranked(found)


def ranked(outlooks: Sequence[Outlook]) -> list[Outlook]:
    """Sort by the larger of the effects' separated standard errors, each relative to the smallest of any outlook."""
    errors = np.array([own.separated_errors for own in outlooks])
    order = np.argsort((errors / errors.min(axis=0)).max(axis=1)) if outlooks else ()
    return [outlooks[i] for i in order]


def experiment_table(outlooks: Sequence[Outlook], effects: Sequence[Effect]) -> Table:
    """Give visibility, separated standard error, correlation, largest angles."""
    columns = [head for one in effects for head in (f"visibility of {one.name}", f"its error [{one.unit}]")]
    rows = []
    for one in outlooks:
        pairs = zip(one.visibility, one.separated_errors, strict=True)
        figures = [text for visible, error in pairs for text in (f"{100.0 * visible:.0f} %", f"{error:.2g}")]
        angles = (f"{angle:.2f} rad" for angle in (one.largest_pitch, one.largest_elevation))
        rows.append((one.proposal.name, *figures, f"{one.correlation:.2f}", *angles))
    heads = ("experiment", *columns, "correlation", "pitch to", "elevation to")
    return Table("Experiments, best first", heads, rows)
