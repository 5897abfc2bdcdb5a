"""StateFeedback: LQR or LQI with a Kalman filter, as a unit."""

from __future__ import annotations

from typing import Any, ClassVar

from heli_plant.control import risen
from heli_plant.motor import saturate
from heli_plant.state_feedback import (
    EARLY,
    MOST_DELAY,
    Angles,
    FeedbackSettings,
    Held,
    Rotors,
    entry_unit,
    hold,
    rows_of,
    start_holding,
)

from ..errors import Refusal
from ..slave_base import SlaveBase
from ..variables import Variable, boolean_parameter, integer_parameter, real_input, real_parameter
from .signals import AXES, VOLTAGE_BOUND, angle_inputs, voltage_outputs

_DEFAULT = FeedbackSettings()
_MATRICES = {
    "transition": "of the prediction, F",
    "drive": "of the voltages on the prediction, G",
    "innovation": "of the Kalman filter, L",
    "gain": "of the feedback, K",
    "integral": "of the integrals, K_z",
    "reference": "of the references, N",
}
_LARGEST = 1e6
_EARLY = 1e-9
"""The reference steps this much before its time [s], because communication points k H have rounding errors."""


def _entries(matrix: str) -> list[tuple[str, str]]:
    """Return rows and columns of a matrix."""
    return [(row, column) for row, own in rows_of(getattr(_DEFAULT, matrix)).items() for column in own._fields]


class StateFeedback(SlaveBase):
    """Reads the angles at its sampling instants and shows the resulting voltages one period later."""

    variables: ClassVar[tuple[Variable, ...]] = (
        *angle_inputs(),
        *(
            real_input(f"excitation_{rotor}", "V", VOLTAGE_BOUND, 1.0, f"added to the {rotor} voltage")
            for rotor in Rotors._fields
        ),
        *(
            variable._replace(initial_dependencies=(f"hover.{rotor}", "voltage_limit"))
            for variable, rotor in zip(voltage_outputs(), Rotors._fields)  # noqa: B905, Python 3.9
        ),
        *(
            real_parameter(f"reference.{axis}", "rad", 0.0, -1e4, 1e4, f"reference of the {axis}", tunable=True)
            for axis in AXES
        ),
        *(
            real_parameter(f"reference.step_{axis}", "rad", 0.0, -1e4, 1e4, f"step of the {axis} reference")
            for axis in AXES
        ),
        real_parameter("reference.step_time", "s", 5.0, 0.0, 1e9, "time of the reference step"),
        *(real_parameter(f"point.{axis}", "rad", 0.0, -1e4, 1e4, f"{axis} of the operating point") for axis in AXES),
        *(
            real_parameter(f"hover.{rotor}", "V", 0.0, -VOLTAGE_BOUND, VOLTAGE_BOUND, f"{rotor} voltage there")
            for rotor in Rotors._fields
        ),
        real_parameter("sample.time", "s", _DEFAULT.period, 1e-4, 1.0, "sampling period; steps must not be longer"),
        integer_parameter("sample.delay", 0, 0, MOST_DELAY, "input delay of the plant in periods"),
        boolean_parameter("travel.enabled", False, "the travel is controlled and not the pitch"),
        real_parameter("voltage_limit", "V", _DEFAULT.voltage_limit, 1e-6, VOLTAGE_BOUND, "bound of each voltage"),
        *(
            real_parameter(
                f"{matrix}.{row}.{column}", entry_unit(matrix, row, column), 0.0, -_LARGEST, _LARGEST,
                f"entry {said}: {row.replace('_', ' ')} by {column.replace('_', ' ')}",
            )
            for matrix, said in _MATRICES.items()
            for row, column in _entries(matrix)
        ),
    )  # fmt: skip
    hidden = {"held": Held}
    summary = "State feedback with a Kalman filter, of elevation and of travel or pitch: LQR, or LQI with integrals"
    equations = """
<pre>
x(k+1) = F x(k) + G u(k-m) + L (y(k) - C x(k))       estimate, from the measured angles y and the voltages u
z(k+1) = z(k) + h (s(k) - r(k))                      integrals of elevation and of travel or pitch
u(k+1) = N r(k) - K x~(k+1) - K_z z(k+1)             x~: the estimate after the m voltages under way
</pre>
<p>Everything counts from point and hover. The voltages follow one period after their angles, within voltage_limit; an
integral stops while it would drive a voltage beyond it. heli design-controller writes the parameters.</p>"""
    source = "K. J. Astrom and B. Wittenmark, Computer-Controlled Systems, 1997, chapters 4 and 11"

    def initialise(self, time: float) -> None:
        """Read the settings; show the voltages of the operating point."""
        value = {name: self.values[reference] for name, reference in self.references.items()}
        matrices: dict[str, Any] = {
            matrix: tuple(
                own._make(value[f"{matrix}.{row}.{column}"] for column in own._fields)
                for row, own in rows_of(getattr(_DEFAULT, matrix)).items()
            )
            for matrix in _MATRICES
        }
        self.settings = FeedbackSettings(
            **matrices,
            point=Angles(*(value[f"point.{axis}"] for axis in AXES)),
            hover=Rotors(*(value[f"hover.{rotor}"] for rotor in Rotors._fields)),
            period=value["sample.time"],
            delay=int(value["sample.delay"]),
            travel_enabled=bool(value["travel.enabled"]),
            voltage_limit=value["voltage_limit"],
        )
        to_pitch, to_elevation, to_travel = (value[f"reference.step_{axis}"] for axis in AXES)
        self.rises = (to_pitch, to_elevation, to_travel)
        self.step_time = value["reference.step_time"] - _EARLY
        self.held: Held | None = None
        limit = self.settings.voltage_limit
        self.values[5:7] = (saturate(voltage, limit) for voltage in self.settings.hover)

    def advance(self, time: float, step_size: float) -> None:
        """Read the angles at ``time`` [s]; show the voltages of ``time + step_size``."""
        s = self.settings
        if step_size > (1.0 + EARLY) * s.period:
            raise Refusal(
                f"a step of {step_size:g} s leaves out samples of sample.time = {s.period:g} s; take steps no longer"
            )
        # in the order of ``variables``: angles, excitation, the two voltages, references
        pitch, elevation, travel, more_front, more_rear, _, _, to_pitch, to_elevation, to_travel = self.values[:10]
        since = time - self.start_time
        references = risen((to_pitch, to_elevation, to_travel), self.rises, since, self.step_time)
        held = start_holding(pitch, elevation, travel, s) if self.held is None else self.held
        angles, added = Angles(pitch, elevation, travel), Rotors(more_front, more_rear)
        self.held = hold(held, since, step_size, angles, references, added, s)
        self.values[5:7] = self.held.v_front, self.held.v_rear
