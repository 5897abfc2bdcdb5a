"""Run benchmarks by name: ``python -m benchmarks NAME [OPTION...]``; without a name they are listed.

Those of `SECTIONS` measure times and numbers and write their section of docs/benchmarks.md; ``all`` runs each of them,
in about a quarter of an hour, on a machine that does nothing else. The others judge results by rigs whose truth is
known, or by measured rigs; they take options (``NAME --help``) and print tables.
"""

import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

from benchmarks.harness import PAGE, write_section

SECTIONS = {
    "commands": "commands",
    "loop": "masters",
    "native": "masters",
    "fit": "fit",
    "memory": "units",
    "runs": "units",
    "soak": "soak",
    "numbers": "numbers",
}
"""Module of each section of docs/benchmarks.md; its function of the section's name gives the text."""

PRINTED = {
    "blind": "blind",
    "windy": "halves",
    "measured": "halves",
    "damage": "damage",
    "controllers": "controllers",
    "follow": "follow",
    "closed_loop": "closed_loop",
    "quiet": "closed_loop",
    "watched": "closed_loop",
    "rough_air": "closed_loop",
    "suspicion": "reading",
    "large_logs": "reading",
    "paper": "paper",
    "figures": "figures",
    "freeze": "freeze",
    "mutants": "mutants",
}
"""Module of each benchmark that prints; its function of the benchmark's name takes the options."""


def main(arguments: Sequence[str]) -> None:
    """Run the benchmark that is named first, or list all."""
    name, *options = arguments or ("",)
    if name in PRINTED:
        function_of(name)(options)
    elif name in ("all", *SECTIONS):
        for section in SECTIONS if name == "all" else (name, *options):
            print(f"{section} ...", file=sys.stderr, flush=True)
            write_section(PAGE, section, f"{function_of(section)()}\n\n`python -m benchmarks {section}`")
    else:
        told = f"{name} is no benchmark.\n" if name else ""
        sys.exit(f"{told}{__doc__}\nall, or {', '.join(SECTIONS)}\n{', '.join(PRINTED)}")


def function_of(name: str) -> Callable[..., Any]:
    """Give the function of a benchmark."""
    found: Callable[..., Any] = getattr(import_module(f"benchmarks.{(SECTIONS | PRINTED)[name]}"), name)
    return found


if __name__ == "__main__":
    main(sys.argv[1:])
