"""The PID around an identified plant: its margins over every plant that the data allow, and one with better gains.

The retuned PID is the fastest that keeps its margins over all drawn plants. Per loop the gains (P, I, D) minimise the
integrated time-weighted error of a reference step and of a load step of 1 V of the linear closed loop,

    J = sum_k t_k abs(1 - y_k) h + sum_k t_k abs(y_k under the load) h,

subject to a peak of the sensitivity of at most :data:`PEAK` for all drawn plants (Astrom and Hagglund, Advanced PID
Control, 2006, chapters 4 and 7), and to no more gain on encoder noise, P + D/tau, than the present PID has.
"""

import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import savemat
from scipy.optimize import minimize

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import Estimate
from heli_identifier.results import PLANT, ParameterSet, drawn_values, plain
from heli_identifier.tools.linearisation import (
    NOT_LINEAR,
    PERIOD,
    LinearModel,
    OperatingPoint,
    linear_model,
    operating_point,
)
from heli_identifier.tools.loop import (
    LOOPS,
    Margins,
    Responses,
    StepResponse,
    closed_loop,
    controller_response,
    frequencies,
    is_stable,
    loop_gain,
    margins_over,
    plant_response,
    step_response,
    unit_step,
)
from heli_identifier.tracing import Use
from heli_plant.control import AxisGains, PidSettings
from heli_plant.effects import AXES
from heli_plant.parameter_table import BY_FIELD, BY_NAME, PARAMETERS
from heli_plant.parameters import PlantParameters

SCHEMA = "heli-linear-model/1"
CONTROLLER = "PidController"

DRAWS = 60
"""Number of drawn plants: the ends of a 95 % interval are then known to a tenth of its width."""

ROBUST = 30
"""Number of drawn plants for which the retuned PID has to keep its margins."""

PEAK = 1.6
"""Largest peak of the sensitivity: a phase margin of 36 degrees and a gain margin of 2.7 at least."""

HORIZON = 10.0
"""Length [s] of the steps in J."""

UNSTABLE = 1e6
"""Error J [s^2] of a loop that does not settle."""

PENALTY = 50.0
"""On a violated bound: larger than any improvement of a step response."""

_UNITS = {"proportional": "V/rad", "integral": "V/(rad s)", "derivative": "V s/rad"}

