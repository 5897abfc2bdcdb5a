"""Commands of `heli`, run in this process."""

from typer.testing import CliRunner

from heli_identifier.cli.app import app


def heli(*words, **options):
    """Run a command; its words may be paths and numbers."""
    return CliRunner().invoke(app, [*map(str, words)], **options)
