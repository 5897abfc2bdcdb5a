"""Exciter: the paper's test signals and multisines, as a unit."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from heli_identifier.online.excitation import Channel, Excitation, Multisine, SquareChirp, paper_channels, voltages

from ..slave_base import SlaveBase
from ..variables import Variable, parameter, setting
from .signals import VOLTAGE_BOUND, voltage_outputs

EXPERIMENT_1, EXPERIMENT_2, MULTISINE = 1, 2, 3
CHANNELS: tuple[Channel, ...] = ("both", "difference", "total")
_SIGNAL = Multisine()
_multisine = partial(setting, _SIGNAL)
_PARAMETERS = (
    parameter(
        "excitation.experiment", EXPERIMENT_1, "0: none; 1, 2: the paper's experiments; 3: multisines", None, 0, 3
    ),
    parameter("excitation.channel", 0, "0: both; 1: difference of the voltages (pitch); 2: their sum", None, 0, 2),
    parameter("excitation.base", 0.5, "constant part of each voltage", "V", -VOLTAGE_BOUND, VOLTAGE_BOUND),
    parameter("excitation.limit", 5.0, "bound of each voltage", "V", 1e-6, VOLTAGE_BOUND),
    parameter("multisine.rms_difference", _SIGNAL.rms, "root mean square of the difference", "V", 0.0, 20.0),
    parameter("multisine.rms_sum", 2.0 * _SIGNAL.rms, "root mean square of the sum", "V", 0.0, 20.0),
    _multisine("multisine.lowest", "lowest", "lowest frequency", "Hz", 1e-4, 1e3),
    _multisine("multisine.highest", "highest", "highest frequency", "Hz", 1e-4, 1e3),
    _multisine("multisine.period", "period", "time after which the signal repeats", "s", 0.1, 1e5),
    _multisine("multisine.tones", "tones", "number of tones", None, 1, 1000),
    _multisine("multisine.seed", "seed", "seed of the phases; the sum takes the next one", None, 0, 2**31 - 2),
)


class Exciter(SlaveBase):
    """Both voltages are functions of the time since the start; there is no hidden state."""

    variables: ClassVar[tuple[Variable, ...]] = (
        *voltage_outputs(*(variable.name for variable in _PARAMETERS)),
        *_PARAMETERS,
    )
    summary = "Test signals for identification: the paper's square and chirp, random-phase multisines"
    has_past = False

    def initialise(self, time: float) -> None:
        """Make the signal; show its value at the start."""
        experiment, channel = self.value("excitation.experiment"), CHANNELS[self.value("excitation.channel")]
        base, limit = self.value("excitation.base"), self.value("excitation.limit")
        difference: SquareChirp | Multisine | None = None
        total: SquareChirp | Multisine | None = None
        if experiment in (EXPERIMENT_1, EXPERIMENT_2):
            difference, total = paper_channels(experiment, channel)
        if experiment == MULTISINE and channel != "total":
            difference = self.settings(_SIGNAL, rms=self.value("multisine.rms_difference"))
        if experiment == MULTISINE and channel != "difference":
            seed = self.value("multisine.seed") + 1
            total = self.settings(_SIGNAL, rms=self.value("multisine.rms_sum"), seed=seed)
        self.excitation = Excitation(base, difference, total, limit)
        self.show(voltages(0.0, self.excitation))

    def advance(self, time: float, step_size: float) -> None:
        """Show the voltages of the end of the step."""
        self.show(voltages(time + step_size - self.start_time, self.excitation))
