"""Commands of `heli` in this process, and Python in one of its own."""

import subprocess
import sys
from textwrap import dedent

from typer.testing import CliRunner

from heli_identifier.cli.app import app

HELI = "from heli_command import main; main()"
"""What `heli` runs."""


def heli(*words, **options):
    """Run a command; its words may be paths and numbers."""
    return CliRunner().invoke(app, [*map(str, words)], **options)


def python(code, *words, ends=0, **options):
    """Run code in a process, which has to end with the exit code ``ends``."""
    command = [sys.executable, "-c", dedent(code), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    assert done.returncode == ends, done.stdout + done.stderr[-3000:]
    return done
