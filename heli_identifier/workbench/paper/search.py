"""The search through the catalogue: every effect alone, then every effect on top of the best one."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed

from heli_identifier.workbench.paper.runs import Progress
from heli_identifier.workbench.paper.spread import Explanation, Identify, explain, explain_without
from heli_plant.effects import Effect

AS_GOOD = 1.05
"""Explanations whose misfits differ by less than this factor cannot be told apart."""


def search(identify: Identify, effects: Sequence[Effect], progress: Progress | None = None) -> list[Explanation]:
    """Return every explanation with none, one and two effects; the best first.

    Effects that do as well as the best one say the same as it, and are not put on top of it.
    """
    none = explain_without(identify)
    singles = _each(identify, effects, none, progress, "effects tried on the paper's spread")
    best = min([none, *singles], key=lambda one: one.misfit)
    pairs: list[Explanation] = []
    if best.misfit * AS_GOOD < none.misfit:
        same = {one.effects[0] for one in singles if one.misfit < AS_GOOD * best.misfit}
        others = [effect for effect in effects if effect not in same]
        pairs = _each(identify, others, best, progress, f"effects tried on top of {best.effects[0].name}")
    return sorted([none, *singles, *pairs], key=lambda one: one.misfit)


def _each(
    identify: Identify, effects: Sequence[Effect], given: Explanation, progress: Progress | None, what: str
) -> list[Explanation]:
    """Add each of ``effects`` to ``given``; compiled code leaves the interpreter's lock to the other threads."""
    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:
        futures = [pool.submit(explain, identify, effect, given) for effect in effects]
        for done, _ in enumerate(as_completed(futures), start=1):
            if progress is not None:
                progress(done, len(futures), what)
    return [future.result() for future in futures]
