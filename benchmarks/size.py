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

PACKAGES = ("heli_plant", "heli_identifier", "fmu_src")
MOST_LINES, MOST_FILES = 24_000, 200
"""Of the Python of all packages together."""


def size(folder: str, pattern: str) -> tuple[int, int]:
    """Give lines and files of a folder."""
    lines = [len(file.read_bytes().splitlines()) for file in (ROOT / folder).glob(pattern)]
    return sum(lines), len(lines)


def main() -> None:
    """Print the table."""
    print(f"{'folder':<40}{'lines':>8}{'files':>8}{'target':>8}")
    for folder, pattern, target in FOLDERS:
        lines, files = size(folder, pattern)
        print(f"{f'{folder}/{pattern}':<40}{lines:>8}{files:>8}{target:>8}")
    lines, files = (sum(counts) for counts in zip(*(size(name, "**/*.py") for name in PACKAGES), strict=True))
    print(f"{'all packages':<40}{lines:>8}{files:>8}{MOST_LINES:>8}  at most {MOST_FILES} files")


if __name__ == "__main__":
    main()
