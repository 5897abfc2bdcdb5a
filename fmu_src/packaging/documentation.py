"""documentation/index.html of a unit: equations, source, what the host needs, variables."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

from ..slave_base import SlaveBase
from ..variables import Value, Variable
from .described import AUTHOR, LICENSE, VERSION

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
    equations = f"<h2>Equations</h2>\n{unit.equations}\n"
    source = f"<h2>Source</h2>\n<p>{escape(unit.source)}</p>\n"
    rows = "".join(_row(variable, start_values.get(variable.name, variable.start)) for variable in unit.variables)
    table = (
        "<h2>Variables</h2>\n<table>\n<tr><th>name</th><th>causality</th><th>unit</th><th>start</th>"
        f"<th>range</th><th>description</th></tr>\n{rows}</table>\n"
    )
    return (
        head
        + equations
        + source
        + (host or _HOST.format(state=_STATE[unit.saves_state]))
        + table
        + "</body>\n</html>\n"
    )


def _row(variable: Variable, start: Value | None) -> str:
    low, high = variable.minimum, variable.maximum
    span = "" if low is None or high is None else f"{low:g} to {high:g}"
    kind = variable.causality + (", tunable" if variable.variability == "tunable" else "")
    shown = "" if start is None else f"{start:.10g}" if isinstance(start, float) else str(start)
    cells = (variable.name, kind, variable.unit or variable.type, shown, span, variable.description)
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>\n"
