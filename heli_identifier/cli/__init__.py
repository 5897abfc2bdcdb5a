"""The command line ``heli``, one file per command.

Whatever takes time to import is imported inside the functions that need it: ``heli --help`` answers at once.
"""

import atexit
import gc
import os
import sys

from heli_identifier.signals import ENDING, alarmed

_SINGLE_THREADED = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")

_LONGEST_END = 5.0
"""How long a command that was asked to end waits for its threads, whose results nobody needs [s]."""


def main() -> None:
    """Run the command line."""
    # The matrices here are small, and simulations already run side by side: threads of the linear algebra only get in
    # each other's way (measured: five times slower). They read this when they are first imported.
    for name in _SINGLE_THREADED:
        os.environ.setdefault(name, "1")
    # What a command makes is mostly in use until it ends: looking for cycles at every 700th object is a twentieth of a
    # diagnosis.
    gc.set_threshold(60_000, 10, 10)
    os.environ["MPLBACKEND"] = "agg"  # a command draws into files; another one, or one that there is not, may be set
    # At its end the interpreter looks for cycles in everything that was ever imported: half a second for nothing.
    atexit.register(gc.freeze)
    if not sys.warnoptions:  # remarks of libraries to programmers; `python -W` shows them
        import warnings

        warnings.simplefilter("ignore")
    from heli_identifier.cli import streams

    streams.install()
    from heli_identifier.cli.app import app

    code: object = 0
    try:
        app()
    except SystemExit as end:
        code = end.code
    problem = streams.flush()
    if problem is not None:
        print(f"heli: standard output cannot be written: {problem}.", file=sys.stderr)
        code = 2
    if code in {128 + number for number in ENDING}:
        alarmed(lambda *_: os._exit(code), _LONGEST_END)
    sys.exit(code)  # type: ignore[arg-type]