Ends = tuple[NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Loop:
    """One PID around the plant.

    ``margins`` are those of the estimated plant by loop; ``low`` and ``high`` are the ends of their 95 % intervals over
    the plants that the data allow; ``stable`` is the share of these plants for which the loop is stable.
    """

    settings: PidSettings
    margins: dict[str, Margins]
    low: dict[str, Margins]
    high: dict[str, Margins]
    stable: float
    steps: tuple[StepResponse, ...]

    @property
    def document(self) -> dict[str, Any]:
        """Gains, margins with intervals, and step responses for a JSON file."""
        return {
            "gains": {axis: getattr(self.settings, axis)._asdict() for axis in LOOPS},
            "trim_V": self.settings.trim,
            "stable_share": self.stable,
            "margins": {
                name: {
                    key: {"value": value, "interval": [getattr(self.low[name], key), getattr(self.high[name], key)]}
                    for key, value in asdict(found).items()
                }
                for name, found in self.margins.items()
            },
            "steps": {
                step.axis: {"size_rad": step.size, "overshoot": step.overshoot, "settling_time_s": step.settling_time}
                for step in self.steps
            },
        }


@dataclass(frozen=True, eq=False)
class PidDesign:
    """A linear model and two PIDs around it.

    Attributes
    ----------
    model : LinearModel
    A_interval, B_interval : (low, high), shapes (n, n), (n, 2)
        95 % intervals of the continuous matrices, entry by entry.
    before, after : Loop
        With the present PID and with the retuned one.
    notes : tuple of str
        What the linear model leaves out.
    """

    model: LinearModel
    A_interval: Ends
    B_interval: Ends
    before: Loop
    after: Loop
    notes: tuple[str, ...]

    def document(self, provenance: Mapping[str, Any]) -> dict[str, Any]:
        """Return the content of linear_model.json; null stands for an infinite value."""
        continuous, sampled = self.model.continuous, self.model.sampled
        return plain(
            {
                "schema": SCHEMA,
                "operating_point": asdict(self.model.point),
                "states": continuous.state_labels,
                "inputs": continuous.input_labels,
                "outputs": continuous.output_labels,
                "input_delay_s": self.model.input_delay,
                "continuous": {key: getattr(continuous, key) for key in "ABCD"},
                "intervals": {
                    "A": {"low": self.A_interval[0], "high": self.A_interval[1]},
                    "B": {"low": self.B_interval[0], "high": self.B_interval[1]},
                },
                "sampled": {"F": sampled.A, "G": sampled.B, "C": sampled.C, "D": sampled.D, "period_s": sampled.dt},
                "loops": {"before": self.before.document, "after": self.after.document},
                "notes": self.notes,
                "provenance": provenance,
            }
        )

    def matlab_bytes(self) -> bytes:
        """Return a MATLAB file: A, B, C, D continuous, F, G sampled every ``period``, intervals of A and B."""
        continuous, sampled, out = self.model.continuous, self.model.sampled, io.BytesIO()
        savemat(
            out,
            {
                **{key: getattr(continuous, key) for key in "ABCD"},
                "F": sampled.A, "G": sampled.B, "period": sampled.dt,
                "A_low": self.A_interval[0], "A_high": self.A_interval[1],
                "B_low": self.B_interval[0], "B_high": self.B_interval[1],
                "states": continuous.state_labels, "inputs": continuous.input_labels,
                "outputs": continuous.output_labels,
                "operating_point": asdict(self.model.point), "input_delay": self.model.input_delay,
            },
        )  # fmt: skip
        return out.getvalue()

    def controller_parameters(self, provenance: Mapping[str, Any]) -> ParameterSet:
        """Return the retuned PID as a parameter set that ``heli build PidController --parameters`` takes."""
        values = pid_values(self.after.settings, self.model.point)
        return ParameterSet(CONTROLLER, values, provenance=provenance)


def pid_values(settings: PidSettings, point: OperatingPoint) -> dict[str, Estimate]:
    """Return gains of pitch and elevation, trim and references as parameters of the PidController."""
    values = {
        f"{axis}.{gain}": Estimate(getattr(getattr(settings, axis), gain), None, unit)
        for axis in LOOPS
        for gain, unit in _UNITS.items()
    }
    values["trim"] = Estimate(settings.trim, None, "V")
    values["reference.pitch"] = Estimate(point.pitch, None, "rad")
    values["reference.elevation"] = Estimate(point.elevation, None, "rad")
    return values


def drawn_plants(parameters: ParameterSet, count: int = DRAWS, seed: int = 0) -> list[PlantParameters]:
    """Draw plants that the data allow (:func:`heli_identifier.results.parameters.drawn_values`)."""
    plant = parameters.plant()
    return [
        plant._replace(**{BY_NAME[name].field: value for name, value in drawn.items()})
        for drawn in drawn_values(parameters, count, seed)
    ]


def design_pid(
    parameters: ParameterSet,
    pitch: float = 0.0,
    elevation: float = 0.0,
    settings: PidSettings | None = None,
    draws: int = DRAWS,
    progress: Callable[[str, float], None] = lambda what, share: None,
) -> PidDesign:
    """Linearise a plant at a pitch and elevation [rad], find the margins of the present PID there, and retune it.

    Raises
    ------
    ConfigurationError
        There is no equilibrium, of the plant or of any plant that the data allow; the motors have no lag; the diagnosis
        calls an axis of a loop not usable; or the parameters are those of another unit than the plant.
    """
    useless = [axis for axis in LOOPS if axis in parameters.axes_for(Use.NOTHING)]
    if useless:
        raise ConfigurationError(
            f"the diagnosis calls the {' and the '.join(useless)} of these parameters not usable, so a loop around it "
            "has no margin that could be trusted; diagnosis.json says why and which flight would change that."
        )
    plant, present = parameters.plant(), settings or PidSettings()
    point = operating_point(plant, pitch, elevation)
    model, models = linear_model(plant, point), []
    for number, one in enumerate(drawn_plants(parameters, draws)):
        progress("linearising the plants that the data allow", 0.6 * number / draws)
        try:
            models.append(linear_model(one, operating_point(one, pitch, elevation)))
        except ConfigurationError:
            continue
    if not models:
        raise ConfigurationError(
            f"none of {draws} plants that the data allow has an equilibrium at pitch {pitch:g} rad, elevation "
            f"{elevation:g} rad; choose a point nearer to rest."
        )
    progress("retuning", 0.6)
    new = retuned(model, present, models[:ROBUST], point.v_front + point.v_rear)
    progress("margins", 0.8)
    omega = frequencies(PERIOD)
    responses = np.array([plant_response(one, omega) for one in (model, *models)])

    def judged(pid: PidSettings) -> Loop:
        """Give the margins of a PID around the plant and, without interpolation, as they may be infinite, quantiles."""
        own, low, high = {}, {}, {}
        for name, found in margins_over(responses, pid, PERIOD, omega).items():
            rows = np.array([list(asdict(one).values()) for one in found[1:]])
            ends = np.quantile(rows, (0.025, 0.975), axis=0, method="nearest").tolist()
            own[name], low[name], high[name] = found[0], Margins(*ends[0]), Margins(*ends[1])
        stable = float(np.mean([is_stable(closed_loop(one, pid)) for one in models]))
        return Loop(pid, own, low, high, stable, tuple(step_response(plant, point, pid, axis) for axis in LOOPS))

    return PidDesign(
        model,
        _interval([one.continuous.A for one in models]),
        _interval([one.continuous.B for one in models]),
        judged(present),
        judged(new),
        _notes(plant, draws, draws - len(models)),
    )


def _interval(matrices: Sequence[NDArray[np.float64]]) -> Ends:
    low, high = np.quantile(matrices, (0.025, 0.975), axis=0)
    return low, high


def _notes(plant: PlantParameters, draws: int, fallen: int) -> tuple[str, ...]:
    notes = [
        f"the linear model leaves out {BY_FIELD[field].name}: friction that sticks has no slope at rest"
        for field in NOT_LINEAR
        if getattr(plant, field) != 0.0
    ]
    if plant.input_delay_rotors:
        notes.append(f"an input delay of {plant.input_delay_rotors:.3g} s is in the margins, not in the matrices")
    if fallen:
        notes.append(f"{fallen} of {draws} plants that the data allow have no equilibrium there")
    return tuple(notes)


def retuned(
    model: LinearModel, settings: PidSettings, others: Sequence[LinearModel] = (), trim: float | None = None
) -> PidSettings:
    """Return the PID with new gains of pitch and elevation, and of the travel where its loop is on.

    Parameters
    ----------
    model : LinearModel
        Of the identified plant.
    settings : PidSettings
        The present PID; everything but the gains of pitch and elevation is kept.
    others : sequence of LinearModel
        Further plants, allowed by the data, for which the margins have to be kept.
    trim : float, optional
        Sum of the voltages [V] at zero error.
    """
    omega = frequencies(model.sampled.dt, 250)
    plants = np.array([plant_response(one, omega) for one in (model, *others)])
    inner = settings._replace(travel_enabled=False)
    for loop in range(len(LOOPS)):
        inner = _tuned(model, plants, omega, inner, loop)
    settings = inner._replace(travel_enabled=settings.travel_enabled)
    if settings.travel_enabled:
        settings = _tuned(model, plants, omega, settings, AXES.index("travel"))
    return settings if trim is None else settings._replace(trim=trim)


def _tuned(
    model: LinearModel, plants: Responses, omega: NDArray[np.float64], settings: PidSettings, loop: int
) -> PidSettings:
    """Return the PID with new gains of one loop; the travel's acts through the pitch's."""
    axis, tau, cut = AXES[loop], settings.rate_time_constant, loop % len(LOOPS)
    present: AxisGains = getattr(settings, axis)
    present = present._replace(integral=present.integral or 1e-3)
    loudest = present.proportional + present.derivative / tau

    def with_gains(gains: list[float]) -> PidSettings:
        changed: dict[str, Any] = {axis: AxisGains(*gains)}
        return settings._replace(**changed)

    def cost(logarithms: NDArray[np.float64]) -> float:
        trial = with_gains(np.exp(logarithms).tolist())
        gains: AxisGains = getattr(trial, axis)
        pid = controller_response(trial, model.sampled.dt, omega)
        peak = float(np.max(1.0 / np.abs(1.0 + loop_gain(plants, pid, cut))))
        noise = (gains.proportional + gains.derivative / tau) / loudest
        return weighted_error(model, trial, loop) + PENALTY * (max(peak / PEAK - 1.0, 0.0) + max(noise - 1.0, 0.0))

    options = {"xatol": 1e-3, "fatol": 1e-4, "maxiter": 250}
    found = minimize(cost, np.log(present), method="Nelder-Mead", options=options)
    return with_gains([float(f"{gain:.4g}") for gain in np.exp(found.x)])


def weighted_error(model: LinearModel, settings: PidSettings, loop: int) -> float:
    """Return the time-weighted error J [s^2] of a linear loop under a unit reference step and a load step of 1 V."""
    period, cut = model.sampled.dt, loop % len(LOOPS)
    horizon = HORIZON if loop == cut else 4.0 * HORIZON  # the travel is that much slower
    closed, steps = closed_loop(model, settings), round(horizon / period)
    weights = np.arange(steps) * period**2
    with np.errstate(over="ignore", invalid="ignore"):
        reference, load = (unit_step(closed, drive, steps)[:, loop] for drive in (loop, 3 + cut))
        error = float(weights @ (np.abs(1.0 - reference) + np.abs(load)))
    return error if np.isfinite(error) and error < UNSTABLE else UNSTABLE


@dataclass(frozen=True)
class Advice:
    """What is to be said about the controller of a changed plant.

    The ``sentence`` is empty and there are no ``gains``, parameters of the PidController, where the margins are kept.
    ``document`` holds the same for JSON, and the peak of each loop's sensitivity with the present gains.
    """

    sentence: str
    document: dict[str, Any]
    gains: ParameterSet | None


def control_advice(
    parameters: PlantParameters,
    standard_errors: Mapping[str, float],
    pitch: float = 0.0,
    elevation: float = 0.0,
    settings: PidSettings | None = None,
) -> Advice:
    """Judge the PID after a change was adopted in flight, and offer gains that would keep its margins.

    They are kept where the upper end of the sensitivity's 95 % interval is at most :data:`PEAK`. Takes some seconds.

    Parameters
    ----------
    parameters : PlantParameters
    standard_errors : mapping
        By structured name, in the parameter's unit; parameters that are not in it keep their value.
    pitch, elevation : float
        Operating point [rad].
    settings : PidSettings, optional
        The present PID.

    Raises
    ------
    ConfigurationError
        There is no equilibrium at this point.
    """
    values = {
        row.name: Estimate(getattr(parameters, row.field), standard_errors.get(row.name) or None, row.unit)
        for row in PARAMETERS
    }
    made = design_pid(ParameterSet(PLANT, values), pitch, elevation, settings)
    now, beyond, peaks = made.before, [], {}
    for axis in LOOPS:
        value, low, high = (one[axis].sensitivity for one in (now.margins, now.low, now.high))
        peaks[axis] = {"value": value, "interval": [low, high]}
        if high > PEAK:
            beyond.append(f"{axis} {value:.2f} ({low:.2f} to {high:.2f})")
    sentence, gains = "", None
    if beyond:
        gains = made.controller_parameters({})
        sentence = (
            "The PID does not keep its margins with the changed plant: peak of the sensitivity on "
            f"{', '.join(beyond)}, stated are at most {PEAK:g}. Gains that would keep them are offered, not applied."
        )
    document = {
        "sentence": sentence,
        "unit": CONTROLLER,
        "gains": gains.start_values if gains else {},
        "largest_sensitivity": PEAK,
        "sensitivity": peaks,
    }
    return Advice(sentence, document, gains)
