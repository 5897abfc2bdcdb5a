"""The plant off line: an interpreted and a compiled step, and a 90 s log beside scipy and python-control."""

from benchmarks.machine import measured_at
from benchmarks.printed import Printed, printed
from benchmarks.tables import Bar, bar_table

ROUNDS = 3
ERROR, RATIO = 2, 3
"""Columns of a printed line, behind its median and its smallest."""

LARGEST_ERROR = 1e-8
"""Largest difference of the simulation from a tight reference [rad]."""


def bars(steps: Printed) -> list[Bar]:
    """Compare the printed error and ratios with their bars; a quotient of the rounded medians would differ."""
    error = steps.row("ours, 10 ms")[ERROR]
    scipy, control = (steps.row(name)[RATIO] for name in ("scipy RK45, anew each sample", "python-control, tight"))
    return [
        Bar("error of a 90 s log at 10 ms", error, LARGEST_ERROR, "rad"),
        Bar("against scipy solve_ivp (RK45)", scipy, 500.0, "times faster", True),
        Bar("against python-control, tight tolerances", control, 100.0, "times faster", True),
    ]


def section(load: float) -> str:
    steps = printed("benchmarks.plant_step", str(ROUNDS))
    return "\n\n".join(
        [
            "## The plant off line",
            bar_table(bars(steps)),
            steps.block,
            f"{ROUNDS} rounds in turn for the log, {20 * ROUNDS} for the step. Errors are against a reference "
            "integrated to 1e-12, with the voltages held over a sample as the plant takes them, or, for "
            "python-control, joined by straight lines as it takes them.",
            measured_at(("numpy", "numba", "scipy", "control"), load),
        ]
    )
