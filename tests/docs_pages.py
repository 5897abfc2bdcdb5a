"""Pages of the documentation as shell sessions: what a reader types, run in a fresh copy of a clone.

A block of ``bash`` is typed as it stands; in a block of ``console`` the lines behind ``$`` are. A block with a title is
a file that the reader writes (``title="heli.toml"``); of a GitHub workflow the ``run: heli ...`` lines are typed as
well. A block of ``text`` behind commands is what they print, but for its figures and for lines of dots. A comment
``<!-- not run: reason -->`` before a block keeps it from being typed, and ``<!-- continues: page.md -->`` at a page's
beginning starts it where another page ended.
"""

import os
import re
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
CLONED = ("README.md", "pyproject.toml", "benchmarks", "docs", "fmu_src", "heli_identifier", "heli_plant", "tests")
"""What a session finds in its folder, as somebody with a clone would."""

SHELL = ("bash", "console")
PATIENCE = 300.0
"""Seconds that a page may take before it is given up: commands that hang must not hang the tests."""

_FENCE = re.compile(
    r"^(?P<indent> *)```(?P<language>\w+)?(?P<rest>[^\n]*)\n(?P<body>.*?)^(?P=indent)```\s*$", re.M | re.S
)
_NOT_RUN = re.compile(r"<!-- not run: (\S.*?) -->\s*\Z", re.S)
_CONTINUES = re.compile(r"<!-- continues: (\S+) -->")
_MARK = "\x1e"


@dataclass(frozen=True)
class Block:
    """One fenced block: its language, its title if it is a file, its text, its line, and why it is not run."""

    language: str
    title: str
    text: str
    line: int
    reason: str


def blocks(markdown):
    """Every fenced block of a page, in order."""
    found = []
    for fence in _FENCE.finditer(markdown):
        indent = len(fence["indent"])
        text = "".join(line[indent:] or "\n" for line in fence["body"].splitlines(keepends=True))
        title = re.search(r'title="([^"]+)"', fence["rest"])
        reason = _NOT_RUN.search(markdown[: fence.start()])
        line = markdown[: fence.start()].count("\n") + 1
        name = fence["language"] or ""
        found.append(Block(name, title[1] if title else "", text, line, reason[1] if reason else ""))
    return found


def typed(block):
    """What a reader types for a block; nothing if it is no command, or is not run."""
    if block.reason:
        return ""
    if block.title:
        folder = os.path.dirname(block.title) or "."
        runs = re.findall(r"^\s*(?:- )?run: (heli .*)$", block.text, re.M)
        return "\n".join([f"mkdir -p {folder}", f"cat > {block.title} <<'END'\n{block.text}END", *runs]) + "\n"
    if block.language == "console":
        return "".join(f"{line[2:]}\n" for line in block.text.splitlines() if line.startswith("$ "))
    return block.text if block.language == "bash" else ""


def predecessor(markdown):
    """The page that a page continues, or nothing."""
    found = _CONTINUES.search(markdown)
    return found[1] if found else ""


def clone(folder):
    """Make ``folder`` look like a clone: links to what is in the repository, nothing that was ever built."""
    folder.mkdir()
    for name in CLONED:
        (folder / name).symlink_to(ROOT / name)
    return folder


def session(markdown, folder):
    """Type a page's commands into one shell; returns what each block printed, by the block's line.

    Whatever the page leaves running in the background ends with it. Raises AssertionError with the command's own words
    where one fails.
    """
    script = ["set -euo pipefail"]
    for block in blocks(markdown):
        if text := typed(block):
            script += [f"printf '{_MARK}{block.line}\\n'", text]
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    shell = subprocess.Popen(
        ["bash", "-c", "\n".join(script)], cwd=folder, env=environment, text=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
    )  # fmt: skip
    try:
        printed, _ = shell.communicate(timeout=PATIENCE)
    finally:
        try:
            os.killpg(shell.pid, signal.SIGTERM)
        except ProcessLookupError:
            pass
    outputs = {}
    for part in printed.split(_MARK)[1:]:
        line, _, text = part.partition("\n")
        outputs[int(line)] = text
    last = max(outputs, default=0)
    assert shell.returncode == 0, (
        f"the block at line {last} ended with {shell.returncode}:\n{outputs.get(last, printed)}"
    )
    return outputs


def words(text):
    """The words of a line, without figures and signs."""
    return re.findall(r"[^\W\d][\w.]*", text)


def unlike(shown, printed):
    """Lines of ``shown`` whose words, in order, are in no line of ``printed``."""
    actual = [words(line) for line in printed.splitlines()]
    return [line for line in shown.splitlines() if not any(_within(words(line), there) for there in actual)]


def _within(wanted, there):
    rest = iter(there)
    return all(word in rest for word in wanted)
