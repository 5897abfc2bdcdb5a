"""How large the program is: lines and files of every folder, beside what it is to become. `make size` prints it."""

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

FOLDERS = (
    ("heli_plant", "**/*.py", 2000),
    ("heli_identifier/records", "**/*.py", 1600),
    ("heli_identifier/tracing", "**/*.py", 3800),
    ("heli_identifier/online", "**/*.py", 2400),
    ("heli_identifier/following", "**/*.py", 1500),
    ("heli_identifier/live", "**/*.py", 1000),
    ("heli_identifier/results", "**/*.py", 2000),
    ("heli_identifier/tools", "**/*.py", 2600),
    ("heli_identifier/cli", "**/*.py", 1100),
    ("heli_identifier/chain", "**/*.py", 0),
    ("heli_identifier", "*.py", 250),
    ("fmu_src", "**/*.py", 5000),
    ("fmu_src", "**/*.[ch]", 2300),
    ("benchmarks", "**/*.py", 2500),
    ("tests", "**/*.py", 14000),
)
"""Folder, files that are counted, and the lines that it is to have at most."""


def size(folder: str, pattern: str = "**/*.py") -> tuple[int, int]:
    """Give lines and files of a folder."""
    lines = [len(file.read_bytes().splitlines()) for file in (ROOT / folder).glob(pattern)]
    return sum(lines), len(lines)


if __name__ == "__main__":
    print(f"{'folder':<40}{'lines':>8}{'files':>8}{'target':>8}")
    for folder, pattern, target in FOLDERS:
        print("{:<40}{:>8}{:>8}{:>8}".format(f"{folder}/{pattern}", *size(folder, pattern), target))
    packages = map(sum, zip(*map(size, ("heli_plant", "heli_identifier", "fmu_src")), strict=True))
    print("{:<40}{:>8}{:>8}{:>8}  at most {} files".format("all packages", *packages, 24_000, 200))
