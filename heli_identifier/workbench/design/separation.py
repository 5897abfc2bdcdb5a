"""What an experiment would tell: how well it shows an effect, and how well it tells two apart.

On the rehearsed record the signatures of the effects are computed as a diagnosis computes them: whitened, with what the
fitted parameters can imitate projected out. A signature's length is the inverse standard error of its coefficient; the
correlation rho of two signatures says how far one passes for the other. Told apart are they by the part sqrt(1 - rho^2)
that is left of either.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from heli_identifier.tracing import Problem, Scan, candidates, fit, scan, stepping_at
from heli_identifier.workbench.design.excitations import Proposal, proposals
from heli_identifier.workbench.design.rehearsal import Room, rehearsed, rehearsed_voltages
from heli_plant.effects import Effect
from heli_plant.parameters import PlantParameters


@dataclass(frozen=True)
class Limits:
    """What an experiment may not exceed: voltage [V] and angles [rad]; the travel may turn freely."""

    voltage: float = 5.0
    pitch: float = 1.2
    elevation: float = 0.8


@dataclass(frozen=True)
class Outlook:
    """What one experiment would tell.

    Attributes
    ----------
    proposal : Proposal
    duration : float
        [s].
    visibility : tuple of float
        Share of each effect's signature that no fitted parameter can imitate.
    standard_errors : tuple of float
        Of each coefficient, in its unit, if the effect is the only one that is added.
    correlation : float
        Of the two signatures, largest over the shapes tried; 0 for a single effect.
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
        kept = float(np.sqrt(max(1.0 - self.correlation**2, 1e-12)))
        return tuple(error / kept for error in self.standard_errors)


def outlook(
    proposal: Proposal,
    parameters: PlantParameters,
    effects: Sequence[Effect],
    duration: float,
    limits: Limits,
    room: Room,
) -> Outlook | None:
    """Rehearse one proposal; None where it breaks a limit."""
    signal = rehearsed_voltages(proposal.excitation, duration)
    record = rehearsed(parameters, signal, room)
    pitch, elevation = (float(np.abs(record.angles[:, i]).max()) for i in (0, 1))
    if not np.isfinite(record.angles).all() or pitch > limits.pitch or elevation > limits.elevation:
        return None
    here = fit(Problem((record,)), parameters, iterations=0)
    off = parameters._replace(**{effect.field: 0.0 for effect in effects})
    fields = {effect.field for effect in effects}
    moves = [c for c in candidates((record,), off) if c.effect.field in fields]
    if any(effect.name == "moving_mass" for effect in effects):
        moves += stepping_at((duration / 3.0, duration / 2.0), off)
    scanned = scan(here, moves)
    rows = [_rows(scanned, effect) for effect in effects]
    best = [max(own, key=lambda i: -scanned.standard_errors[i]) for own in rows]
    return Outlook(
        proposal,
        duration,
        tuple(float(scanned.visibility[i]) for i in best),
        tuple(float(scanned.standard_errors[i]) for i in best),
        _correlation(scanned, rows),
        pitch,
        elevation,
    )


def _rows(scanned: Scan, effect: Effect) -> list[int]:
    return [i for i, candidate in enumerate(scanned.candidates) if candidate.effect.field == effect.field]


def _correlation(scanned: Scan, rows: Sequence[Sequence[int]]) -> float:
    if len(rows) < 2:
        return 0.0
    return float(np.abs(scanned.directions[:, rows[0]].T @ scanned.directions[:, rows[1]]).max())


def designs(
    parameters: PlantParameters,
    effects: Sequence[Effect],
    duration: float = 90.0,
    limits: Limits | None = None,
    room: Room | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> list[Outlook]:
    """Rehearse every proposal and rank what stays within the limits, best first.

    The rank is by the larger of the effects' separated standard errors, each relative to the best that any proposal
    gives for that effect.
    """
    limits, room, tell = limits or Limits(), room or Room(), progress or (lambda what, share: None)
    every, found = list(proposals(limits.voltage)), []
    for count, proposal in enumerate(every):
        tell(f"rehearsing {count + 1} of {len(every)}", count / len(every))
        one = outlook(proposal, parameters, effects, duration, limits, room)
        if one is not None:
            found.append(one)
    if not found:
        return []
    errors = np.array([one.separated_errors for one in found])
    order = np.argsort((errors / errors.min(axis=0)).max(axis=1))
    return [found[i] for i in order]
