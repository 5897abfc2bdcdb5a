"""What the translator answers to a form of Python that it does not know: file, line, reason."""

from __future__ import annotations

from ...errors import BuildError


class Untranslatable(BuildError):
    """A function of the step path uses a form that has no translation to C."""

    def __init__(self, file: str, line: int, reason: str) -> None:
        super().__init__(f"{file}, line {line}: {reason}")
        self.file, self.line, self.reason = file, line, reason
