"""A row judged against the truth beside it.

*Named first*: the strongest entry is an effect that the rig holds, on the axis it acts on; an effect that acts on
several axes is true on each of them. *False*: an entry that the rig does not hold; an "unknown" effect is one on every
rig that holds no unknown torque. *Covered*: the 95 % interval of a parameter or coefficient holds the true value.
"""

from heli_identifier.online import Estimate
from heli_identifier.tracing import BASE, RigVerdict
from heli_identifier.workbench.campaign.row import Row

UNKNOWN = "unknown"
"""Name of an entry that no effect of the catalogue explains."""

Entry = tuple[str, str]
"""Name and axis."""


def true_entries(row: Row) -> set[Entry]:
    """Effects that the rig holds."""
    return {(effect["name"], effect["axis"]) for effect in row["true_effects"] or ()}


def found_entries(row: Row) -> list[Entry]:
    """Effects that were found, strongest evidence first, unknown ones among them."""
    return [(effect["name"], effect["axis"]) for effect in row["effects"] or ()]


def named_first(row: Row) -> bool:
    """Whether the strongest entry is true."""
    found = found_entries(row)
    return bool(found) and found[0] in true_entries(row)


def all_named(row: Row) -> bool:
    """Whether every effect that the rig holds is named, on one of its axes at least."""
    true = true_entries(row)
    return {name for name, _ in true} == {name for name, axis in found_entries(row) if (name, axis) in true}


def false_entries(row: Row) -> list[Entry]:
    """Entries that the rig does not hold."""
    true, holds_unknown = true_entries(row), row["true_unknown"] is not None
    return [entry for entry in found_entries(row) if entry not in true and not (entry[0] == UNKNOWN and holds_unknown)]


def unknown_recognised(row: Row) -> bool:
    """Whether the verdict is an unknown effect, on the true axis and of the true variable."""
    true = row["true_unknown"]
    return (
        true is not None
        and row["verdict"] == RigVerdict.UNKNOWN_EFFECT
        and any(
            (found["name"], found["axis"], found["variable"]) == (UNKNOWN, true["axis"], true["variable"])
            for found in row["effects"]
        )
    )


def right(row: Row) -> bool:
    """Whether the structure is the true one: what the rig holds is found, and nothing else."""
    if row["error"] is not None:
        return False
    found = all_named(row) if row["true_unknown"] is None else unknown_recognised(row)
    return found and not false_entries(row)


def coverage(row: Row) -> dict[str, bool]:
    """Tell for every parameter and coefficient with a known true value whether its 95 % interval holds it."""
    held = {}
    for symbol in BASE:
        value, error, true = row[symbol], row[f"{symbol}_se"], row[f"true_{symbol}"]
        if None not in (value, error, true):
            held[symbol] = _holds(value, error, true)
    strengths = {(effect["name"], effect["axis"]): effect["coefficient"] for effect in row["true_effects"] or ()}
    for found in row["effects"] or ():
        value, error, true = (
            found["coefficient"],
            found["standard_error"],
            strengths.get((found["name"], found["axis"])),
        )
        if value is not None and error is not None and true is not None:
            held[f"{found['name']} {found['axis']}"] = _holds(value, error, true)
    return held


def _holds(value: float, standard_error: float, true: float) -> bool:
    low, high = Estimate(value, standard_error, "").interval
    return low <= true <= high
