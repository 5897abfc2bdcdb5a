"""The commented heli.toml that `heli init` writes: the defaults, and an example of every other key."""

import json
import re
from os import PathLike
from pathlib import Path

from heli_identifier.errors import ConfigurationError, printable
from heli_identifier.files import write_atomically
from heli_identifier.records.guess import Guess
from heli_identifier.records.units import ANGLES

_TEMPLATE = Path(__file__).with_name("heli.toml.template")
_KEY = re.compile(r"(# )?(?P<key>\w+) = (?P<value>.*?)  # (?P<comment>.*)")


def write_template(path: str | PathLike[str], found: Guess | None = None) -> Path:
    """Write the commented configuration.

    Parameters
    ----------
    path : str or PathLike
        File to make. Missing folders above it are made.
    found : Guess, optional
        What was found in a log; it is filled in, each entry with its reason.

    Raises
    ------
    ConfigurationError
        If the file exists already, since it may hold the user's work, or cannot be written.
    """
    if Path(path).is_file() or Path(path).is_dir():  # a device holds nobody's work
        raise ConfigurationError(f"{path} exists already; delete it or name another file.")
    try:
        return write_atomically(path, template_text(found))
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be written: {error.strerror}.") from error


def template_text(found: Guess | None = None) -> str:
    """Give a configuration with every key explained: of what was found in a log, else of the contract."""
    lines = _TEMPLATE.read_text("utf-8").splitlines()
    if found is None:
        return "\n".join([*lines, ""])
    form, reasons = found.format, found.reasons
    given = {("log", key): getattr(form, key) for key in ("start", "decimal", "swap_rotors", "clip")}
    given |= {("rig.encoder_counts", angle): form.counts_per_turn(angle) for angle in ANGLES}
    for section in ("columns", "units", "references", "signs"):
        given |= {(f"log.{section}", key): value for key, value in getattr(form, section).items()}
    section = ""
    for number, line in enumerate(lines):
        if line.startswith("["):
            section = line.strip("[]")
        elif entry := _KEY.fullmatch(line):
            key = entry["key"]
            value = given.get((section, key))
            if value is not None:
                reason = reasons.get(f"{section}.{key}".removeprefix("log."), entry["comment"])
                # A text of TOML is that of JSON, which lets the control character DEL stand.
                quoted = json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
                lines[number] = f"{key} = {quoted}  # {printable(reason)}"
    doubts = [f"# NOT CERTAIN: {printable(text)}." for text in found.doubts]
    said = "# What `heli init` found in a log, each guess with its reason. Confirm every one of them."
    return "\n".join([lines[0], said, *doubts, *lines[1:], ""])
