"""LogPlayer: a measured log as a unit; it feeds measured data to the identifier and the plant."""

from __future__ import annotations

from bisect import bisect_right
from typing import ClassVar

from ..errors import Refusal
from ..slave_base import SlaveBase
from ..variables import Variable, real_output, real_parameter, string_parameter
from .log_file import Recording, read_recording
from .signals import AXES, voltage_outputs

_EARLY = 1e-9
"""A row holds from this much before its time [s], because communication points k H have rounding errors."""

_DEPENDS = ("log.path", "log.start")


class LogPlayer(SlaveBase):
    """Shows at each time the log's latest row up to that time; after the end, the last row.

    There is no hidden state: the outputs depend on the parameters and the time only.
    """

    variables: ClassVar[tuple[Variable, ...]] = (
        *(variable._replace(initial_dependencies=_DEPENDS) for variable in voltage_outputs()),
        *(
            real_output(axis, "rad", 1.0, f"measured {axis} angle", _DEPENDS, variability="discrete")
            for axis in AXES
        ),
        string_parameter("log.path", "", "CSV file: time [s], v_front [V], v_rear [V], pitch [rad], ..."),
        real_parameter("log.start", "s", 0.0, 0.0, 1e9, "time in the log, from its first row, at which to start"),
    )  # fmt: skip
    summary = "Plays the voltages and angles of a measured log"
    equations = """
<p>At time t the unit shows row k of the log with the largest time<sub>k</sub> &minus; time<sub>0</sub> &le; t
&minus; t<sub>start</sub> + log.start; after the last row it holds that row. The file is CSV with the header
<code>time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]</code>. Columns may be in any order,
angles may be in <code>[deg]</code>, and further columns are ignored. If the file cannot be played, the reason is logged
and steps are refused.</p>"""
    has_past = False
    source = "The log format of this project"

    recording: Recording | None = None

    def initialise(self, time: float) -> None:
        """Read the log and show its first row."""
        path = self.values[self.references["log.path"]]
        if self.recording is None or self.recording.path != path:
            self.recording = read_recording(path)
        self._show(time)

    def advance(self, time: float, step_size: float) -> None:
        """Show the row of the end of the step."""
        self._show(time + step_size)

    def _show(self, time: float) -> None:
        if self.recording is None:
            raise Refusal("there is no log to play; set log.path before initialisation ends")
        since_first = time - self.start_time + self.values[self.references["log.start"]]
        index = bisect_right(self.recording.times, since_first + _EARLY) - 1
        self.values[:5] = self.recording.rows[max(index, 0)]  # the first five of ``variables``
