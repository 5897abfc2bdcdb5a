"""The help of every command, put into the page of commands where it says ``<!-- commands -->``."""

import re
from collections.abc import Iterator
from typing import Any

import typer

from heli_identifier.cli.app import app

MARK = "<!-- commands -->"
_BOLD = re.compile(r"\[/?(?:bold)?\]")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Give a page with the commands in it (an event of MkDocs)."""
    return markdown.replace(MARK, "\n".join(commands())) if MARK in markdown else markdown


def commands() -> Iterator[str]:
    """One section per command: what it does, its arguments and options, its examples."""
    group: Any = typer.main.get_command(app)
    for name, command in group.commands.items():
        yield f"## heli {name}\n\n{command.help}\n"
        yield "| argument, option | meaning |\n|---|---|"
        for parameter in command.params:
            yield f"| {_names(parameter)} | {_meaning(parameter)} |"
        examples = [line for line in _BOLD.sub("", command.epilog or "").splitlines() if line.startswith("heli ")]
        yield "\n```text\n" + "\n".join(examples) + "\n```\n"


def _names(parameter: Any) -> str:
    """Give an option's names and what it takes, or an argument as its usage line shows it."""
    options = [name for name in parameter.opts if name.startswith("-")]
    takes = "" if getattr(parameter, "is_flag", False) else parameter.metavar or "VALUE"
    if not options:
        takes = f"{takes if parameter.required else f'[{takes}]'}{'...' if parameter.nargs != 1 else ''}"
    return ", ".join(f"`{name}`" for name in options) + (f" `{takes}`" if takes else "")


def _meaning(parameter: Any) -> str:
    """Give the help, and a default that says something: no flag's, and none that the help hides."""
    text, default = str(parameter.help).replace("|", "\\|"), parameter.default
    told = parameter.show_default is not False and not getattr(parameter, "is_flag", False)
    return f"{text} Default: `{default}`." if told and default not in (None, "", [], ()) else text
