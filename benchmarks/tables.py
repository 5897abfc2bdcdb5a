"""Tables of a page, and the bars with which the figures of a section are compared."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Bar:
    """Requirement on a figure: at most or at least ``bound``.

    Attributes
    ----------
    what : str
    value, bound : float
        In ``unit``.
    unit : str
    at_least : bool
        Whether more is better.
    """

    what: str
    value: float
    bound: float
    unit: str
    at_least: bool = False

    @property
    def met(self) -> bool:
        """Whether the figure meets its bar; NaN does not."""
        return self.value >= self.bound if self.at_least else self.value <= self.bound


def bar_table(bars: Iterable[Bar]) -> str:
    """Give bars as a table: what, measured, asked, met."""
    rows = [
        (
            bar.what,
            f"{figure(bar.value)} {bar.unit}".strip(),
            f"{'at least' if bar.at_least else 'at most'} {bar.bound:g} {bar.unit}".strip(),
            "yes" if bar.met else "**no**",
        )
        for bar in bars
    ]
    return table(("what", "measured", "asked", "met"), rows)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Give a Markdown table; a bar in a cell is escaped.

    Raises
    ------
    ValueError
        If a row has more or fewer cells than the head.
    """
    lines = [tuple(head), ("---",) * len(head)]
    for row in rows:
        if len(row) != len(head):
            raise ValueError(f"row {tuple(row)} has {len(row)} cells, the head {len(head)}.")
        lines.append(tuple(row))
    return "\n".join(f"| {' | '.join(cell.replace('|', '&#124;') for cell in line)} |" for line in lines)


def figure(value: float) -> str:
    """Give three significant digits, without an exponent between a thousandth and a million."""
    if value != value:
        return "none"
    if value == 0.0 or 1e-3 <= abs(value) < 1e6:
        digits = 2 if value == 0.0 else next(k for k in range(7) if abs(value) * 10**k >= 99.5 or k == 6)
        return f"{value:.{digits}f}"
    return f"{value:.2e}"


def seconds(value: float) -> str:
    """Give a time in the unit that suits it."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if value >= size:
            return f"{figure(value / size)} {unit}"
    return f"{figure(value / 1e-6)} us"
