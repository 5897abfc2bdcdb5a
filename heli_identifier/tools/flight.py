"""What to add to a flight under the controller, so that voltages and angles determine the parameters.

Each addition is simulated: the plant under the PID, with encoders, a random torque on every axis and one period of
delay in addition to the input delay. Steps are added to the references of pitch and elevation, or multisines to the
voltages, or nothing. The on-line identifier estimates by prediction errors, and its standard errors judge the addition.
An addition whose angles exceed the limits is left out.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from heli_identifier.errors import refuse
from heli_identifier.online import PREDICTION_ERROR, IdentifierSettings
from heli_identifier.records import Log
from heli_identifier.results import Table
from heli_identifier.tools.experiment import BANDS, STEP, Limits, Proposal, air_torque, multisines, round_to_counts
from heli_identifier.tools.history import identify_log
from heli_identifier.tools.linearisation import operating_point
from heli_identifier.tools.loop import fly
from heli_identifier.tracing import Progress
from heli_plant.control import PidSettings, start_pid
from heli_plant.parameters import PlantParameters
from heli_plant.plant import measured_angles

JUDGED = ("a_th", "k_x", "a_e", "k_z", "k_y")  # stiffnesses and gains, which a loop hides
PERIOD = 6.0  # time between two steps of a reference [s]; those of the elevation come half a period later
STEPS = ((0.05, 0.02), (0.1, 0.05), (0.2, 0.1))  # sizes of the steps of pitch and elevation [rad]
VOLTAGES = (0.1, 0.2, 0.4)  # root-mean-square values of the multisines [V], on the difference and, doubled, on the sum


@dataclass(frozen=True)
class ExpectedFlight:
    """The expected result of one flight: standard error over value of :data:`JUDGED`, and largest deviations [rad]."""

    added: str
    relative_errors: dict[str, float]
    largest_pitch_rad: float
    largest_elevation_rad: float


def list_additions() -> Iterator[Proposal]:
    """Yield what may be added, the smallest excitation first."""
    yield Proposal("nothing")
    for pitch, elevation in STEPS:
        name = f"reference steps of {pitch:g} rad (pitch) and {elevation:g} rad (elevation) every {PERIOD:g} s"
        yield Proposal(name, None, pitch, elevation)
    low, high = BANDS["middle"]
    for rms in VOLTAGES:
        name = f"multisines of {rms:g} V rms on v_f - v_r and {2.0 * rms:g} V on v_f + v_r, {low:g} to {high:g} Hz"
        yield Proposal(name, multisines(0.0, (rms, 2.0 * rms), ("middle", "middle")))


def fly_addition(addition: Proposal, plant: PlantParameters, pid: PidSettings, hover: float, duration: float) -> Log:
    """Simulate one flight at the elevation ``hover`` [rad] and return its log.

    ConfigurationError if the loop is unstable, or the plant cannot hover there within the motors' voltages.
    """
    count = round(duration / STEP)
    phase = np.arange(count) * STEP / PERIOD
    up_and_down = (-1.0) ** np.floor(np.column_stack([phase, phase + 0.5]))
    references = np.zeros((count, 3))
    references[:, :2] = up_and_down * (addition.pitch_step, addition.elevation_step) + (0.0, hover)
    point = operating_point(plant, 0.0, hover)
    pid = pid._replace(trim=point.lift, travel_enabled=False)  # the references are those of pitch and elevation
    state, held = point.state(plant), (point.v_front, point.v_rear)
    memory = start_pid(*round_to_counts(measured_angles(state)).tolist())
    added, air = addition.voltages(duration), air_torque(count)
    with np.errstate(over="ignore", invalid="ignore"):
        angles, used = fly(plant, pid, references, state, held, STEP, memory, added, air, round_to_counts)
    unstable = not np.isfinite(angles).all()
    refuse(unstable, "the loop is unstable with these parameters; give the rig's own controller")
    return Log("rehearsal", 1.0 / STEP, used, angles)


def rank_flights(
    plant: PlantParameters, pid: PidSettings, hover: float, duration: float, limits: Limits, progress: Progress
) -> list[ExpectedFlight]:
    """Simulate all additions for a ``duration`` [s] at the elevation ``hover`` [rad]; return those within the limits.

    They are sorted by their largest relative error. The limit of the elevation is that of its deviation from ``hover``.
    """
    settings = IdentifierSettings(
        sample_time=STEP,
        method=PREDICTION_ERROR,
        motor_time_constant=plant.T_m,
        voltage_limit=pid.voltage_limit,
        report_interval=0.5,
    )
    additions, flights = list(list_additions()), []
    for number, addition in enumerate(additions):
        progress(f"flying: {addition.name}", number / len(additions))
        log = fly_addition(addition, plant, pid, hover, duration)
        if largest := limits.largest_motion(log.angles, hover):
            last = identify_log(log, settings).last
            errors = {name: (last[name].standard_error or 0.0) / max(abs(last[name].value), 1e-9) for name in JUDGED}
            flights.append(ExpectedFlight(addition.name, errors, *largest))
    return sorted(flights, key=lambda flight: max(flight.relative_errors.values()))


def flight_table(flights: list[ExpectedFlight]) -> Table:
    """Return a table of relative errors and deviations."""
    rows = []
    for flight in flights:
        errors = (f"{100.0 * error:.2g} %" if error <= 1.0 else "–" for error in flight.relative_errors.values())
        angles = (f"{angle:.2f} rad" for angle in (flight.largest_pitch_rad, flight.largest_elevation_rad))
        rows.append((flight.added, *errors, *angles))
    columns = ("added to the flight", *JUDGED, "pitch to", "elevation by")
    note = "up to 5 % a parameter is determined: half of its 95 % interval is a tenth of its value"
    return Table("Standard errors of what the loop hides, best first", columns, rows, [note])
