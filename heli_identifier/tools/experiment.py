"""The excitation that would show an effect, or separate two effects, within limits of voltage and angle.

The proposals are multisines with three bands, base voltages and strengths, and the paper's own signals. Each is
simulated: the plant starts at rest, with encoders and a first-order Gauss-Markov torque on each axis. From this record
the signatures of the effects are computed as in a diagnosis: the signature of an effect is its change of the
innovations of a filter that knows plant and air, with the signatures of the fitted parameters projected out. The length
of a signature is the inverse standard error of its coefficient. If two signatures have the correlation rho and both
effects are in question, each standard error grows by 1 / sqrt(1 - rho^2).
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain, product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import lfilter

from heli_identifier import results, tracing
from heli_identifier.errors import ConfigurationError, refuse
from heli_identifier.files import write_atomically
from heli_identifier.online.excitation import Excitation, Multisine, paper_channels, voltages
from heli_identifier.records import Log
from heli_identifier.results import Table
from heli_identifier.tools.linearisation import operating_point
from heli_plant.communication import EncoderCounts
from heli_plant.effects import CATALOGUE, Effect
from heli_plant.errors import did_you_mean
from heli_plant.parameters import PlantParameters
from heli_plant.simulation import Array, simulate
from heli_plant.state import rest_state

STEP = 0.01  # sampling period [s]
BANDS = {"slow": (0.03, 0.4), "middle": (0.1, 1.2), "fast": (0.5, 3.0)}
"""Of the multisines [Hz]; the middle band lies around the crossover of a controller's loops."""

BASES = (0.0, 0.6, 1.25, 2.5)  # base voltages of each rotor [V]; near zero the rotors reverse
PAPERS_BASE = 1.5  # base voltage of the paper's signals [V]
STRENGTHS = (0.25, 0.6, 1.2)  # root-mean-square values [V] of the signals on the difference and on the sum
TYPICAL = 2.5  # gains are slopes of the thrust at this voltage [V]: half of full voltage lifts a balanced arm
AIR, AIR_TIME = 0.003, 1.0  # standard deviation [rad/s^2] and correlation time [s] of the random torque on each axis


def air_torque(count: int) -> Array:
    """Draw ``count`` samples of the torque of the air, shape (count, 3), :data:`STEP` apart; the same in every call."""
    decay = float(np.exp(-STEP / AIR_TIME))
    white = np.random.default_rng(0).standard_normal((count, 3)) * AIR * np.sqrt(1.0 - decay * decay)
    return lfilter([1.0], [1.0, -decay], white, axis=0)


def round_to_counts(angles: ArrayLike) -> Array:
    """Round angles (..., 3) [rad] to the counts of the encoders."""
    widths = 2.0 * np.pi / np.array(EncoderCounts())
    return np.round(np.asarray(angles) / widths) * widths


@dataclass(frozen=True)
class Limits:
    """Bounds of an experiment: voltage [V] and angles [rad]; the travel is free."""

    voltage: float = 5.0
    pitch: float = 1.2
    elevation: float = 0.8

    def largest_motion(self, angles: Array, hover: float = 0.0) -> tuple[float, float] | None:
        """Return the largest pitch and deviation from the elevation ``hover`` [rad]; None beyond the limits."""
        pitch, elevation, travel = np.abs(angles - (0.0, hover, 0.0)).max(axis=0).tolist()
        within = pitch <= self.pitch and elevation <= self.elevation and np.isfinite(travel)
        return (pitch, elevation) if within else None


class Proposal(NamedTuple):
    """An excitation with its name, and steps of references [rad] for a closed loop; no excitation means zero voltages.

    In closed loop the excitation is added to the controller's voltages.
    """

    name: str
    excitation: Excitation | None = None
    pitch_step: float = 0.0
    elevation_step: float = 0.0

    def voltages(self, duration: float) -> Array:
        """Return the voltages (N, 2) [V], sampled every :data:`STEP` for a ``duration`` [s]."""
        count, signal = round(duration / STEP), self.excitation
        return np.array([voltages(k * STEP, signal) for k in range(count)]) if signal else np.zeros((count, 2))


