"""The bench helicopter as a rig: all that the tracer knows of the plant whose logs it reads.

The likelihood, the search and the instruments work with any plant of this form: axes with one angle and one
acceleration each, inputs that are held over a sample, and parameters that enter the accelerations.
docs/howto/another-rig.md brings one.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import copysign, exp, inf, pi
from typing import ClassVar

import numpy as np

from heli_identifier.online import GAINS, ModelParameters
from heli_identifier.records import DiagnosisSettings, Log, highest_voltage
from heli_plant.effects import AXES, BENDING, CATALOGUE, LAG, STEP_TIMES, Effect, effect_of
from heli_plant.laws import motor_input, thrust_voltage
from heli_plant.parameters import BY_FIELD, PlantParameters
from heli_plant.simulation import ALONE, run_accelerations, run_filter, simulate
from heli_plant.tabulated_torque import KNOTS, VARIABLES

from .instruments import Regression
from .motion import (
    LATE,
    Tables,
    arm_readings,
    equation_terms,
    estimate_equations,
    plant_accelerations,
    record_start,
    signals_of,
    state_in_motion,
    thrust_slopes,
)
from .noise import physical
from .rig import Array, Candidate, Coordinate, Record
from .settings import CATALOGUE_WIDTHS, DIFFERENCE, GAIN_WIDTH, PER_LOG, TIMED

LAG_FIELD, DELAY = "motor_lag_rotors", "input_delay_rotors"
BASE = (*ModelParameters._fields, LAG_FIELD)
"""Parameters that every fit estimates: the eleven of Table 2, and the motors' lag beyond T_m."""

WEIGHT = "a_1"
"""Acceleration of the elevation [rad/s^2] by its weight, which the thrust carries at the operating point."""

CURVE = "quadratic_thrust_rotors"
"""Coefficient c of the curve of the thrust: for given slopes the thrust is linear in c/(1 + 2 c v)."""

DRIVEN = tuple(law.field for law in CATALOGUE if "mu_sum" in law.arguments and not {*GAINS} & {*law.arguments})
"""Coefficients of the laws that the sum of the thrusts drives without a gain."""

HORIZONTAL = "horizontal_offset"
"""Shape that all laws with a sine of the elevation share."""

_LINEAR: Mapping[str, tuple[float, float]] = {
    "a_wx": (1.0, 0.0), "a_th": (4.0, -inf), "theta0": (0.5, -0.5 * pi), "a_wz": (1.0, 0.0), "a_e": (4.0, 0.0),
    "a_1": (3.0, -inf), "a_lt": (0.5, -inf), "a_wy": (1.0, 0.0),
}  # fmt: skip
"""Width of the prior around zero, and lower bound: the range of benches. Dampings: a motion does not die out
much faster than in a second. Pitch stiffness g d / l^2: the mass lies within some 2 cm of its axis, l = .2 m.
Elevation: the balanced arm's period is longer than some 3 s, the counterweight leaves a fifth of g / l, l = .6 m."""

LAG_WIDTH = 0.04
"""Width [s] of the prior of the motors' lag about the given one: half of a usual lag."""

_FULL_THRUST: Mapping[str, float] = {"k_x": 3.0, "k_z": 1.0, "k_y": 1.0}
"""Accelerations [rad/s^2] at the voltage limit: half of it on both rotors lifts a balanced arm with about 1 rad/s^2,
the travel turns the same mass, the body's smaller inertia makes the pitch some three times faster."""

_USUAL_AIR = np.array([150.0, 60.0, 30.0])
"""Usual level of the air over the encoder's noise, for pitch, elevation and travel [1/s^2]: measured rigs have torques
of .1, .03, .01 rad/s^2 over .5 to .7 mrad."""


