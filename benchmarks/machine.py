"""The machine, the moment and the packages that a section's figures were measured with."""

import os
import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

CPU_INFORMATION = Path("/proc/cpuinfo")


def processor(information: str) -> str:
    """Processor model as /proc/cpuinfo names it; else what Python knows."""
    for line in information.splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def machine() -> str:
    """Processor, cores, system and Python in a line."""
    information = CPU_INFORMATION.read_text() if CPU_INFORMATION.exists() else ""
    cores = os.cpu_count() or 1
    return (
        f"{processor(information)}, {cores} core{'s' if cores > 1 else ''}, {platform.system()} {platform.machine()}, "
        f"Python {platform.python_version()}"
    )


def versions(packages: Sequence[str]) -> str:
    """Name packages with their versions."""
    return ", ".join(f"{name} {_version(name)}" for name in packages)


def measured_at(packages: Sequence[str], load: float) -> str:
    """Give the line at the foot of a section: date, machine, load when it began, packages."""
    return f"{datetime.now(UTC):%Y-%m-%d}; {machine()}; load {load:.1f} at the start; {versions(packages)}."


def load() -> float:
    """Mean number of processes that ran or waited in the last minute; not a number where the system does not say."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