@dataclass(frozen=True)
class ExpectedEstimate:
    """The expected estimate of one effect's coefficient.

    ``visibility`` is the share of its signature that the fitted parameters cannot imitate. The standard error of its
    coefficient is that for a model with all effects in question.
    """

    name: str
    axis: str
    visibility: float
    standard_error: float
    unit: str


@dataclass(frozen=True)
class ExpectedResult:
    """The expected result of one experiment, with the keys of its JSON.

    ``correlation`` is that of the two signatures, each with the shape that shows most; 0 for a single effect.
    """

    experiment: str
    effects: tuple[ExpectedEstimate, ...]
    correlation: float
    largest_pitch_rad: float
    largest_elevation_rad: float


def find_effects(words: Sequence[str]) -> tuple[Effect, ...]:
    """Return the catalogue's effects for words NAME, or NAME:AXIS if the catalogue has the effect on several axes.

    ConfigurationError if a name is unknown (the nearest one is proposed) or is on several axes, or both words are the
    same effect.
    """
    effects = []
    for word in words:
        name, _, axis = word.replace(".", ":").partition(":")
        of_name = [effect for effect in CATALOGUE if effect.name == name]
        hint = did_you_mean(name, {effect.name for effect in CATALOGUE}) or "; `heli effects` lists them."
        refuse(not of_name, f"no effect is called {name!r}{hint}")
        matches = [effect for effect in of_name if axis in ("", effect.axis)]
        choices = ", ".join(f"{name}:{effect.axis}" for effect in of_name)
        refuse(len(matches) != 1, f"{word!r} is not one entry of the catalogue; choose one of {choices}.")
        effects += matches
    same = len(effects) == 2 and effects[0] == effects[1]
    refuse(same, f"{' and '.join(words)} are the same effect; two different ones are needed.")
    return tuple(effects)


def list_proposals(limit: float, parameters: PlantParameters) -> Iterator[Proposal]:
    """Yield the excitations whose base voltage is at most ``limit`` [V]; their voltages are clipped to it.

    The plant's voltage of hover at elevation zero is a base as well.
    """
    bases = set(BASES)
    with suppress(ConfigurationError):  # it may hover nowhere
        bases.add(round(0.5 * operating_point(parameters).lift, 2))
    for experiment in (1, 2) if limit >= PAPERS_BASE else ():
        name = f"the paper's experiment {experiment} on both channels, base {PAPERS_BASE:g} V"
        yield Proposal(name, Excitation(PAPERS_BASE, *paper_channels(experiment, "both"), limit))
    within = sorted(base for base in bases if 0.0 <= base <= limit)
    for base, *bands, rms in product(within, BANDS, BANDS, STRENGTHS):
        first, second = ("{:g} to {:g} Hz".format(*BANDS[band]) for band in bands)
        name = f"multisines, {rms:g} V rms: {first} on v_f - v_r, {second} on v_f + v_r, base {base:g} V"
        yield Proposal(name, multisines(base, (rms, rms), bands, limit))


def multisines(base: float, rms: tuple[float, float], bands: Sequence[str], limit: float = 5.0) -> Excitation:
    """Return multisines of these strengths [V] on the difference and on the sum, clipped to ``limit`` [V]."""
    on_difference, on_sum = (BANDS[band] for band in bands)
    difference = Multisine(rms[0], *on_difference, period=30.0, seed=1)
    return Excitation(base, difference, Multisine(rms[1], *on_sum, period=45.0, seed=2), limit)


