"""Run benchmarks by name: ``python -m benchmarks NAME [OPTION...]``; without a name they are listed.

Those of `SECTIONS` measure times and numbers and write their section of docs/benchmarks.md; ``all`` runs each of them,
in about a quarter of an hour, on a machine that does nothing else. The others judge results by rigs whose truth is
known, or by measured rigs; they take options (``NAME --help``) and print tables.
"""

import sys
from importlib import import_module
from typing import Any

import typer

from benchmarks.harness import write_section

SECTIONS = {
    **dict.fromkeys(("commands", "loop", "native", "memory", "runs"), "units"), "fit": "outside", "soak": "soak",
}  # fmt: skip
"""Module of each section of docs/benchmarks.md; its function of the section's name gives the text."""

PRINTED = {
    "blind": "blind", "windy": "halves", "measured": "halves", "outside": "outside", "damage": "blind",
    "controllers": "controllers", "follow": "follow", "closed_loop": "closed_loop", "quiet": "closed_loop",
    "rough_air": "closed_loop", "paper": "paper", "figures": "figures", "freeze": "freeze", "mutants": "mutants",
}  # fmt: skip
"""Module of each benchmark that prints; its function of the benchmark's name has the options as its parameters."""


def main(name: str = "", *options: str) -> None:
    """Run the benchmark that is named first, or list all."""
    if name in PRINTED:
        module: Any = import_module(f"benchmarks.{PRINTED[name]}")
        app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
        app.command(help="\b\n" + module.__doc__.replace("\n\n", "\n\n\b\n"))(getattr(module, name))
        app(options, prog_name=f"python -m benchmarks {name}")
    elif name in ("all", *SECTIONS):
        for section in SECTIONS if name == "all" else (name, *options):
            print(f"{section} ...", file=sys.stderr, flush=True)
            text = getattr(import_module(f"benchmarks.{SECTIONS[section]}"), section)()
            write_section(section, f"{text}\n\n`python -m benchmarks {section}`")
    else:
        error = f"{name} is no benchmark.\n" if name else ""
        sys.exit(f"{error}{__doc__}\nall, or {', '.join(SECTIONS)}\n{', '.join(PRINTED)}")


if __name__ == "__main__":
    main(*sys.argv[1:])
