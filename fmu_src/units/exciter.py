"""Exciter: the paper's test signals and multisines, as a unit."""

from __future__ import annotations

from typing import ClassVar

from heli_identifier.errors import ConfigurationError
from heli_identifier.online.excitation import Channel, Excitation, Multisine, paper_excitation, voltages

from ..errors import Refusal
from ..slave_base import SlaveBase
from ..variables import Variable, integer_parameter, real_parameter
from .signals import PAPER, VOLTAGE_BOUND, voltage_outputs

NONE, EXPERIMENT_1, EXPERIMENT_2, MULTISINE = 0, 1, 2, 3
CHANNELS: tuple[Channel, ...] = ("both", "difference", "total")
_SIGNAL = Multisine()
_PARAMETERS = (
    integer_parameter(
        "excitation.experiment", EXPERIMENT_1, NONE, MULTISINE, "0: none; 1, 2: the paper's experiments; 3: multisines"
    ),
    integer_parameter("excitation.channel", 0, 0, 2, "0: both; 1: difference of the voltages (pitch); 2: their sum"),
    real_parameter("excitation.base", "V", 0.5, -VOLTAGE_BOUND, VOLTAGE_BOUND, "constant part of each voltage"),
    real_parameter("excitation.limit", "V", 5.0, 1e-6, VOLTAGE_BOUND, "bound of each voltage"),
    real_parameter("multisine.rms_difference", "V", _SIGNAL.rms, 0.0, 20.0, "root mean square of the difference"),
    real_parameter("multisine.rms_sum", "V", 2.0 * _SIGNAL.rms, 0.0, 20.0, "root mean square of the sum"),
    real_parameter("multisine.lowest", "Hz", _SIGNAL.lowest, 1e-4, 1e3, "lowest frequency"),
    real_parameter("multisine.highest", "Hz", _SIGNAL.highest, 1e-4, 1e3, "highest frequency"),
    real_parameter("multisine.period", "s", _SIGNAL.period, 0.1, 1e5, "time after which the signal repeats"),
    integer_parameter("multisine.tones", _SIGNAL.tones, 1, 1000, "number of tones"),
    integer_parameter("multisine.seed", _SIGNAL.seed, 0, 2**31 - 2, "seed of the phases; the sum takes the next one"),
)


class Exciter(SlaveBase):
    """Both voltages as a function of the time since the start; there is no hidden state."""

    variables: ClassVar[tuple[Variable, ...]] = (
        *(
            variable._replace(initial_dependencies=tuple(parameter.name for parameter in _PARAMETERS))
            for variable in voltage_outputs()
        ),
        *_PARAMETERS,
    )
    summary = "Test signals for identification: the paper's square and chirp, random-phase multisines"
    equations = """
<pre>
v_front - v_rear = u_d(t),  v_front + v_rear = 2 base + u_s(t)
</pre>
<p>Experiment 1: a square between .25 and 1 V with a period of 20 s plus a chirp of .2 V from 2 down to .5 Hz repeated
every 10 s; experiment 2 has twice the periods. On the sum (elevation and travel) the voltages are doubled; if both
channels are excited, the periods of the difference are multiplied by .77. Multisines: tones of equal amplitude,
log-spaced on the harmonics of one period, with the random phases of least crest factor.</p>"""
    has_past = False
    source = f"{PAPER}, experiments; Pintelon and Schoukens, System Identification, 2nd ed. 2012, section 2.3"

    def initialise(self, time: float) -> None:
        """Make the signal; show its value at the start."""
        try:
            self.excitation = self._excitation()
        except ConfigurationError as problem:
            raise Refusal(str(problem)) from problem
        self._show(0.0)

    def _excitation(self) -> Excitation:
        at, values = self.references, self.values
        experiment = values[at["excitation.experiment"]]
        channel = CHANNELS[values[at["excitation.channel"]]]
        base, limit = values[at["excitation.base"]], values[at["excitation.limit"]]
        if experiment in (EXPERIMENT_1, EXPERIMENT_2):
            paper = paper_excitation(experiment, channel, base)
            return Excitation(base, paper.difference, paper.total, limit)
        if experiment == NONE:
            return Excitation(base, None, None, limit)
        lowest, highest, period = (values[at[f"multisine.{name}"]] for name in ("lowest", "highest", "period"))
        tones, seed = values[at["multisine.tones"]], values[at["multisine.seed"]]
        difference = Multisine(values[at["multisine.rms_difference"]], lowest, highest, tones, period, seed)
        total = Multisine(values[at["multisine.rms_sum"]], lowest, highest, tones, period, seed + 1)
        return Excitation(
            base, None if channel == "total" else difference, None if channel == "difference" else total, limit
        )

    def advance(self, time: float, step_size: float) -> None:
        """Show the voltages of the end of the step."""
        self._show(time + step_size - self.start_time)

    def _show(self, time: float) -> None:
        self.values[:2] = voltages(time, self.excitation)  # the first two of ``variables``
