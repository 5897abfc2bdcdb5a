"""StateFeedback: LQR or LQI with a Kalman filter, as a unit."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

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
from ..variables import Variable, setting
from .controller import Controller, controller_variables
from .signals import AXES, ROTORS, VOLTAGE_BOUND

_DEFAULT = FeedbackSettings()
_setting = partial(setting, _DEFAULT)
_MATRICES = {
    "transition": "of the prediction, F",
    "drive": "of the voltages on the prediction, G",
    "innovation": "of the Kalman filter, L",
    "gain": "of the feedback, K",
    "integral": "of the integrals, K_z",
    "reference": "of the references, N",
}
_LARGEST = 1e6


def _entries(matrix: str) -> tuple[Variable, ...]:
    """Return the parameters that are the entries of a matrix."""
    return tuple(
        _setting(
            f"{matrix}.{row}.{column}", f"{matrix}.x{number}.{column}",
            f"entry {_MATRICES[matrix]}: {row.replace('_', ' ')} by {column.replace('_', ' ')}",
            entry_unit(matrix, row, column), -_LARGEST, _LARGEST,
        )
        for number, (row, own) in enumerate(rows_of(getattr(_DEFAULT, matrix)).items())
        for column in own._fields
    )  # fmt: skip


class StateFeedback(Controller):
    """Reads the angles at its sampling instants and shows the resulting voltages one period later."""

    variables: ClassVar[tuple[Variable, ...]] = (
        *controller_variables("hover.{}", "voltage_limit"),
        *(_setting(f"point.{axis}", f"point.{axis}", f"{axis} of the operating point", "rad", -1e4, 1e4)
          for axis in AXES),
        *(_setting(f"hover.{rotor}", f"hover.{rotor}", f"{rotor} voltage there", "V", -VOLTAGE_BOUND, VOLTAGE_BOUND)
          for rotor in ROTORS),
        _setting("sample.time", "period", "sampling period; steps must not be longer", "s", 1e-4, 1.0),
        _setting("sample.delay", "delay", "input delay of the plant in periods", None, 0, MOST_DELAY),
        _setting("travel.enabled", "travel_enabled", "the travel is controlled and not the pitch"),
        _setting("voltage_limit", "voltage_limit", "bound of each voltage", "V", 1e-6, VOLTAGE_BOUND),
        *(entry for matrix in _MATRICES for entry in _entries(matrix)),
    )  # fmt: skip
    hidden = {"held": Held}
    summary = "State feedback with a Kalman filter, of elevation and of travel or pitch: LQR, or LQI with integrals"

    def initialise(self, time: float) -> None:
        """Read the settings; show the voltages of the operating point."""
        super().initialise(time)
        self.feedback = self.settings(_DEFAULT)
        self.held: Held | None = None
        self.show(saturate(voltage, self.feedback.voltage_limit) for voltage in self.feedback.hover)

    def advance(self, time: float, step_size: float) -> None:
        """Read the angles at ``time`` [s]; show the voltages of ``time + step_size``."""
        s = self.feedback
        if step_size > (1.0 + EARLY) * s.period:
            raise Refusal(
                f"a step of {step_size:g} s leaves out samples of sample.time = {s.period:g} s; take steps no longer"
            )
        pitch, elevation, travel, more_front, more_rear = self.values[:5]
        since, references = time - self.start_time, self.references_at(time)
        held = start_holding(pitch, elevation, travel, s) if self.held is None else self.held
        angles, added = Angles(pitch, elevation, travel), Rotors(more_front, more_rear)
        self.held = hold(held, since, step_size, angles, references, added, s)
        self.show((self.held.v_front, self.held.v_rear))
