"""How large the program is: lines and files of every folder, beside what it is to become. `make size` prints it."""

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

FOLDERS = {
    "heli_plant": 2000, "heli_identifier/records": 1600, "heli_identifier/tracing": 3800,
    "heli_identifier/online": 2400, "heli_identifier/following": 1500, "heli_identifier/live": 1000,
    "heli_identifier/results": 2000, "heli_identifier/tools": 2600, "heli_identifier/cli": 1100,
    "heli_identifier/chain": 0, "heli_identifier/*.py": 250,
    "fmu_src": 5000, "fmu_src/**/*.[ch]": 2300, "benchmarks": 2500, "tests": 14_000,
}  # fmt: skip
"""Folder or files, and the lines that they are to have at most."""


def size(files: str) -> tuple[int, int]:
    """Return the lines and the number of files of a folder, or of a pattern."""
    paths = ROOT.glob(files if "*" in files else f"{files}/**/*.py")
    lines = [len(path.read_bytes().splitlines()) for path in paths]
    return sum(lines), len(lines)


if __name__ == "__main__":
    print(f"{'folder':<40}{'lines':>8}{'files':>8}{'target':>8}")
    for folder, target in FOLDERS.items():
        print("{:<40}{:>8}{:>8}{:>8}".format(folder, *size(folder), target))
    packages = map(sum, zip(*map(size, ("heli_plant", "heli_identifier", "fmu_src")), strict=True))
    print("{:<40}{:>8}{:>8}{:>8}  at most {} files".format("all packages", *packages, 24_000, 200))
