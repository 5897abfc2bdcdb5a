"""The four-unit loop and the units of it: this master, the models alone, and three other masters on the same units."""

from benchmarks.machine import measured_at
from benchmarks.master_speed import CASES, STEP
from benchmarks.printed import Printed, printed
from benchmarks.tables import Bar, bar_table, figure, table

STEPS, ROUNDS = 1_500, 12
OTHERS = ("fmpy_per_connection", "libcosimpy", "ecos")

Figures = dict[str, tuple[float, float]]
"""Median and smallest microseconds a step, by case."""


def figures_of(speed: Printed) -> Figures:
    """Take the cases that were run out of what the benchmark printed."""
    return {case: (row[0], row[1]) for case, row in speed.rows.items() if case in CASES}


def bars(figures: Figures) -> list[Bar]:
    """Compare figures with their bars.

    Times are those of the fastest round, because their bars are for idle cores. Ratios are of medians, because noise
    raises the numerator and the denominator alike.
    """
    own = figures["ours"][1]
    boundary = own - figures["models_alone"][1]
    asked = [
        Bar("closed loop of four units", own, 100.0, "us a step"),
        Bar("of which the FMI boundary", boundary, 25.0, "us a step"),
        Bar("speed against real time, 10 ms a step", 1e6 * STEP / own, 100.0, "times", True),
        Bar("HelicopterPlant doStep, all effects off", figures["plant_off"][1], 15.0, "us"),
        Bar("HelicopterPlant doStep, all effects on", figures["plant_on"][1], 30.0, "us"),
        Bar("AdaptiveIdentifier doStep, three axes", figures["identifier"][1], 40.0, "us"),
    ]
    needed = {"fmpy_per_connection": ("fmpy, one call per connection", 3.0), "libcosimpy": ("libcosim", 1.0)}
    needed["ecos"] = ("Ecos", 1.0)
    for case, (title, bound) in needed.items():
        if case in figures:
            asked.append(Bar(f"against {title}", figures[case][0] / figures["ours"][0], bound, "times faster", True))
    return asked


def section(load: float) -> str:
    speed = printed("benchmarks.master_speed", str(STEPS), str(ROUNDS))
    identifier = printed("benchmarks.online_identifier")
    figures = figures_of(speed)
    own = figures["ours"][0]
    rows = [
        ((CASES[case].__doc__ or case).rstrip("."), f"{median:.1f}", f"{least:.1f}", _times(case, median / own))
        for case, (median, least) in figures.items()
    ]
    missing = [case for case in CASES if case not in figures]
    return "\n\n".join(
        [
            "## The four-unit loop and its units",
            bar_table(bars(figures)),
            table(("what", "median [us]", "least [us]", "times as long"), rows),
            f"{STEPS} steps of {1000 * STEP:g} ms a round, {ROUNDS} rounds in turn, every case in a process of its "
            "own. Times in the first table are those of the fastest round, because their bars are for idle cores; "
            f"ratios are of medians. {_boundaries(figures)}"
            f"Not installed and left out: {', '.join(missing) or 'nothing'}.",
            "### The on-line identifier",
            identifier.block,
            measured_at(("fmpy", "pythonfmu", "libcosimpy", "ecospy"), load),
        ]
    )


def _boundaries(figures: Figures) -> str:
    """Compare the time that FMI adds to a step; the arithmetic of the models takes the same time under every master."""
    if "fmpy_per_connection" not in figures:
        return ""
    models = figures["models_alone"][0]
    naive, own = figures["fmpy_per_connection"][0] - models, figures["ours"][0] - models
    return f"The FMI boundary alone: {naive:.0f} us with one fmpy call per connection, {naive / own:.1f} times ours. "


def _times(case: str, value: float) -> str:
    return figure(value) if case in (*OTHERS, "ours") else ""