def fly_proposal(
    proposal: Proposal, parameters: PlantParameters, effects: Sequence[Effect], duration: float, limits: Limits
) -> ExpectedResult | None:
    """Simulate one proposal from the equilibrium under its first voltages; None if it breaks a limit."""
    signal, fields = proposal.voltages(duration), [effect.field for effect in effects]
    start = np.array(rest_state(parameters, float(signal[0].sum())), dtype=float)
    angles = round_to_counts(simulate(signal, STEP, start, parameters, air_torque(len(signal)))[1])
    if (largest := limits.largest_motion(angles)) is None:
        return None
    # the quadratic form of the likelihood around the plant without the effects in question
    log = Log("rehearsal", 1.0 / STEP, signal, angles)
    rig = replace(tracing.helicopter([log]), operating_point=TYPICAL)
    rounding = rig.resolution / np.sqrt(12.0)
    likelihood = tracing.Likelihood.of([log], rig)
    without = parameters._replace(**dict.fromkeys(fields, 0.0))
    usual_rates = rig.air(np.zeros((5, len(rig.axes))))[0]
    air = tracing.coordinates_of(AIR / rounding, np.full_like(usual_rates, 1.0 / AIR_TIME), usual_rates)
    model = results.Model(rig, without, air, rounding, likelihood.widths)
    base = [name for name in rig.base if name not in fields]
    quadratic = tracing.known_fit(likelihood, base, likelihood.neutral_point(without, model.z), model.scales(STEP))
    scorer = tracing.Scores(quadratic, [effect for effect in rig.effects if effect.field in fields])
    scores = scorer.scores((), among=fields)
    G = scorer.signatures([scores[field].column for field in fields], ())
    rho = abs(float(G[0, 1] / np.sqrt(G[0, 0] * G[1, 1]))) if len(fields) > 1 else 0.0
    separation, estimates = float(np.sqrt(max(1.0 - rho**2, 1e-12))), []
    for effect in effects:
        score = scores[effect.field]
        error = score.standard_error / separation if score.visibility > 0.0 else np.inf
        estimates.append(ExpectedEstimate(effect.name, effect.axis, score.visibility, error, effect.unit))
    return ExpectedResult(proposal.name, tuple(estimates), rho, *largest)


def rank_proposals(
    parameters: PlantParameters, effects: Sequence[Effect], duration: float, limits: Limits, progress: tracing.Progress
) -> dict[Proposal, ExpectedResult]:
    """Simulate all proposals for one or two effects over a ``duration`` [s]; return those within limits, best first."""
    proposals, expected = list(list_proposals(limits.voltage, parameters)), dict[Proposal, ExpectedResult]()
    for count, proposal in enumerate(proposals):
        progress(f"simulating {count + 1} of {len(proposals)}", count / len(proposals))
        if result := fly_proposal(proposal, parameters, effects, duration, limits):
            expected[proposal] = result
    return rank_results(expected)


def rank_results(expected: Mapping[Proposal, ExpectedResult]) -> dict[Proposal, ExpectedResult]:
    """Sort by the larger of the effects' standard errors, each relative to the smallest of any result."""
    if not expected:
        return {}
    # an effect that no result shows has no influence
    errors = np.array([[estimate.standard_error for estimate in one.effects] for one in expected.values()])
    shown = errors[:, np.isfinite(errors).any(axis=0)]
    order = np.argsort((shown / shown.min(axis=0)).max(axis=1, initial=1.0), kind="stable")
    pairs = [*expected.items()]
    return dict(pairs[i] for i in order)


def write_voltages(proposal: Proposal, duration: float, path: Path) -> None:
    """Write time [s], v_front [V], v_rear [V] of an experiment as a CSV file that a rig can play."""
    rows = (f"{k * STEP:.2f},{front:.5f},{rear:.5f}\n" for k, (front, rear) in enumerate(proposal.voltages(duration)))
    write_atomically(path, "".join(("time [s],v_front [V],v_rear [V]\n", *rows)))


def experiment_table(expected: Sequence[ExpectedResult]) -> Table:
    """Return visibilities, standard errors, correlation and largest angles, with notes that explain them."""
    effects = expected[0].effects
    columns, one_name = list[str](), len({x.name for x in effects}) < len(effects)
    for x in effects:
        columns += [f"visibility of {x.name}{f', {x.axis}' * one_name}", f"its error [{x.unit}]"]
    rows = []
    for result in expected:
        estimates = [(f"{100.0 * x.visibility:.0f} %", f"{x.standard_error:.2g}") for x in result.effects]
        angles = (f"{angle:.2f} rad" for angle in (result.largest_pitch_rad, result.largest_elevation_rad))
        rows.append((result.experiment, *chain(*estimates), f"{result.correlation:.2f}", *angles))
    heads = ("experiment", *columns, "correlation", "pitch to", "elevation to")
    notes = [
        "error: standard error of the coefficient that the experiment would leave; the table is sorted by it",
        "visibility: share of an effect's signature that no change of the fitted parameters could imitate",
        "correlation: of the two signatures; near ±1 the logs cannot tell the effects apart",
    ][: len(effects) + 1]
    return Table("Experiments, best first", heads, rows, notes)
