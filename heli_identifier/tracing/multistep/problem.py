"""The multi-step problem of one rig: records in, errors and their sensitivities out.

With x the common coordinates and o_l the offsets of log l (a constant torque on each axis and the zero of the pitch's
encoder), e_l(x, o_l) are the errors of :mod:`heli_identifier.tracing.multistep.horizons`. The elevation's zero shifts
its rest angle and so acts as its constant torque does; the travel's zero acts on nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate
from heli_identifier.tracing.multistep.horizons import APART, HORIZONS, Starts, horizon_errors
from heli_identifier.tracing.multistep.priors import Coordinate
from heli_identifier.tracing.prediction.fit import difference_step
from heli_identifier.tracing.prediction.workers import parallel
from heli_plant.parameters import PlantParameters

OFFSETS = ("constant_torque_pitch", "a_1", "constant_torque_travel", "pitch_zero")
"""What may differ from log to log: fields of the plant, and the zero of the pitch's encoder."""

OFFSET_WIDTHS = (0.02, 0.02, 0.02, 0.005)
"""Widths of the offsets before any log is seen [rad/s^2, rad]: a cable that lies otherwise, some encoder counts."""

PIECE = 5.0
"""Length [s] of the pieces that count as independent: longer than the longest horizon and the smoother's window."""

Arrays = list[NDArray[np.float64]]
"""One array for each record."""


@dataclass(frozen=True, eq=False)
class Multistep:
    """Records of one rig, prepared for fits by multi-step errors.

    Attributes
    ----------
    records : tuple of Starts
    base : PlantParameters
        Values of everything that is not fitted.
    expected : mapping of str to Estimate
        Effects that theory demands, by the field of their coefficient: the centre and width of its prior.
    """

    records: tuple[Starts, ...]
    base: PlantParameters
    expected: Mapping[str, Estimate] = field(default_factory=dict)

    def parameters(self, fields: Sequence[Coordinate], x: NDArray[np.float64]) -> PlantParameters:
        """Parameter set at the coordinates ``x``; gains keep their sign."""
        return self.base._replace(**{c.field: c.value(float(v)) for c, v in zip(fields, x, strict=True)})

    def errors(self, parameters: PlantParameters, offsets: NDArray[np.float64]) -> Arrays:
        """Errors (S_l, 3, 3) [rad] of every record under offsets (L, 4); zero where nothing was measured."""
        return self.errors_of([(parameters, offsets)])[0]

    def errors_of(self, cases: Sequence[tuple[PlantParameters, NDArray[np.float64]]]) -> list[Arrays]:
        """:meth:`errors` of many parameter sets and offsets, on all threads."""
        count = len(self.records)
        jobs = [(log, parameters, offsets[log]) for parameters, offsets in cases for log in range(count)]
        done = parallel(lambda job: self._errors(*job), jobs)
        return [done[i * count : (i + 1) * count] for i in range(len(cases))]

    def _errors(self, log: int, parameters: PlantParameters, offsets: NDArray[np.float64]) -> NDArray[np.float64]:
        starts = self.records[log]
        moved = {name: getattr(parameters, name) + float(o) for name, o in zip(OFFSETS[:3], offsets, strict=False)}
        errors = horizon_errors(starts, parameters._replace(**moved), float(offsets[3]))
        errors[np.isnan(starts.measured)] = 0.0
        return errors

    def sensitivities(
        self, fields: Sequence[Coordinate], x: NDArray[np.float64], offsets: NDArray[np.float64], at: Arrays
    ) -> Arrays:
        """Give the derivatives of the errors by coordinates and offsets, (S_l, 3, 3, P + 4), the offsets behind.

        ``at`` holds the errors at ``x`` and ``offsets``.
        """
        parameters, names = self.parameters(fields, x), [c.field for c in fields]
        moves, sizes, apart = [], [], [number for number, name in enumerate(OFFSETS) if name not in names]
        for number in apart:
            moved = offsets.copy()
            moved[:, number] += 0.1 * OFFSET_WIDTHS[number]
            moves.append((parameters, moved))
            sizes.append(0.1 * OFFSET_WIDTHS[number])
        by_offsets = self._differences(moves, sizes, at)
        joined = []
        for own, rest in zip(self.by_coordinates(fields, x, offsets, at), by_offsets, strict=True):
            # an offset of a field that is fitted acts as the field does
            columns = [
                rest[..., apart.index(number)]
                if number in apart
                else own[..., names.index(name)] / fields[names.index(name)].slope(getattr(parameters, name))
                for number, name in enumerate(OFFSETS)
            ]
            joined.append(np.concatenate((own, np.stack(columns, axis=-1)), axis=-1))
        return joined

    def by_coordinates(
        self, fields: Sequence[Coordinate], x: NDArray[np.float64], offsets: NDArray[np.float64], at: Arrays
    ) -> Arrays:
        """Give the derivatives (S_l, 3, 3, P) of the errors by coordinates alone.

        Forward differences, backward where a bound is in the way.
        """
        parameters, cases, sizes = self.parameters(fields, x), [], []
        for c in fields:
            value = getattr(parameters, c.field)
            size = difference_step(c.field, value)
            if value + size > c.upper:
                size = -size
            cases.append((parameters._replace(**{c.field: value + size}), offsets))
            sizes.append(size / c.slope(value))
        return self._differences(cases, sizes, at)

    def _differences(
        self, cases: Sequence[tuple[PlantParameters, NDArray[np.float64]]], sizes: Sequence[float], at: Arrays
    ) -> Arrays:
        """Differences (S_l, 3, 3, C) between the errors of some cases and those ``at``, over the cases' ``sizes``."""
        if not cases:
            return [np.empty((*own.shape, 0)) for own in at]
        columns = [
            np.stack([(moved - own) / size for moved, size in zip(of_record, sizes, strict=True)], axis=-1)
            for own, of_record in zip(at, zip(*self.errors_of(cases), strict=True), strict=True)
        ]
        # a prediction that diverges under the small change says nothing about the slope
        return [np.where(np.isfinite(column), column, 0.0) for column in columns]

    def pieces(self) -> list[NDArray[np.intp]]:
        """Give the number of the piece of :data:`PIECE` seconds that each start lies in, one array a record."""
        labels, first = [], 0
        for starts in self.records:
            count = max(1, round(len(starts.at) * APART / PIECE))
            labels.append(first + np.arange(len(starts.at)) * count // len(starts.at))
            first += count
        return labels


def overlap_weights() -> NDArray[np.float64]:
    """Share (3,) of an independent observation that one start's error at each horizon is worth.

    Starts lie no farther apart than their horizons, so that each is worth APART / H; horizons are views of one motion.
    """
    return APART / np.array(HORIZONS) / len(HORIZONS)
