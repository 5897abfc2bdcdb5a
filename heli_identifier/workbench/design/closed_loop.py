"""What to add to a flight under the controller, so that voltages and angles determine the parameters.

Each proposal is flown in simulation: the plant under the PID, encoders, a random torque on every axis, one period of
delay. It adds steps to the references of pitch and elevation, or multisines to the voltages, or nothing. The on-line
identifier listens with prediction errors, and its own standard errors judge the proposal. A proposal whose angles
depart from the references by more than the limits is left out.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import PREDICTION_ERROR, Estimate, IdentifierSettings, determined
from heli_identifier.online.excitation import Excitation, Multisine, voltages
from heli_identifier.records import Log
from heli_identifier.workbench.design.rehearsal import STEP, ProcessNoise
from heli_identifier.workbench.identify.identification import identify_log
from heli_plant.control import AxisGains, PidSettings, pid_step, start_pid
from heli_plant.encoders import EncoderCounts
from heli_plant.parameters import PlantParameters
from heli_plant.plant import measured_angles, step
from heli_plant.specialised import specialised
from heli_plant.state import rest_state

JUDGED = ("a_th", "k_x", "a_e", "k_z", "k_y")
"""Stiffnesses and gains: what a loop hides."""

_PERIOD = 6.0
"""Time between two steps of a reference [s]; those of the elevation come half of it later."""

_STEPS = ((0.05, 0.02), (0.1, 0.05), (0.2, 0.1))
"""Sizes of the steps of pitch and elevation [rad]."""

_VOLTAGES = (0.1, 0.2, 0.4)
"""Root-mean-square values of the multisines [V], on the difference and, doubled, on the sum."""

_BAND = (0.1, 1.2)
"""Of the multisines [Hz]: around the crossover of the loops."""


@dataclass(frozen=True)
class Addition:
    """What is added: a ``name``, steps of the references [rad], multisines on the voltages."""

    name: str
    pitch_step: float = 0.0
    elevation_step: float = 0.0
    excitation: Excitation | None = None


@dataclass(frozen=True)
class FlightOutlook:
    """The expected result: the ``addition``, ``estimates`` of one flight, and the largest departures [rad]."""

    addition: Addition
    estimates: dict[str, Estimate]
    pitch_departure: float
    elevation_departure: float

    @property
    def relative_errors(self) -> dict[str, float]:
        """Standard error over value of what a loop hides [1]."""
        return {
            name: (self.estimates[name].standard_error or 0.0) / max(abs(self.estimates[name].value), 1e-9)
            for name in JUDGED
        }


def additions() -> Iterator[Addition]:
    """Yield the proposals, the gentlest first."""
    yield Addition("nothing")
    for pitch, elevation in _STEPS:
        yield Addition(
            f"reference steps of {pitch:g} rad (pitch) and {elevation:g} rad (elevation) every {_PERIOD:g} s",
            pitch,
            elevation,
        )
    for rms in _VOLTAGES:
        yield Addition(
            f"multisines of {rms:g} V rms on v_f - v_r and {2.0 * rms:g} V on v_f + v_r, "
            f"{_BAND[0]:g} to {_BAND[1]:g} Hz",
            excitation=Excitation(
                0.0,
                Multisine(rms, *_BAND, period=30.0, seed=1),
                Multisine(2.0 * rms, *_BAND, period=45.0, seed=2),
            ),
        )


def pid_settings(values: Mapping[str, float], voltage_limit: float) -> PidSettings:
    """Return the loops of pitch and elevation from parameters of the PidController unit.

    Parameters
    ----------
    values : mapping
        By structured name, as ``pitch.proportional``; what is missing has its default.
    voltage_limit : float
        Of the plant [V], where the controller has none of its own.
    """
    default = PidSettings()
    pitch, elevation = (
        AxisGains(*(float(values.get(f"{axis}.{name}", gain)) for name, gain in gains._asdict().items()))
        for axis, gains in (("pitch", default.pitch), ("elevation", default.elevation))
    )
    return PidSettings(
        pitch=pitch,
        elevation=elevation,
        rate_time_constant=float(values.get("rate.time_constant", default.rate_time_constant)),
        voltage_limit=float(values.get("voltage_limit", voltage_limit)),
    )


def flown(
    addition: Addition, plant: PlantParameters, pid: PidSettings, hover: float, duration: float, noise: ProcessNoise
) -> tuple[Log, NDArray[np.float64]]:
    """Return the log of one flight at the elevation ``hover`` [rad], and the references (N, 2) [rad]."""
    count = round(duration / STEP)
    random, kept = np.random.default_rng(0), float(np.exp(-STEP / noise.correlation_time))
    white = random.standard_normal((count, 3)) * noise.deviation * np.sqrt(1.0 - kept * kept)
    torque = lfilter([1.0], [1.0, -kept], white, axis=0)
    phase = np.arange(count) * STEP / _PERIOD
    references = np.column_stack(
        [
            addition.pitch_step * (-1.0) ** np.floor(phase),
            hover + addition.elevation_step * (-1.0) ** np.floor(phase + 0.5),
        ]
    )
    widths = 2.0 * np.pi / np.array(EncoderCounts())
    # The thrust that holds the elevation: k_z mu_s = a_e hover + a_1.
    trim = (plant.a_e * hover + plant.a_1) / plant.k_z
    pid = pid._replace(trim=trim)
    advance = specialised(step, plant._asdict())
    state, controller, held = rest_state(plant, trim), None, (0.5 * trim, 0.5 * trim)
    angles, used = np.empty((count, 3)), np.empty((count, 2))
    for k in range(count):
        angles[k] = np.round(np.array(measured_angles(state)) / widths) * widths
        pitch, elevation, travel = angles[k].tolist()
        controller = controller or start_pid(pitch, elevation, travel)
        added = voltages(k * STEP, addition.excitation) if addition.excitation is not None else (0.0, 0.0)
        used[k] = np.clip([held[0] + added[0], held[1] + added[1]], -pid.voltage_limit, pid.voltage_limit)
        wanted = float(references[k, 0]), float(references[k, 1]), 0.0
        controller, held = pid_step(controller, pitch, elevation, travel, wanted, STEP, pid)
        moved = advance(state, *used[k].tolist(), 0.0, k * STEP, STEP, plant)
        push = torque[k]
        state = moved._replace(
            pitch_rate=moved.pitch_rate + STEP * push[0],
            elevation_rate=moved.elevation_rate + STEP * push[1],
            travel_rate=moved.travel_rate + STEP * push[2],
        )
        if not np.isfinite(angles[k]).all():
            raise ConfigurationError("the loop is unstable with these parameters; give the rig's own controller")
    return Log("rehearsal", 1.0 / STEP, used, angles), references


def flight_outlooks(
    plant: PlantParameters,
    pid: PidSettings,
    hover: float,
    duration: float,
    departure: tuple[float, float],
    progress: Callable[[str, float], None] | None = None,
) -> list[FlightOutlook]:
    """Fly all additions; return those within the limits, the one with the least largest relative error first.

    Parameters
    ----------
    plant : PlantParameters
    pid : PidSettings
    hover : float
        Elevation that is held [rad].
    duration : float
        Of a flight [s].
    departure : tuple of float
        Largest departure of pitch and elevation from what is flown without an addition [rad].
    progress : callable, optional
        Called with what is being done and the share that is done.
    """
    proposals, found = list(additions()), []
    for number, addition in enumerate(proposals):
        if progress is not None:
            progress(f"flying: {addition.name}", number / len(proposals))
        log, _ = flown(addition, plant, pid, hover, duration, ProcessNoise())
        settings = IdentifierSettings(
            sample_time=STEP,
            method=PREDICTION_ERROR,
            motor_time_constant=plant.T_m,
            voltage_limit=pid.voltage_limit,
            report_interval=0.5,
        )
        pitch = float(np.abs(log.angles[:, 0]).max())
        elevation = float(np.abs(log.angles[:, 1] - hover).max())
        if pitch <= departure[0] and elevation <= departure[1]:
            found.append(FlightOutlook(addition, identify_log(log, settings).last, pitch, elevation))
    return sorted(found, key=lambda one: max(one.relative_errors.values()))


def flight_rows(outlooks: list[FlightOutlook]) -> tuple[list[str], list[list[str]]]:
    """Return columns and rows of a table: relative errors and departures."""
    columns = ["added to the flight", *(f"{name}>" for name in JUDGED), "pitch to>", "elevation by>"]
    rows = [
        [
            one.addition.name,
            *(_percent(error) for error in one.relative_errors.values()),
            f"{one.pitch_departure:.2f} rad",
            f"{one.elevation_departure:.2f} rad",
        ]
        for one in outlooks
    ]
    return columns, rows


def flight_documents(outlooks: list[FlightOutlook]) -> list[dict[str, Any]]:
    """Return outlooks as JSON documents."""
    return [
        {
            "added": one.addition.name,
            "relative_errors": one.relative_errors,
            "pitch_to_rad": one.pitch_departure,
            "elevation_by_rad": one.elevation_departure,
        }
        for one in outlooks
    ]


def _percent(share: float) -> str:
    if share > 1.0:
        return "not determined"
    return f"{100.0 * share:.2g} %" + ("" if determined(1.0, share, "") else ", not determined")
