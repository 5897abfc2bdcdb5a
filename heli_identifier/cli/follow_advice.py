"""Advice on the controller after a change was adopted in flight: computed beside the loop, offered, never applied."""

import json
from collections.abc import Mapping
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from heli_identifier.errors import ConfigurationError

if TYPE_CHECKING:
    from heli_identifier.tools import Advice
    from heli_plant.control import PidSettings
    from heli_plant.parameters import PlantParameters

ADVICE, GAINS = "control_advice.json", "controller.json"
"""Files: how the margins stand, and the gains that are offered, as parameters of the PidController."""


class Adviser:
    """Judges the controller in a process of its own.

    Parameters
    ----------
    folder : Path
        Where the advice is written.
    settings : PidSettings or None
        The controller that flies the rig; None for that of the project's PidController.
    """

    def __init__(self, folder: Path, settings: "PidSettings | None") -> None:
        self.folder, self.settings = folder, settings
        self.pool: ProcessPoolExecutor | None = None
        self.asked: Future[Advice] | None = None
        self.sentence = ""

    def ask(self, plant: "PlantParameters", errors: Mapping[str, float], elevation: float) -> None:
        """Have the controller judged around a plant; what was asked before and is not begun is dropped."""
        import signal
        from multiprocessing import get_context

        from heli_identifier.cli.guard import bound_to_parent
        from heli_identifier.signals import unheard
        from heli_identifier.tools import control_advice

        if self.asked is not None:
            self.asked.cancel()
        order = partial(control_advice, plant, dict(errors), 0.0, elevation, self.settings)
        with unheard(signal.SIGINT):  # Ctrl-C is for the command
            if self.pool is not None:
                with suppress(BrokenExecutor):  # its process has ended: another one is started
                    self.asked = self.pool.submit(order)
                    return
            self.pool = ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=bound_to_parent)
            self.asked = self.pool.submit(order)

    def look(self, wait: bool = False) -> str:
        """Return what is to be said about the controller now, and write it if it is new.

        Parameters
        ----------
        wait : bool
            Whether to wait for what was asked.
        """
        if self.asked is not None and (wait or self.asked.done()):
            asked, self.asked = self.asked, None
            try:
                advice = asked.result()
            except ConfigurationError as error:
                self.sentence = f"The controller cannot be judged around the changed plant: {error}"
            except BrokenExecutor:
                self.sentence = (
                    "The controller was not judged around the changed plant: the process that does so was ended from "
                    "outside, for want of memory perhaps. `heli linearise` does it afterwards."
                )
            else:
                self.sentence = advice.sentence
                write_advice(advice, self.folder)
        return self.sentence

    def close(self) -> None:
        """End the process; what it was asked is left."""
        if self.pool is not None:
            self.pool.shutdown(wait=False, cancel_futures=True)


def write_advice(advice: "Advice", folder: Path) -> None:
    """Write how the margins stand, and the gains if any are offered."""
    from fmu_src import unit_class
    from heli_identifier.files import write_atomically
    from heli_identifier.online import Estimate
    from heli_identifier.results import ParameterSet, from_command_line

    document = advice.document
    write_atomically(folder / ADVICE, json.dumps(document, indent=1) + "\n")
    if advice.gains:
        units = {variable.name: variable.unit or "1" for variable in unit_class(document["unit"]).variables}
        values = {name: Estimate(value, None, units[name]) for name, value in advice.gains.items()}
        ParameterSet(document["unit"], values, provenance=from_command_line()).write(folder / GAINS)


def controller_of(path: Path | None) -> "PidSettings | None":
    """Return the controller in a parameters.json of the PidController; what it leaves out is the unit's default.

    Raises
    ------
    ConfigurationError
        The file holds parameters of another unit.
    """
    if path is None:
        return None
    from heli_identifier.results import read_parameters
    from heli_identifier.tools import CONTROLLER, pid_settings

    given = read_parameters(path)
    if given.unit != CONTROLLER:
        raise ConfigurationError(f"{path} holds parameters of the {given.unit}, those of the {CONTROLLER} are needed.")
    return pid_settings(given.start_values)
