"""RigLink: a rig that is running, as a unit; its samples come in by UDP."""

from __future__ import annotations

from select import select
from time import monotonic
from typing import Any, ClassVar

from pythonfmu.enums import Fmi2Status

from heli_identifier.errors import ConfigurationError
from heli_identifier.live import (
    USUAL_LAYOUT,
    Clock,
    ClockSettings,
    Port,
    read_layout,
    restart,
    tick,
    time_sample,
)

from ..errors import Refusal
from ..slave_base import SlaveBase
from ..variables import Variable, integer_parameter, real_output, real_parameter, string_parameter
from .signals import AXES, voltage_outputs

_SHOWN = 5
"""Two voltages and three angles, the first of ``variables``; the outputs about the link follow them."""


def _output(name: str, unit: str, description: str) -> Variable:
    return real_output(name, unit, None, description, variability="discrete")


class RigLink(SlaveBase):
    """Shows the rig's latest sample up to each time; no step waits for the network.

    The socket opens when the initialisation ends or outputs are read before, and closes with the unit.
    """

    variables: ClassVar[tuple[Variable, ...]] = (
        *voltage_outputs(),
        *(real_output(axis, "rad", 1.0, f"measured {axis} angle", variability="discrete") for axis in AXES),
        _output("fresh", "1", "1: the step brought the sample that was due, 0: none, or a late one"),
        _output("watchdog", "1", "1: there is no sample yet, or the one shown is older than link.maximum_age, else 0"),
        _output("age", "s", "age of the sample shown, beyond link.delay"),
        _output("lead", "s", "how far the co-simulation runs ahead of the rig; below 0 it runs behind"),
        _output("waiting", "1", "samples that have come in and are not due yet"),
        _output("received", "1", "samples that were taken"),
        _output("lost", "1", "samples that did not come in"),
        _output("reordered", "1", "samples that came after a later one, and in time"),
        _output("late", "1", "samples that came after a later one had been due; not shown"),
        _output("duplicated", "1", "samples that came twice"),
        _output("stray", "1", "samples more than 1 s from the others that no second one continued; not shown"),
        _output("refused", "1", "datagrams that hold no sample: a wrong length, a value that no rig reaches"),
        _output("foreign", "1", "datagrams of other senders; not read"),
        _output("set_anew", "1", "times that the rig's clock was set anew"),
        _output("port", "1", "port on which datagrams come in")._replace(
            initial_dependencies=("link.address", "link.port")
        ),
        string_parameter("link.address", "127.0.0.1", "numeric address of this machine on which datagrams come in"),
        integer_parameter("link.port", 25000, 0, 65535, "port on which they come in; 0: a free one, see port"),
        string_parameter("link.sender", "", "the rig, HOST:PORT or HOST (any port); empty: the first good sender"),
        string_parameter("link.layout", USUAL_LAYOUT, "names of a datagram's doubles in their order, or json"),
        real_parameter("link.sample_time", "s", 0.01, 1e-5, 1.0, "sampling interval of the rig"),
        real_parameter("link.delay", "s", 0.05, 0.0, 10.0, "the rig is shown this much later: overtaken samples wait"),
        real_parameter("link.maximum_age", "s", 0.2, 1e-3, 1e3, "age above which the watchdog speaks up"),
        real_parameter(
            "link.wait", "s", 0.0, 0.0, 100.0, "the initialisation waits so long for the rig's first sample"
        ),
        integer_parameter("link.look_ahead", 256, 1, 100000, "most datagrams read in one step"),
    )
    summary = "Brings a running rig into a co-simulation, by UDP"
    equations = """
<p>A datagram holds one sample: doubles, little-endian, in the order of <code>link.layout</code>, as the UDP blocks of
Simulink and QUARC send them, or a JSON object. At time t the unit shows the rig's latest sample with a time up to
t + offset. The first sample sets the offset so that it is shown <code>link.delay</code> later; samples that overtake
each other within this time are put into order. Where datagrams hold no time, their number times
<code>link.sample_time</code> is taken, and without numbers the simulated time at which they came in.</p>
<p>A step never waits: if nothing came in, the last sample stays, <code>fresh</code> is 0, <code>age</code> grows, and
above <code>link.maximum_age</code> the <code>watchdog</code> is 1. Therefore the host has to run in real time.
<code>lead</code> says whether it does: above 0 the co-simulation runs ahead of the rig, below 0 behind. If the two come
apart by more than <code>link.maximum_age</code>, the offset is set anew.</p>
<p>Before the first sample all signals are 0, which units that estimate take for a measurement. With
<code>link.wait</code> above 0 the initialisation waits for the first sample, and is refused if none comes in.</p>
<p>The unit listens on one address and hears one sender: <code>link.sender</code>, or the first that sends a good
datagram, until it has been silent for 2 s. Datagrams are not signed, so that a machine that can forge a sender's
address can forge samples: use a network of your own. The state cannot be saved, because what a rig has sent cannot be
sent back.</p>"""
    source = "RMQFMU (arXiv 2107.01010) for maximum age, look-ahead and lead"
    saves_state = False

    port: Port | None = None
    opened: tuple[Any, ...] = ()

    def initialise(self, time: float) -> None:
        """Read the settings and open the socket."""
        value = {name: self.values[reference] for name, reference in self.references.items()}
        self.settings = ClockSettings(value["link.delay"], value["link.maximum_age"], value["link.sample_time"])
        self.most = value["link.look_ahead"]
        wanted = tuple(value[f"link.{name}"] for name in ("address", "port", "sender", "layout"))
        if self.port is None or wanted != self.opened:
            self._close()
            address, number, sender, layout = wanted
            try:
                self.port = Port(address, number, sender, read_layout(layout))
            except ConfigurationError as problem:
                raise Refusal(f"link: {problem}") from problem
            self.opened = wanted
        self.clock = Clock()
        self.said = ""
        self.elections = self.port.elections
        self._show(time)
        self._wait(time, value["link.wait"])

    def advance(self, time: float, step_size: float) -> None:
        """Read what has come in; show the rig's latest sample up to the end of the step."""
        self._show(time + step_size)

    def terminate(self) -> None:
        """Close the socket as well."""
        super().terminate()
        self._close()

    def _close(self) -> None:
        if self.port is not None:
            self.port.close()
            self.port = None

    def _wait(self, time: float, longest: float) -> None:
        """Wait for the rig's first sample."""
        end = monotonic() + longest
        while longest > 0.0 and self.port is not None and not self.clock.order.newest:
            left = end - monotonic()
            if left <= 0.0:
                reason = f"; {self.port.reason}" if self.port.reason else ""
                raise Refusal(f"no sample of the rig came in within link.wait = {longest:g} s{reason}")
            select([self.port], [], [], left)
            self._show(time)

    def _show(self, time: float) -> None:
        port = self.port
        if port is None:
            raise Refusal("there is no link to the rig; correct link.* before initialisation ends")
        samples = tuple(time_sample(sample, time, self.settings.sample_time) for sample in port.arrived(self.most))
        if port.elections > self.elections:
            if self.elections:  # another sender has another clock
                self.clock = self.clock._replace(order=restart(self.clock.order))
                self.log(f"{port.note}, which is heard", Fmi2Status.warning)
            self.elections = port.elections
        self.clock, seen = tick(self.clock, time, samples, self.settings)
        # none is due before link.delay has passed: the first one is shown until then
        latest = seen.latest or next(iter(self.clock.order.waiting), None)
        if latest is not None:
            self.values[:_SHOWN] = latest.signals
        counts = self.clock.order.counts
        silent = seen.latest is None or seen.age > self.settings.maximum_age
        shown = (
            float(seen.fresh),
            float(silent),
            seen.age,
            seen.lead,
            float(len(self.clock.order.waiting)),
            float(counts.received),
            float(counts.lost),
            float(counts.reordered),
            float(counts.late),
            float(counts.duplicated),
            float(counts.stray),
            float(port.refused),
            float(port.foreign),
            float(self.clock.set_anew),
            float(port.address[1]),
        )
        self.values[_SHOWN : _SHOWN + len(shown)] = shown
        if port.reason and not self.said:  # one is enough; the output ``refused`` counts them
            self.said = port.reason
            self.log(f"{port.reason}; further ones are counted only", Fmi2Status.warning)
