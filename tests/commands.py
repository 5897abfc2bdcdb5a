"""Commands of `heli` in this process, and programs in processes of their own."""

import json
import os
import subprocess
import sys
from textwrap import dedent

from typer.testing import CliRunner

from heli_identifier.cli.app import app

HELI = "from heli_command import main; main()"
"""Code of the command `heli`."""


def heli(*words, **options):
    """Run a command; its words may be paths and numbers."""
    return CliRunner().invoke(app, [*map(str, words)], **options)


def heli_json(*words):
    """Run a command with --json, which has to succeed, and return its output."""
    result = heli(*words, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def run_program(command, exit_code=0, timeout=1200, **options):
    """Run a program, which has to end with the ``exit_code``; its words may be paths and numbers."""
    words = [*map(str, command)]
    result = subprocess.run(words, capture_output=True, text=True, check=False, timeout=timeout, **options)
    assert result.returncode == exit_code, f"code {result.returncode}: {result.stdout[-2000:]}{result.stderr[-4000:]}"
    return result


def run_bash(script, folder, environment, timeout, stderr=subprocess.PIPE):
    """Run a script, whose jobs end with it; return its exit code and its output."""
    process = subprocess.Popen(
        ["bash", "-c", script], cwd=folder, env={**os.environ, **environment}, start_new_session=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=stderr,
    )  # fmt: skip
    try:
        printed = process.communicate(timeout=timeout)
    finally:
        # the jobs of a script that hangs must end; without a hang the session is empty now
        subprocess.run(["pkill", "-KILL", "-s", str(process.pid)], check=False)
        process.wait()
    return process.returncode, b"".join(filter(None, printed)).decode("utf-8", "replace")


def run_python(code, *words, **options):
    """Run Python code in a process of its own."""
    return run_program([sys.executable, "-c", dedent(code), *words], **options)
