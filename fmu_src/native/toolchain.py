"""Compilers of the native units: ziglang from PyPI, which compiles for every platform, or the system's own.

Every product and sum is rounded by itself (``-ffp-contract=off``): with contraction most results would differ from
CPython's in the last bits.
"""

from __future__ import annotations

import importlib.util
import platform
import shutil
import subprocess
import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from heli_identifier.files import draft_folder

from ..errors import BuildError

FLAGS = ("-std=c11", "-O2", "-ffp-contract=off", "-fvisibility=hidden", "-shared", "-s")
_ADVICE = "install a compiler: pip install 'heli-twin[native]', or gcc and gcc-mingw-w64 of the system"


class Platform(NamedTuple):
    """A platform: its folder in FMI 2.0 and 3.0, the suffix of its libraries, and what compiles for it."""

    fmi2: str
    fmi3: str
    suffix: str
    zig_target: str
    system_compilers: tuple[str, ...] = ()
    flags: tuple[str, ...] = ("-fPIC",)


LINUX = Platform("linux64", "x86_64-linux", ".so", "x86_64-linux-gnu.2.17", ("gcc", "clang", "cc"))
WINDOWS = Platform(
    "win64", "x86_64-windows", ".dll", "x86_64-windows-gnu", ("x86_64-w64-mingw32-gcc",), ("-static-libgcc",)
)
MAC = Platform("darwin64", "x86_64-darwin", ".dylib", "x86_64-macos")
ARM_LINUX = Platform("", "aarch64-linux", ".so", "aarch64-linux-gnu.2.17", ("aarch64-linux-gnu-gcc",))
ARM_MAC = Platform("", "aarch64-darwin", ".dylib", "aarch64-macos")
PLATFORMS = (LINUX, WINDOWS)  # every native unit is compiled for these if there is a compiler
ALL_PLATFORMS = (*PLATFORMS, MAC, ARM_LINUX, ARM_MAC)  # FMI 2.0 has no name for those on ARM


def _machine() -> Platform | None:
    """Return the platform of this machine, or None if it is another one."""
    return {("linux", "x86_64"): LINUX, ("win32", "AMD64"): WINDOWS}.get((sys.platform, platform.machine()))


def find_compiler(target: Platform) -> list[str] | None:
    """Return the command that compiles for a platform, or None; binaries of ziglang run with older C libraries."""
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc", "-target", target.zig_target]
    names = target.system_compilers if target is not LINUX or _machine() is LINUX else ()
    compiler = next(filter(None, map(shutil.which, names)), None)
    return [compiler] if compiler else None


def missing_compilers(all_platforms: bool = False) -> str | None:
    """Return one sentence on the platforms without a compiler, or None."""
    targets = ALL_PLATFORMS if all_platforms else PLATFORMS
    missing = [target.fmi2 or target.fmi3 for target in targets if find_compiler(target) is None]
    if not missing:
        return None
    return f"there is no C compiler for {' and '.join(missing)}, the units hold sources for them only; {_ADVICE}."


def runs_here() -> bool:
    """Return whether the units are compiled for this machine."""
    machine = _machine()
    return machine is not None and find_compiler(machine) is not None


def compile_library(sources: Mapping[str, str], target: Platform, library: str) -> bytes:
    """Return the shared library of these sources for a platform, or raise BuildError with the compiler's message."""
    command = find_compiler(target) or []
    with draft_folder() as folder:
        for name, text in sources.items():
            Path(folder, name).write_text(text, encoding="utf-8")
        arguments = [*command, *FLAGS, *target.flags]
        if target is WINDOWS:
            arguments.append("-Wl,--no-insert-timestamp" if "ziglang" not in command else "-Wl,/Brepro")
        arguments += ["-o", library, *(name for name in sources if name.endswith(".c")), "-lm"]
        result = subprocess.run(arguments, cwd=folder, capture_output=True, text=True, check=False)
        if result.returncode != 0:
            reason = result.stderr.strip()[-1000:]
            raise BuildError(f"{command[0]} cannot compile {library}; build without native, or report this: {reason}")
        return Path(folder, library).read_bytes()


def compile_all(sources: Mapping[str, str], identifier: str, fmi: int, all_platforms: bool) -> dict[str, bytes]:
    """Return the libraries for every platform with a compiler, by their path in the FMU."""

    def entry(target: Platform) -> tuple[str, bytes]:
        name = f"{identifier}{target.suffix}"
        return f"binaries/{target.fmi2 if fmi == 2 else target.fmi3}/{name}", compile_library(sources, target, name)

    targets = [target for target in (ALL_PLATFORMS if all_platforms else PLATFORMS) if target.fmi2 or fmi == 3]
    with ThreadPoolExecutor() as pool:
        return dict(pool.map(entry, [target for target in targets if find_compiler(target) is not None]))
