"""How well an experiment would show an effect, and how well it would separate two.

On the simulated record the signatures of the effects are computed as in a diagnosis: what each would change in the
innovations of a filter that knows plant and air, with the signatures of the fitted parameters projected out. The length
of a signature is the inverse standard error of its coefficient. The separable share of each of two signatures is
sqrt(1 - rho^2) with rho their correlation: each standard error grows by its inverse if both effects are in question.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from heli_identifier.errors import require_range
from heli_identifier.records import Log
from heli_identifier.tracing import (
    DiagnosisSettings,
    Likelihood,
    Model,
    Scores,
    around,
    coordinates_of,
    helicopter,
    records_of,
)
from heli_identifier.workbench.design.rehearsal import (
    STEP,
    ProcessNoise,
    Proposal,
    proposals,
    rehearsed,
    rehearsed_voltages,
)
from heli_plant.effects import Effect
from heli_plant.parameters import PlantParameters

TYPICAL = 2.5
"""Voltage [V] at which gains are slopes: half of full voltage lifts a balanced arm."""


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


@dataclass(frozen=True)
class Outlook:
    """The expected result of one experiment.

    Attributes
    ----------
    proposal : Proposal
    duration : float
        [s].
    visibility : tuple of float
        Share of each effect's signature that the fitted parameters cannot imitate.
    standard_errors : tuple of float
        Of each coefficient, in its unit, if only this effect is added to the model.
    correlation : float
        Of the two signatures, of the shapes that show most; 0 for a single effect.
    largest_pitch, largest_elevation : float
        Largest angle reached [rad].
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


def outlook(
    proposal: Proposal,
    parameters: PlantParameters,
    effects: Sequence[Effect],
    duration: float,
    limits: Limits,
) -> Outlook | None:
    """Simulate one proposal; None where it breaks a limit."""
    signal = rehearsed_voltages(proposal.excitation, duration)
    angles = rehearsed(parameters, signal)
    pitch, elevation = (float(np.abs(angles[:, i]).max()) for i in (0, 1))
    if not np.isfinite(angles).all() or pitch > limits.pitch or elevation > limits.elevation:
        return None
    scores = _scores(Log("rehearsal", 1.0 / STEP, signal, angles), parameters, effects)
    found = scores.scores((), among=[effect.field for effect in effects])
    own = [found[effect.field] for effect in effects]
    G = scores.signatures([score.column for score in own], ())
    rho = G[0, 1] / np.sqrt(G[0, 0] * G[1, 1]) if len(own) > 1 else 0.0
    return Outlook(
        proposal,
        duration,
        tuple(score.visibility for score in own),
        tuple(score.standard_error if score.visibility > 0.0 else np.inf for score in own),
        abs(float(rho)),
        pitch,
        elevation,
    )


def _scores(log: Log, parameters: PlantParameters, effects: Sequence[Effect]) -> Scores:
    """Quadratic form of the likelihood of a rehearsal around the plant without the effects in question."""
    fields, noise = {effect.field for effect in effects}, ProcessNoise()
    rig = helicopter(DiagnosisSettings(), [log.angles], [np.full((1, 2), TYPICAL)])
    rho, c = noise.deviation / (rig.resolution / np.sqrt(12.0)), np.full(len(rig.axes), 1.0 / noise.correlation_time)
    likelihood = Likelihood(rig, records_of((log,), rig, {}))
    off = parameters._replace(**dict.fromkeys(fields, 0.0))
    model = Model(rig, off, coordinates_of(rho, c), rig.resolution / np.sqrt(12.0), likelihood.offset_width)
    base = [name for name in rig.base if name not in fields]
    known = around(likelihood, base, likelihood.resting(off, model.z), model.scales(STEP))
    return Scores(known, [effect for effect in rig.effects if effect.field in fields])


def designs(
    parameters: PlantParameters,
    effects: Sequence[Effect],
    duration: float = 90.0,
    limits: Limits | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> list[Outlook]:
    """Simulate every proposal and rank those within the limits, see :func:`ranked`.

    Parameters
    ----------
    parameters : PlantParameters
        Of the rig.
    effects : sequence of Effect
        One to show, or two to separate.
    duration : float
        Of the experiment [s].
    limits : Limits, optional
    progress : callable, optional
        Called with what is being done and the share that is done.
    """
    limits, progress = limits or Limits(), progress or (lambda what, share: None)
    every, found = list(proposals(limits.voltage)), []
    for count, proposal in enumerate(every):
        progress(f"simulating {count + 1} of {len(every)}", count / len(every))
        one = outlook(proposal, parameters, effects, duration, limits)
        if one is not None:
            found.append(one)
    return ranked(found)


def ranked(outlooks: Sequence[Outlook]) -> list[Outlook]:
    """Sort outlooks, best first.

    The rank is by the larger of the effects' separated standard errors, each relative to the smallest of any outlook.
    """
    if not outlooks:
        return []
    errors = np.array([one.separated_errors for one in outlooks])
    order = np.argsort((errors / errors.min(axis=0)).max(axis=1))
    return [outlooks[i] for i in order]
