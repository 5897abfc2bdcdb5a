"""The command line ``heli``: commands on logs, on units, and in flight, over what every command shares.

Whatever takes time to import is imported inside the functions that need it: ``heli --help`` answers at once.
"""

import atexit
import gc
import os
import sys


def main() -> None:
    """Run the command line."""
    # The matrices here are small: threads of the linear algebra get in each other's way (measured: five times slower).
    # It reads this when it is first imported.
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
        os.environ.setdefault(name, "1")
    # Processes that libraries start from here take no file of the working folder for a module.
    os.environ.setdefault("PYTHONSAFEPATH", "1")
    # What a command makes is mostly in use until it ends. Looking for cycles at every 700th object is a twentieth of a
    # diagnosis, and at the end, in everything that was ever imported, half a second.
    gc.set_threshold(60_000, 10, 10)
    atexit.register(gc.freeze)
    if not sys.warnoptions:  # remarks of libraries to programmers; `python -W` shows them
        import warnings

        warnings.simplefilter("ignore")
    from heli_identifier.cli.terminal import open_streams

    flush = open_streams()
    from heli_identifier.cli.app import app

    code: object = 0
    try:
        app()
    except SystemExit as end:
        code = end.code
    problem = flush()
    if problem is not None:
        print(f"heli: standard output cannot be written: {problem}.", file=sys.stderr)
        code = 2
    sys.exit(code)  # type: ignore[arg-type]
