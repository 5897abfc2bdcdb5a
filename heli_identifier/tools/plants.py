"""The estimated plant and drawn plants that the data allow, each linearised at its own equilibrium."""

from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from heli_identifier.errors import ConfigurationError, refuse
from heli_identifier.provenance import provenance
from heli_identifier.results import GAIN_OF, ParameterSet, Table, draw_values, sign_notes, to_digits, to_json_value
from heli_identifier.tools.linearisation import NOT_LINEAR, LinearModel, linear_model, linear_system
from heli_identifier.tools.margins import Array, Responses, frequencies, plant_response
from heli_identifier.tracing import Progress
from heli_plant.effects import AXES
from heli_plant.parameters import BY_FIELD, PlantParameters, from_names

SCHEMA = "heli-linear-model/3"  # of linear_model.json
ROUNDING = 1e-9  # largest slope that is due to rounding
FEW = 60  # drawn plants with which the ends of a 95 % interval are known to a tenth of its width


@dataclass(frozen=True, eq=False)
class Plants:
    """The estimated plant at an operating point, and M ``drawn`` plants that the data allow, each at its own point.

    ``notes`` say what the linear model lacks, and how plants were drawn.
    """

    model: LinearModel
    drawn: tuple[LinearModel, ...]
    notes: tuple[str, ...]

    @cached_property
    def omega(self) -> Array:
        """Frequencies (N,) [rad/s]."""
        return frequencies(self.model.sampled.dt)

    @cached_property
    def responses(self) -> Responses:
        """:func:`plant_response` of the estimated and the drawn plants at these frequencies, (M + 1, N, 3, 2)."""
        return np.array([plant_response(linear, self.omega) for linear in (self.model, *self.drawn)])

    @cached_property
    def matrices(self) -> dict[str, Any]:
        """A, B, C, D continuous, F, G sampled every ``period`` [s], names, and 95 % intervals of A and B."""
        model = self.model
        continuous, *drawn = (linear_system(linear.plant, linear.point) for linear in (model, *self.drawn))
        matrices = {
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
            ends = np.quantile([getattr(system, name) for system in drawn], (0.025, 0.975), axis=0)
            matrices[f"{name}_low"], matrices[f"{name}_high"] = ends
        return matrices

    def document(self) -> dict[str, Any]:
        """Return the content of linear_model.json: the matrices by their names."""
        return to_json_value({"schema": SCHEMA, **self.matrices, "notes": self.notes, "provenance": provenance()})

    def table(self) -> Table:
        """Return the slopes of the accelerations and of the motors' lag, with their intervals."""
        m, point = self.matrices, self.model.point
        rows = [
            (f"d {m['states'][i]} / dt", m[of][j], to_digits(m[name][i, j]), " to ".join(map(to_digits, ends)))
            for name, of in (("A", "states"), ("B", "inputs"))
            for i, j in np.argwhere(np.abs(m[name]) > ROUNDING).tolist()
            if i >= len(AXES) and (ends := (m[f"{name}_low"][i, j], m[f"{name}_high"][i, j]))
        ]
        title = f"Slopes at pitch {point.pitch:.3g} rad, elevation {point.elevation:.3g} rad"
        held = f"held by v_front {point.v_front:.3g} V, v_rear {point.v_rear:.3g} V"
        return Table(f"{title}, {held}", ("slope of", "by", "value", "95 % interval"), rows)


def draw_plants(parameters: ParameterSet, count: int) -> list[PlantParameters]:
    """Draw plants that the data allow (:func:`heli_identifier.results.parameters.draw_values`)."""
    return [from_names(parameters.start_values | drawn) for drawn in draw_values(parameters, count)]


def wrong_signs(parameters: ParameterSet) -> tuple[str, ...]:
    """Return notes on gains whose sign is that of no rig."""
    return sign_notes({gain: parameters.values[f"{axis}.gain"] for axis, gain in GAIN_OF.items()})


def allowed_plants(
    parameters: ParameterSet, pitch: float | None, elevation: float, period: float, draws: int, progress: Progress
) -> Plants:
    """Linearise the estimated plant and drawn plants, each at its own equilibrium.

    ConfigurationError if the estimated plant has no equilibrium, or no drawn plant has one.
    """
    model, drawn = linear_model(parameters.plant(), pitch, elevation, period), list[LinearModel]()
    for number, plant in enumerate(draw_plants(parameters, draws)):
        progress("linearising the plants that the data allow", 0.5 * number / draws)
        with suppress(ConfigurationError):
            drawn.append(linear_model(plant, pitch, elevation, period))
    at = f"pitch {model.point.pitch:g} rad, elevation {elevation:g} rad; choose a point nearer to rest."
    refuse(not drawn, f"none of {draws} plants that the data allow has an equilibrium at {at}")
    notes = list(wrong_signs(parameters))
    notes += [
        f"the linear model leaves out {BY_FIELD[field].name}: friction that sticks has no slope at rest"
        for field in NOT_LINEAR
        if getattr(model.plant, field) != 0.0
    ]
    if model.plant.input_delay_rotors:
        notes.append(f"an input delay of {model.plant.input_delay_rotors:.3g} s is in the margins, not in the matrices")
    if parameters.drawn_from_prior:
        notes.append(parameters.drawn_from_prior)
    if missing := draws - len(drawn):
        notes.append(f"{missing} of {draws} plants that the data allow have no equilibrium there")
    return Plants(model, tuple(drawn), tuple(notes))
