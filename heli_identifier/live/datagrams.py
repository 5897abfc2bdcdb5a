"""Datagrams of a rig: rows of doubles, as the UDP blocks of Simulink and QUARC send them, and JSON lines.

A datagram holds one sample. In a layout of doubles it is a row of them, little-endian and without padding, in the order
that the layout names:

    sequence time v_front v_rear pitch elevation travel

The five signals are needed. ``sequence`` counts the samples, ``time`` is the rig's clock [s]; either or both may be
missing. An angle in degrees is ``pitch[deg]``, and ``-`` is a double that is not read. The layout ``json`` is an object
with these names as its keys, one line per datagram.

What cannot be a sample is not decoded: a wrong length, a number that is not finite or that no rig reaches.
"""

from __future__ import annotations

import json
import struct
from math import inf, pi
from typing import Any, NamedTuple, Union

from heli_identifier.errors import ConfigurationError

SIGNALS = ("v_front", "v_rear", "pitch", "elevation", "travel")
USUAL_LAYOUT = "sequence time v_front v_rear pitch elevation travel"
JSON = "json"

LARGEST_JSON = 1024
"""Bytes of the longest JSON line that is read; one of this project has about 150."""

LARGEST_DATAGRAM = 65_507
"""Bytes of the longest datagram of UDP under IPv4."""

LARGEST_SEQUENCE = 2.0**53
"""Whole numbers up to here are exact as doubles."""

LONGEST_TIME = 1e11
"""Bound of the rig's clock [s]; the seconds since 1970 and those of year 1601 lie below it."""

BOUNDS = {
    "v_front": 30.0,  # [V], as the units' inputs take them
    "v_rear": 30.0,
    "pitch": 2.5 * pi,  # [rad] a quarter of a turn, and a turn of the encoder
    "elevation": 2.5 * pi,
    "travel": 1e4,
}
"""Largest value of each signal either way."""

_DEGREE = pi / 180.0
_ANGLES = SIGNALS[2:]
_IGNORED = "-"


class Layout(NamedTuple):
    """What a datagram holds: the names in their order with their factors to SI; no names for JSON."""

    names: tuple[str, ...]
    factors: tuple[float, ...]

    @property
    def size(self) -> int:
        """Length of a datagram [bytes], for JSON the largest one."""
        return 8 * len(self.names) if self.names else LARGEST_JSON


class Datagram(NamedTuple):
    """One sample as it was sent: voltages [V] and angles [rad] by :data:`SIGNALS`.

    ``sequence`` and ``time`` [s] are None where the layout has none.
    """

    sequence: int | None
    time: float | None
    signals: tuple[float, ...]


Decoded = Union[Datagram, str]  # noqa: UP007 - evaluated, also by Python 3.9


def read_layout(text: str) -> Layout:
    """Return the layout that a text names.

    Raises
    ------
    ConfigurationError
        A name is unknown or stands there twice, a signal is missing, or there are more than a datagram holds.
    """
    words = text.replace(",", " ").split()
    if words == [JSON]:
        return Layout((), ())
    names, factors = [], []
    for word in words:
        name, bracket, unit = word.partition("[")
        in_degrees = bracket != "" and unit == "deg]" and name in _ANGLES
        if (bracket and not in_degrees) or name not in (*SIGNALS, "sequence", "time", _IGNORED):
            raise ConfigurationError(
                f"layout {text!r}: {word!r} is unknown; it is {JSON}, or names of {', '.join(SIGNALS)}, sequence, time "
                f"and {_IGNORED} for a double that is not read, angles also as pitch[deg]"
            )
        if name in names and name != _IGNORED:
            raise ConfigurationError(f"layout {text!r}: {name!r} stands there twice")
        names.append(name)
        factors.append(_DEGREE if in_degrees else 1.0)
    missing = [name for name in SIGNALS if name not in names]
    if missing:
        raise ConfigurationError(f"layout {text!r} lacks {', '.join(missing)}")
    if 8 * len(names) > LARGEST_DATAGRAM:
        raise ConfigurationError(
            f"the layout has {len(names)} doubles, a datagram holds {LARGEST_DATAGRAM // 8} at most"
        )
    return Layout(tuple(names), tuple(factors))


def decode(datagram: bytes, layout: Layout) -> Decoded:
    """Return the sample in a datagram, or the reason why it holds none."""
    if layout.names:
        if len(datagram) != layout.size:
            return f"it has {len(datagram)} bytes, {layout.size} are needed for {' '.join(layout.names)}"
        numbers = struct.unpack(f"<{len(layout.names)}d", datagram)
        return _sample({name: x * k for name, x, k in zip(layout.names, numbers, layout.factors, strict=True)})
    if len(datagram) > LARGEST_JSON:
        return f"it has more than {LARGEST_JSON} bytes"
    try:
        content = json.loads(datagram.decode("utf-8"))
    except (ValueError, RecursionError):
        return "it is no JSON"
    return _sample(content) if isinstance(content, dict) else "it is no JSON object"


def _sample(content: dict[str, Any]) -> Decoded:
    """Return the sample with these values, or the reason why there is none."""
    signals = []
    for name in SIGNALS:
        value: Any = content.get(name)
        bound = BOUNDS[name]
        if not _is_number(value) or not -bound <= value <= bound:  # not true of a NaN either
            return f"{name} = {value!r} must be a number in [{-bound:.5g}, {bound:.5g}]"
        signals.append(float(value))
    sequence: Any = content.get("sequence")
    time: Any = content.get("time")
    if sequence is not None:
        if not _is_number(sequence) or not 0.0 <= sequence <= LARGEST_SEQUENCE or sequence != int(sequence):
            return f"sequence = {sequence!r} must be a whole number in [0, {LARGEST_SEQUENCE:g}]"
        sequence = int(sequence)
    if time is not None:
        if not _is_number(time) or not -LONGEST_TIME <= time <= LONGEST_TIME:
            return f"time = {time!r} must be a number in [{-LONGEST_TIME:g}, {LONGEST_TIME:g}] s"
        time = float(time)
    return Datagram(sequence, time, tuple(signals))


def _is_number(value: Any) -> bool:
    """Whether a value is a finite number; JSON also has whole numbers of any length, texts, true and false."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and -inf < value < inf


def encode(sample: Datagram, layout: Layout) -> bytes:
    """Return the datagram of a sample; a sequence number or time that it lacks is sent as 0."""
    content = dict(zip(SIGNALS, sample.signals, strict=True))
    content["sequence"], content["time"] = sample.sequence or 0, sample.time or 0.0
    if not layout.names:
        return (json.dumps({name: content[name] for name in USUAL_LAYOUT.split()}) + "\n").encode()
    numbers = [content.get(name, 0.0) / k for name, k in zip(layout.names, layout.factors, strict=True)]
    return struct.pack(f"<{len(numbers)}d", *numbers)
