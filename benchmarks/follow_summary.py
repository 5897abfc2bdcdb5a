"""Tables of the flights in which a twin follows, and the figures that the bars ask for."""

from typing import Any

import numpy as np

from benchmarks.follow_flights import KINDS, UNCHANGED_KINDS
from benchmarks.tables import table

ASKED = ("k_x", "k_z", "k_y", "friction_pitch", "friction_elevation", "friction_travel", "mass")
"""Kinds of change for which a bar says how soon they are to be noticed."""


def judged(row: dict[str, Any]) -> list[dict[str, Any]]:
    """Return for every change of a flight whether it was noticed, by the clock and in excited flight, and named."""
    found = []
    for number, change in enumerate(row["changes"]):
        later = row["changes"][number + 1]["start"] if number + 1 < len(row["changes"]) else float("inf")
        limit = change["slow"] or 20.0
        mine = [event for event in row["events"] if change["start"] <= event["time_s"] < later]
        alarms = [event["time_s"] - change["start"] for event in mine if event["what"] == "alarm"]
        tried = [
            event["name"] for event in mine if event["what"] == "alarm" and not event["why"].startswith("the inno")
        ]
        excited = change.get("excited")
        found.append(
            {
                "kind": change["kind"],
                "noticed": bool(alarms) and alarms[0] <= limit,
                "excited": excited is not None,
                "noticed excited": excited is not None and bool(alarms) and alarms[0] <= excited,
                "delay": alarms[0] if alarms else None,
                "named": bool(tried) and tried[0] == change["name"],
            }
        )
    return found


def false_alarms(row: dict[str, Any]) -> tuple[int, float]:
    """Return the alarms of the detector before the first change, and the hours flown until then."""
    until = row["changes"][0]["start"] if row["changes"] else 3600.0 * row["hours"]
    alarms = [event for event in row["events"] if event["what"] == "alarm" and event["time_s"] < until]
    return sum("no longer" in event["why"] for event in alarms), until / 3600.0


def summary(rows: list[dict[str, Any]]) -> str:
    """Return the tables of a half."""
    head = ("change", "loop", "flights", "noticed", "after [s]", "named", "error/told: median, 90 %", "<= 1.15",
            "largest error/alone")  # fmt: skip
    lines = [
        _line(kind, closed, mine)
        for kind in KINDS
        for closed in (True, False)
        if (mine := [row for row in rows if row["kind"] == kind and row["closed"] == closed])
    ]
    text = [table(head, lines)] if lines else []
    text += _noticed(rows) + _false(rows)
    adoptions = [one for row in rows for one in row["wrong"] if np.isfinite(one[2]) and np.isfinite(one[3])]
    worse = [one for one in adoptions if one[3] > one[2]]
    text.append(f"Adoptions: {len(adoptions)}, wrong (worse over the next 60 s): {len(worse)}.")
    text += [f"wrong: {one}" for one in worse]
    return "\n\n".join(text)


def _line(kind: str, closed: bool, rows: list[dict[str, Any]]) -> tuple[str, ...]:
    changes = [change for row in rows for change in judged(row)]
    ratio = np.array([row["error"] / row["told"] for row in rows])
    alone = np.array([row["error"] / row["alone"] for row in rows])
    delays = [change["delay"] for change in changes if change["delay"] is not None]
    return (
        kind,
        "closed" if closed else "open",
        f"{len(rows)}",
        _share([change["noticed"] for change in changes]),
        f"{np.median(delays):.0f}" if delays else "",
        _share([change["named"] for change in changes]),
        f"{np.median(ratio):.3f}, {np.quantile(ratio, 0.9):.2f}",
        _share(ratio <= 1.15),
        f"{np.max(alone):.3f}",
    )


def _noticed(rows: list[dict[str, Any]]) -> list[str]:
    """Say what the bars on changes ask for, over all kinds that they ask about."""
    asked = [row for row in rows if row["kind"] in ASKED]
    if not asked:
        return []
    changes = [change for row in asked for change in judged(row)]
    excited = [change for change in changes if change["excited"]]
    text = [
        f"Gains, dry frictions, mass: {len(changes)} flights, noticed within 20 s {_count(changes, 'noticed')}, named "
        f"{_count(changes, 'named')}. 20 s of excited flight in {len(excited)} of them, noticed within these "
        f"{_count(excited, 'noticed excited')}.",
    ]
    for kind in ASKED:
        own = [change for row in rows if row["kind"] == kind for change in row["changes"]]
        if own:
            said = [change for change in changes if change["kind"] == kind and change["excited"]]
            ends = [change["excited"] for change in own if change["excited"] is not None]
            text.append(
                f"{kind}: who knows noise, size and sign would notice {100 * np.mean([o['power'] for o in own]):.0f} % "
                f"within 20 s; 20 s of excited flight take {np.median(ends) if ends else np.inf:.0f} s in the median "
                f"({len(ends)} of {len(own)} flights have them); noticed within these "
                f"{_count(said, 'noticed excited')}."
            )
    return text


def _false(rows: list[dict[str, Any]]) -> list[str]:
    """Say how many alarms there were of unchanged rigs, for streams that are in order and for others."""
    text = []
    groups = {
        "Unchanged rigs": ("none",),
        "Unchanged rigs, streams at fault": ("faulty",),
        "Before a change": tuple(kind for kind in KINDS if kind not in ("loss", "stuck", "stop", "jitter", "all")),
        "Before a change, streams at fault": ("loss", "stuck", "stop", "jitter", "all"),
    }
    for name, kinds in groups.items():
        mine = [false_alarms(row) for row in rows if row["kind"] in kinds]
        if mine:
            text.append(f"{name}: {sum(n for n, _ in mine)} false alarms in {sum(h for _, h in mine):.1f} h.")
    still = sum(len(row["wrong"]) for row in rows if row["kind"] in UNCHANGED_KINDS)
    return [*text, f"Adoptions on unchanged rigs: {still}."] if text else []


def _count(changes: list[dict[str, Any]], what: str) -> str:
    flags = [change[what] for change in changes]
    return f"{sum(flags)} of {len(flags)} ({_share(flags)})"


def _share(flags: Any) -> str:
    flags = list(flags)
    return f"{100 * np.mean(flags):.0f} %" if flags else "-"
