"""What lies in an FMU beside code and model description: documentation, an icon, and the zip around them all."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Mapping
from html import escape

import numpy as np

from ..slave_base import SlaveBase
from ..variables import Value, Variable
from .description import AUTHOR, LICENSE, VERSION

EARLIEST = (1980, 1, 1, 0, 0, 0)
"""The earliest time of a zip entry."""

SIZE = 96
"""Width and height of the icon [pixels]."""

_HEAD = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>{name}</title>
<style>
body {{ font: 16px/1.5 sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #222; }}
table {{ border-collapse: collapse; font-size: 14px; }}
td, th {{ border-bottom: 1px solid #ccc; padding: .2em .7em; text-align: left; vertical-align: top; }}
pre {{ background: #f4f4f4; padding: .8em; overflow-x: auto; }}
</style>
</head>
<body>
<h1>{name}</h1>
<p>{summary}. Version {version}, {author}, licence {license}.</p>
"""

_HOST = """<h2>What the host needs</h2>
<p>The unit is written in Python and runs on the interpreter of its host: Python 3.9 to 3.13, 64 bit, standard library
only; NumPy is not needed. A host that is not a Python process needs the interpreter's shared library: on Linux start
the host with <code>LD_PRELOAD=libpython3.X.so</code>, on Windows put <code>python3.dll</code> on the
<code>PATH</code>. The FMU contains binaries for linux64 (glibc 2.32 or newer) and win64. The path to which the FMU is
extracted must consist of ASCII characters without percent signs and brackets.</p>
<h2>How it behaves</h2>
<p>Inputs are held over a communication step. Outputs change in <code>doStep</code> only and are right from the start
time on. Values that are not finite or out of range are logged (category <code>logStatusDiscard</code>) and ignored,
and steps are refused with <code>fmi2Discard</code> until the variable has a good value; the unit stays usable.
Parameters are fixed when the initialisation ends, unless the table says tunable. {state}</p>
"""
_STATE = {
    True: "The state can be saved, restored and serialised at any time, exact to the bit.",
    False: "The state cannot be saved; the call is logged as refused.",
}


def index_html(unit: type[SlaveBase], start_values: Mapping[str, Value], host: str = "") -> str:
    """Return the page; ``start_values`` override those of the unit's variables, ``host`` the text on the host."""
    head = _HEAD.format(
        name=escape(unit.__name__),
        summary=escape(unit.summary),
        version=VERSION,
        author=escape(AUTHOR),
        license=LICENSE,
    )
    about = f"<h2>Equations</h2>\n{unit.equations}\n<h2>Source</h2>\n<p>{escape(unit.source)}</p>\n"
    rows = "".join(_row(variable, start_values.get(variable.name, variable.start)) for variable in unit.variables)
    table = (
        "<h2>Variables</h2>\n<table>\n<tr><th>name</th><th>causality</th><th>unit</th><th>start</th>"
        f"<th>range</th><th>description</th></tr>\n{rows}</table>\n"
    )
    return f"{head}{about}{host or _HOST.format(state=_STATE[unit.saves_state])}{table}</body>\n</html>\n"


def _row(variable: Variable, start: Value | None) -> str:
    low, high = variable.minimum, variable.maximum
    span = "" if low is None or high is None else f"{low:g} to {high:g}"
    kind = variable.causality + (", tunable" if variable.variability == "tunable" else "")
    shown = "" if start is None else f"{start:.10g}" if isinstance(start, float) else str(start)
    cells = (variable.name, kind, variable.unit or variable.type, shown, span, variable.description)
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>\n"


def icon(unit: str) -> bytes:
    """Return a PNG: stand, arm, counterweight, body, and two rotors in a dark colour that the unit's name decides."""
    number = zlib.crc32(unit.encode())
    colour = (40 + number % 150, 40 + number // 150 % 150, 40 + number // 22500 % 150)
    pixels = np.full((SIZE, SIZE, 4), (255, 255, 255, 0), dtype=np.uint8)
    y, x = np.mgrid[:SIZE, :SIZE]
    for x0, y0, x1, y1 in ((34, 82, 62, 88), (46, 44, 50, 82), (10, 42, 78, 46), (72, 22, 76, 66)):
        pixels[y0:y1, x0:x1] = (70, 70, 70, 255)  # foot, column, arm, body
    for x0, y0, radius, own in ((12, 44, 8, None), (74, 20, 12, colour), (74, 68, 12, colour), (74, 20, 3, None),
                                (74, 68, 3, None)):  # fmt: skip
        pixels[(x - x0) ** 2 + (y - y0) ** 2 <= radius * radius] = (*(own or (70, 70, 70)), 255)
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)  # PNG specification, colour type 6, no filter
    header = struct.pack(">IIBBBBB", SIZE, SIZE, 8, 6, 0, 0, 0)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(rows, 9)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in parts
    )


def zip_bytes(entries: Mapping[str, bytes]) -> bytes:
    """Return a zip of ``entries`` in sorted order with one fixed time and mode: equal content, equal bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in sorted(entries):
            info = zipfile.ZipInfo(name, EARLIEST)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o644 << 16
            info.create_system = 3  # the same on every system that builds
            archive.writestr(info, entries[name])  # the highest level takes twice as long for a hundredth less
    return buffer.getvalue()