def plausible_range(field: str, voltage_limit: float) -> tuple[float, float]:
    """Return the range that holds 95 % of the prior of a parameter of Table 2, in its unit; a gain has either sign."""
    if field in _FULL_THRUST:
        highest = _FULL_THRUST[field] / voltage_limit * exp(2.0 * GAIN_WIDTH)
        return -highest, highest
    width, lower = _LINEAR[field]
    return max(lower, -2.0 * width), 2.0 * width


_DIFFERENCE: Mapping[str, float] = {"dead_zone": 0.1, "input_delay": 0.01, "motor_lag": 0.01}
"""Finite differences [V], [s] of laws with corners in their coefficient: about a sample, or what logs resolve."""


def _candidate(entry: Effect, lowest: float, settings: DiagnosisSettings) -> Candidate:
    """Entry of the catalogue as the tracer sees it; the ground lies at the ``lowest`` elevation [rad] of the logs."""
    known = settings.horizontal is not None
    estimated = [s for s in entry.shapes if s.estimated or (s.field == HORIZONTAL and not known)]
    grids = {
        s.field: (lowest,) if s.start == "lowest elevation" else s.grid or (s.default,)
        for s in entry.shapes if s.start != STEP_TIMES and not (s.field == HORIZONTAL and known)
    }  # fmt: skip
    starts = tuple(dict(zip(grids, values, strict=True)) for values in product(*grids.values()))
    return Candidate(
        entry.field, entry.name, entry.axis, entry.unit, entry.lower, entry.upper, entry.family,
        tuple(s.field for s in estimated), starts,
        next((s.field for s in entry.shapes if s.start == STEP_TIMES), ""), entry.certain,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Rig:
    """One bench helicopter: what is given of it, its catalogue and its priors."""

    base: tuple[str, ...]
    """Parameters that every fit estimates."""
    parameters: PlantParameters
    """The given values of the plant; :meth:`estimate` overwrites the others."""
    resolution: Array
    """One count of each encoder [rad], shape (3,)."""
    effects: tuple[Candidate, ...]
    """The catalogue; an entry that is among ``base`` is estimated by every fit."""
    operating_point: float
    """Voltage [V] about which the gains are slopes, and at which a_1 is expected to balance the thrust."""
    known: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Centre and width of known priors of effects and gains, by field."""

    axes: ClassVar = AXES
    gains: ClassVar = GAINS
    zero_sensitive: ClassVar = (AXES.index("pitch"),)
    """Axes on which a zero error of the encoder does not act as a constant torque: a lean turns the thrust."""
    carried: ClassVar = (AXES.index("elevation"),)
    """Axes that a table may carry at their lowest angle."""
    positive_gains: ClassVar = GAINS[:2]
    """Gains that are positive on every rig that is wired as its model says."""
    tables: ClassVar = Tables
    filter = staticmethod(run_filter)
    still: ClassVar = ALONE
    accelerations = staticmethod(run_accelerations)
    simulate = staticmethod(lambda *given: simulate(*given)[1])  # the angles
    initial_state = staticmethod(record_start)
    readings = staticmethod(arm_readings)
    state_in_motion = staticmethod(state_in_motion)
    plant_accelerations = staticmethod(plant_accelerations)

    @staticmethod
    def air(z: Array) -> Array:
        """Return :func:`.noise.physical` of the axes' air at its coordinates z (5, 3), or of J airs, z (5, 3 J)."""
        return physical(z, np.resize(_USUAL_AIR, z.shape[1]))

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """Entries of the catalogue that the search may add to the base."""
        return tuple(effect for effect in self.effects if effect.field not in self.base)

    def assign(self, p: PlantParameters, values: Mapping[str, float]) -> PlantParameters:
        """Set parameters as :meth:`read` gives them.

        Parameters that are not among ``values`` keep the value that :meth:`read` gives, also if the curve of the thrust
        changes: gains at zero voltage, coefficients of laws that the thrust drives, and a_1 follow it.
        """
        old = self._slopes(p)
        q = p._replace(**{field: value for field, value in values.items() if field not in (*old, WEIGHT)})
        new = self._slopes(q)
        q = q._replace(**{f: (values[f] if f in values else getattr(p, f) * old[f]) / new[f] for f in new})
        beyond = values[WEIGHT] if WEIGHT in values else self.read(p, WEIGHT)
        return q._replace(**{WEIGHT: self._lift(q) + beyond})

    def read(self, p: PlantParameters, field: str) -> float:
        """Return the value of one parameter as it acts at the operating point.

        For k_x and k_z this is the slope, for k_y and coefficients of laws that the thrust drives the value per volt,
        and for a_1 its difference from the lift, the acceleration [rad/s^2] of the elevation by the thrust.
        """
        if field == WEIGHT:
            return float(p.a_1) - self._lift(p)
        return float(getattr(p, field)) * self._slopes(p).get(field, 1.0)

    def _slopes(self, p: PlantParameters) -> dict[str, float]:
        """Return by which factor gains and coefficients of :data:`DRIVEN` act more than with a linear rotor."""
        slope, share = thrust_slopes(p, self.operating_point)
        driven = (field for field in DRIVEN if field not in self.known)  # a given value is the coefficient of the law
        return dict(zip(GAINS, (slope, slope, share), strict=True)) | dict.fromkeys(driven, share)

    def _lift(self, p: PlantParameters) -> float:
        return 2.0 * float(p.k_z) * thrust_voltage(motor_input(self.operating_point, p), 0.0, p)

    def scale_gains(self, p: PlantParameters, factors: Sequence[float]) -> PlantParameters:
        """Multiply the gains of a plant by ``factors``; a_1 keeps the value that :meth:`read` gives."""
        gains = {field: getattr(p, field) * factor for field, factor in zip(GAINS, factors, strict=True)}
        return p._replace(**gains, **{WEIGHT: p.a_1 + self._lift(p) * (factors[GAINS.index("k_z")] - 1.0)})

    def linear(self, p: PlantParameters) -> tuple[tuple[float, float], ...]:
        """Return damping [1/s] and stiffness [1/s^2] of each axis, for the gains of its filter."""
        return (p.a_wx, p.a_th), (p.a_wz, p.a_e), (p.a_wy, 0.0)

    def coordinate(self, field: str, start: PlantParameters) -> Coordinate:
        """Prior of a parameter; ``start`` has the signs of the gains."""
        if field in _FULL_THRUST:
            sign = copysign(1.0, getattr(start, field))
            centre, width = self.known.get(field, (_FULL_THRUST[field] / start.v_max, GAIN_WIDTH))
            return Coordinate(field, abs(centre), width, sign=sign)
        if field in _LINEAR:
            width, lower = _LINEAR[field]
            upper = 0.5 * pi if field == "theta0" else BY_FIELD[field].maximum  # beyond, a_th changes its sign instead
            return Coordinate(field, 0.0, width, lower, upper)
        if field.startswith("table_torque"):
            axis = field.rpartition("_")[2]
            travel = list(VARIABLES).index("travel") + 1.0
            closes = field == f"table_torque_1_{axis}" and getattr(start, f"table_variable_{axis}") == travel
            return Coordinate(field, 0.0, PER_LOG[0], tied=f"table_torque_{KNOTS}_{axis}" if closes else "")
        if field.startswith("table_first"):  # the table moves onto a notch: within half a spacing, at two widths
            spacing = getattr(start, f"table_spacing_{field.rpartition('_')[2]}")
            return Coordinate(field, getattr(start, field), 0.25 * spacing)
        of_shape = next(((entry, s) for entry in CATALOGUE for s in entry.shapes if s.field == field), None)
        if of_shape is not None:
            owner, shape = of_shape
            bends, centre = owner.place == BENDING, shape.default if field == HORIZONTAL else getattr(start, field)
            if shape.lower > 0.0:  # a scale: its logarithm moves
                return Coordinate(field, centre, GAIN_WIDTH, shape.lower, shape.upper, 1.0, 0.05, in_reading=bends)
            width = shape.difference_step or 0.1 * (shape.upper - shape.lower)
            step = 1.0 if shape.difference_step else DIFFERENCE
            return Coordinate(field, centre, width, shape.lower, shape.upper, step=step)
        entry = effect_of(field)
        lower = max(entry.lower, TIMED - start.T_m) if entry.place == LAG else entry.lower
        usual = LAG_WIDTH if entry.place == LAG else entry.upper / CATALOGUE_WIDTHS
        if field == CURVE and field not in self.known:
            bend = 2.0 * max(self.operating_point, 1.0)
            width = entry.upper / (1.0 + bend * entry.upper)
            return Coordinate(field, 0.0, width, max(entry.lower, -0.5 / bend), entry.upper, bend=bend)
        centre, width = self.known.get(field, (0.0, usual))
        step = _DIFFERENCE.get(entry.name, DIFFERENCE * width) / width
        return Coordinate(field, centre, width, lower, entry.upper, step=step, in_reading=entry.place == BENDING)

    def estimate(self, records: Sequence[Record]) -> PlantParameters:
        """Return a plant that is good enough for the start of a fit."""
        values = estimate_equations(records, self.parameters)
        return self.parameters._replace(**{name: value for name, value in values.items() if name in self.base})

    def regressions(
        self, records: Sequence[Record], parameters: PlantParameters
    ) -> tuple[list[Regression], Iterator[Array]]:
        """Equations of motion for instruments, and their signals (N, 7), record after record.

        The accelerations by effects and tables of the plant count as known. The motors' lag is that of this rig, not
        of the ``parameters``, and its error is one more parameter of every axis: instruments that took the lag from the
        likelihood would confirm a gain that is wrong because of it.
        """
        terms = [(*moving, late) for moving, late in zip(equation_terms(parameters.theta0), LATE, strict=True)]
        of_effects = (*(f"table_variable_{axis}" for axis in AXES), *(law.field for law in CATALOGUE))
        on = [field for field in of_effects if field != LAG_FIELD and getattr(parameters, field)]
        bare = self.assign(parameters, dict.fromkeys(on, 0.0))
        both = (self.plant_accelerations(record, parameters, bare) for record in (records if on else ()))
        known = [whole - without for whole, without in both]
        return [
            Regression(axis, [record.angles[:, i] for record in records], of_axis, [added[:, i] for added in known])
            for i, (axis, of_axis) in enumerate(zip(AXES, terms, strict=True))
        ], (signals_of(record, self.parameters) for record in records)


def helicopter(logs: Sequence[Log], settings: DiagnosisSettings | None = None) -> Rig:
    """Build the rig for logs of one bench helicopter, with its given values.

    The operating point is the median of their voltages' sizes: near hover, however long a log stays at a limit.
    """
    settings, voltages = settings or DiagnosisSettings(), np.concatenate([log.voltages for log in logs])
    given = {name: (value.value, value.standard_error or 0.0) for name, value in settings.effects.items()}
    fixed = {"theta0": settings.rest_pitch, "k_z": settings.elevation_gain, **given}
    lowest = min(float(log.angles[:, 1].min()) for log in logs)
    parameters = PlantParameters(
        **{
            "T_m": settings.motor_time_constant, "v_max": highest_voltage(logs, settings.voltage_limit)[0],
            "theta0": settings.rest_pitch or 0.0, "k_z": settings.elevation_gain or 0.0,
            HORIZONTAL: -(settings.horizontal or 0.0), **{name: value for name, (value, _) in given.items()},
        }
    )  # fmt: skip
    return Rig(
        (*(field for field in BASE if fixed.get(field) is None), *given), parameters,
        2.0 * pi / np.array(settings.counts, dtype=float),
        tuple(_candidate(law, lowest, settings) for law in CATALOGUE if law.field not in given),
        float(np.median(np.abs(voltages))), given | settings.geometry.priors(),
    )  # fmt: skip
