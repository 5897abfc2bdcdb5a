"""RigLink: a running rig as a unit; its samples arrive by UDP."""

from __future__ import annotations

from select import select
from time import monotonic
from typing import Any, ClassVar

from pythonfmu.enums import Fmi2Status

from heli_identifier.errors import ConfigurationError
from heli_identifier.live import Clock, Port

from ..errors import Refusal
from ..slave_base import SlaveBase
from ..variables import Variable, output, parameter
from .signals import measured_outputs


class RigLink(SlaveBase):
    """Shows the rig's latest sample up to each time, from the initialisation on; no step waits for the network."""

    variables: ClassVar[tuple[Variable, ...]] = (
        *measured_outputs(),
        output("fresh", "1", "1: the step brought the sample that was due, 0: none, or a late one"),
        output("watchdog", "1", "1: there is no sample yet, or the one shown is older than link.maximum_age, else 0"),
        output("age", "s", "age of the sample shown, beyond link.delay"),
        output("lead", "s", "how far the co-simulation runs ahead of the rig; below 0 it runs behind"),
        output("waiting", "1", "samples that have come in and are not due yet"),
        output("received", "1", "samples that were taken"),
        output("lost", "1", "samples that did not come in"),
        output("reordered", "1", "samples that came after a later one, and in time"),
        output("late", "1", "samples that came after a later one had been due; not shown"),
        output("duplicated", "1", "samples that came twice"),
        output("stray", "1", "samples more than 1 s from the others that no second one continued; not shown"),
        output("refused", "1", "datagrams that hold no sample: a wrong length, a value that no rig reaches"),
        output("foreign", "1", "datagrams of other senders; not read"),
        output("resynchronised", "1", "times that the rig's clock was set again"),
        output("port", "1", "port on which datagrams come in", ("link.address", "link.port")),
        parameter("link.address", "127.0.0.1", "numeric address of this machine on which datagrams come in"),
        parameter("link.port", 25000, "port on which they come in; 0: a free one, see port", None, 0, 65535),
        parameter("link.sender", "", "address of the rig; empty: the first good sender"),
        parameter("link.sample_time", 0.01, "sampling interval of the rig", "s", 1e-5, 1.0),
        parameter("link.delay", 0.05, "the rig is shown this much later: overtaken samples wait", "s", 0.0, 10.0),
        parameter("link.maximum_age", 0.2, "age above which the watchdog speaks up", "s", 1e-3, 1e3),
        parameter("link.wait", 0.0, "the initialisation waits so long for the rig's first sample", "s", 0.0, 100.0),
        parameter("link.look_ahead", 256, "most datagrams read in one step", None, 1, 100000),
    )
    summary = "Brings a running rig into a co-simulation, by UDP"
    saves_state = False

    port: Port | None = None
    port_settings: tuple[Any, ...] = ()

    def initialise(self, time: float) -> None:
        """Read the settings and open the socket."""
        settings = tuple(self.value(f"link.{name}") for name in ("address", "port", "sender"))
        if self.port is None or settings != self.port_settings:
            self._close()
            try:
                self.port = Port(*settings)
            except ConfigurationError as problem:
                raise Refusal(f"link: {problem}") from problem
            self.port_settings = settings
        self.clock = Clock(self.value("link.delay"), self.value("link.maximum_age"), self.value("link.sample_time"))
        self.warned = False
        self._show(time)
        self._wait_for_sample(time, self.value("link.wait"))

    def advance(self, time: float, step_size: float) -> None:
        """Read the datagrams; show the rig's latest sample up to the end of the step."""
        self._show(time + step_size)

    def terminate(self) -> None:
        """Refuse all further steps; close the socket."""
        super().terminate()
        self._close()

    def _close(self) -> None:
        if self.port is not None:
            self.port.close()
            self.port = None

    def _wait_for_sample(self, time: float, longest: float) -> None:
        """Wait for the rig's first sample."""
        end = monotonic() + longest
        while longest > 0.0 and self.port is not None and not self.clock.order.newest:
            rest = end - monotonic()
            if rest <= 0.0:
                reason = f"; {self.port.reason}" if self.port.reason else ""
                raise Refusal(f"no sample of the rig came in within link.wait = {longest:g} s{reason}")
            select([self.port], [], [], rest)
            self._show(time)

    def _show(self, time: float) -> None:
        port = self.port
        if port is None:
            raise Refusal("there is no link to the rig; correct link.* before initialisation ends")
        arrived = list(port.receive(self.value("link.look_ahead")))
        clock, counts = self.clock, self.clock.order.counts
        clock.tick(time, arrived)
        # no sample is due before link.delay has passed: the first one is shown until then
        latest = clock.order.last or next(iter(clock.order.waiting), None)
        is_old = clock.order.last is None or clock.age > clock.maximum_age
        outputs = (
            *(self.values[:5] if latest is None else latest.signals),
            clock.fresh, is_old, clock.age, clock.lead, len(clock.order.waiting),
            *(counts[name] for name in ("received", "lost", "reordered", "late", "duplicated", "stray")),
            port.refused, port.foreign, clock.resynchronised, port.address[1],
        )  # fmt: skip
        self.show(map(float, outputs))
        if port.reason and not self.warned:  # the output ``refused`` counts all of them
            self.warned = True
            self.log(f"{port.reason}; further ones are counted only", Fmi2Status.warning)
