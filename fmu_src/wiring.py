"""The wiring table: which output feeds which input in each scenario, and where a step of delay lies.

The master steps by Jacobi's scheme, as importers of .ssp files do: at the communication point t_k every input is set
to the value that its source shows at t_k, then all units step from t_k to t_{k+1} = (k + 1) H. The result does not
depend on the order of the units. In every scenario there is:

* **no delay** from Exciter or LogPlayer to the others: their voltages at t_k hold over [t_k, t_{k+1}). The identifier
  takes them with the angles of the same t_k, and shows at t_{k+1} what it knows from the samples up to t_k;
* **one step of delay** in a controller: the voltages that it shows at t_{k+1} follow from the angles of t_k, as those
  of a sampled controller on a rig. Over [t_0, t_1) it gives its trim voltage;
* **one step of delay** in the Corrector: its result from the samples up to t_k corrects the plant from t_{k+1} on.

Before the first step the inputs are set in the same way from the outputs at t_0. One pass is enough, because no output
at t_0 depends on an input.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from os import PathLike
from pathlib import Path

from msgspec import ValidationError, convert

from heli_plant.observer import CORRECTED

from .errors import BuildError, WiringError, check_mapping, is_positive, look_up
from .units.signals import AXES, ROTORS
from .variables import Value

VOLTAGES = ("v_front", "v_rear")

MOST_STEPS = 20_000_000  # communication steps of a run: two days at 100 Hz, with some gigabytes of outputs


@dataclass(frozen=True)
class Scenario:
    """Units, their connections, and parameters that differ from their defaults.

    WiringError says which connection names an unknown unit.
    """

    name: str
    title: str
    units: tuple[tuple[str, str], ...]
    """``("plant", "HelicopterPlant")``."""
    connections: Mapping[str, str]
    """By input the output that feeds it: ``{"plant.v_front": "exciter.v_front"}``."""
    parameters: tuple[tuple[str, Value], ...] = ()
    in_real_time: bool = False
    """Whether the master waits before each step until it is due."""

    def __post_init__(self) -> None:
        try:
            convert(self.units, tuple[tuple[str, str], ...])
            convert(self.connections, dict[str, str])
        except ValidationError as error:
            raise WiringError(f"scenario {self.name}: units or connections have a wrong type: {error}") from error
        for name in (*self.connections, *self.connections.values()):
            self.check_unit(name.partition(".")[0])

    def check_unit(self, name: str) -> None:
        """Refuse a unit that the scenario does not have."""
        look_up(dict(self.units), name, f"unit of scenario {self.name}", WiringError)

    def parameters_by_unit(self, *parameters: Mapping[str, Value]) -> dict[str, dict[str, Value]]:
        """Return the parameters for each unit: the scenario's, replaced by ``parameters`` (``unit.parameter``).

        WiringError names a unit that the scenario does not have.
        """
        given = dict(self.parameters)
        for more in parameters:
            check_mapping("parameters", more)
            given |= more
        by_unit: dict[str, dict[str, Value]] = {name: {} for name, _ in self.units}
        for full_name, value in given.items():
            unit, _, name = full_name.partition(".")
            self.check_unit(unit)
            by_unit[unit][name] = value
        return by_unit

    def unit_files(self, fmus: Mapping[str, str | Path], folder: str | Path, native: bool = False) -> dict[str, Path]:
        """Return the FMU of every unit: the given file, or one built into ``folder``, in C if ``native``.

        WiringError names a unit that the scenario does not have, BuildError a file that does not exist.
        """
        check_mapping("fmus", fmus, (str, PathLike), "files")
        for name, file in fmus.items():
            self.check_unit(name)
            if not Path(file).is_file():
                problem = "is no file" if Path(file).exists() else "is missing"  # a folder or a pipe
                raise BuildError(f"the FMU of {name} {problem}: {file}; correct its path, or give none to build it")
        if dict(self.units).keys() - fmus.keys():
            from .builder import build  # not needed if all FMUs are given
        return {
            name: Path(fmus[name]) if name in fmus else build(unit, folder, native=native) for name, unit in self.units
        }


def _wires(source: str, targets: str, names: Iterable[str], out: str = "{}", into: str = "{}") -> dict[str, str]:
    """Return the wires from the variables ``out`` of a unit to ``into`` of each target; ``{}`` is one of the names."""
    pairs = product(targets.split(), names)
    return {f"{target}.{into.format(name)}": f"{source}.{out.format(name)}" for target, name in pairs}


OPEN_LOOP = Scenario(
    "open_loop",
    "open-loop identification: Exciter -> HelicopterPlant -> AdaptiveIdentifier",
    (("exciter", "Exciter"), ("plant", "HelicopterPlant"), ("identifier", "AdaptiveIdentifier")),
    _wires("exciter", "plant identifier", VOLTAGES) | _wires("plant", "identifier", AXES),
)
CLOSED_LOOP = Scenario(
    "closed_loop",
    "closed loop: Exciter on top of PidController -> HelicopterPlant -> AdaptiveIdentifier",
    (OPEN_LOOP.units[0], ("controller", "PidController"), *OPEN_LOOP.units[1:]),
    _wires("exciter", "controller", ROTORS, "v_{}", "excitation_{}")
    | _wires("controller", "plant identifier", VOLTAGES)
    | _wires("plant", "controller identifier", AXES),
    # The controller has its own trim; the exciter's base voltage would be added to it. Least squares is wrong here.
    (("exciter.excitation.base", 0.0), ("identifier.method", "prediction_error")),
)
STATE_FEEDBACK = replace(
    CLOSED_LOOP,
    name="state_feedback",
    title="the same with LQI and Kalman filter: StateFeedback in place of PidController",
    units=tuple((name, "StateFeedback" if unit == "PidController" else unit) for name, unit in CLOSED_LOOP.units),
)
MEASURED_DATA = Scenario(
    "measured_data",
    "measured data: LogPlayer -> AdaptiveIdentifier, LogPlayer -> HelicopterPlant beside the measurement",
    (("player", "LogPlayer"), ("plant", "HelicopterPlant"), ("identifier", "AdaptiveIdentifier")),
    _wires("player", "plant", VOLTAGES) | _wires("player", "identifier", (*VOLTAGES, *AXES)),
)
PLANT_BESIDE_LOG = Scenario(
    "plant_beside_log",
    "the plant alone under a log's voltages: LogPlayer -> HelicopterPlant",
    (("player", "LogPlayer"), ("plant", "HelicopterPlant")),
    _wires("player", "plant", VOLTAGES),
)
FOLLOW = Scenario(
    "follow",
    "a twin that follows a rig: LogPlayer -> Corrector -> FollowingPlant, and AdaptiveIdentifier beside them",
    (
        ("player", "LogPlayer"),
        ("identifier", "AdaptiveIdentifier"),
        ("corrector", "Corrector"),
        ("plant", "FollowingPlant"),
    ),
    _wires("player", "plant", VOLTAGES)
    | _wires("player", "identifier corrector", (*VOLTAGES, *AXES))
    | _wires("player", "plant", AXES, into="measured.{}")
    | _wires("corrector", "plant", ("observer.bandwidth", *(f"correction.{name}" for name, _ in CORRECTED))),
    (
        ("identifier.method", "prediction_error"),
        ("identifier.adaptation.forgetting", 0.02),
        ("identifier.report.interval", 2.0),
    ),
)
LIVE = Scenario(
    "live",
    "the same of a rig that is running, in real time: RigLink in place of LogPlayer",
    (("rig", "RigLink"), *FOLLOW.units[1:]),
    {
        **{target: source.replace("player.", "rig.") for target, source in FOLLOW.connections.items()},
        "corrector.fresh": "rig.fresh",
        "plant.measured.fresh": "rig.fresh",
    },
    (*FOLLOW.parameters, ("rig.link.wait", 60.0)),
    in_real_time=True,
)  # fmt: skip
SCENARIOS: dict[str, Scenario] = {
    scenario.name: scenario
    for scenario in (OPEN_LOOP, CLOSED_LOOP, STATE_FEEDBACK, MEASURED_DATA, PLANT_BESIDE_LOG, FOLLOW, LIVE)
}


def scenario(name: str | Scenario) -> Scenario:
    """Return a scenario by its name in :data:`SCENARIOS`, or raise WiringError; a Scenario is returned unchanged."""
    return name if isinstance(name, Scenario) else look_up(SCENARIOS, name, "scenario", WiringError)


def whole_steps(duration: float, step: float) -> int:
    """Return the whole number of communication steps of ``step`` [s] in ``duration`` [s], or raise WiringError."""
    if not (is_positive(duration) and is_positive(step) and step <= duration):
        raise WiringError(f"duration = {duration!r} s and step = {step!r} s: 0 < step <= duration is needed")
    if duration / step > MOST_STEPS:
        problem = f"duration = {duration:g} s is {duration / step:.3g} steps of {step:g} s"
        raise WiringError(f"{problem}, at most {MOST_STEPS:g} are run; take a shorter duration or a longer step")
    steps = round(duration / step)
    if abs(steps * step - duration) > 1e-6 * step:
        raise WiringError(f"duration = {duration:g} s is no whole number of steps of {step:g} s; take a multiple")
    return steps
