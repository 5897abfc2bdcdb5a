"""Commands of `heli` in this process, and programs in processes of their own."""

import json
import os
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


def told(*words):
    """Run a command, which has to end well, and read what it says as JSON."""
    done = heli(*words, "--json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def ran(command, ends=0, timeout=1200, **options):
    """Run a program, which has to end with the exit code ``ends``; its words may be paths and numbers."""
    words = [*map(str, command)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=timeout, **options)
    assert done.returncode == ends, f"code {done.returncode}: {done.stdout[-2000:]}{done.stderr[-4000:]}"
    return done


def bash(script, folder, environment, timeout, stderr=subprocess.PIPE):
    """Run a script, whose jobs end with it; give its exit code and what it printed."""
    process = subprocess.Popen(
        ["bash", "-c", script], cwd=folder, env={**os.environ, **environment}, start_new_session=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=stderr,
    )  # fmt: skip
    try:
        printed = process.communicate(timeout=timeout)
    finally:
        # a script that hangs must not leave its jobs; without a hang the session is empty by now
        subprocess.run(["pkill", "-KILL", "-s", str(process.pid)], check=False)
        process.wait()
    return process.returncode, b"".join(filter(None, printed)).decode("utf-8", "replace")


def python(code, *words, **options):
    """Run code in a process."""
    return ran([sys.executable, "-c", dedent(code), *words], **options)
