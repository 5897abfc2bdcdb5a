"""The command line ``heli``: commands on logs, rigs, plants and units, and in flight.

Modules that take long to import are imported inside the functions that need them, so that ``heli --help`` is fast.
"""

import atexit
import gc
import os
import sys


def main() -> None:
    """Run the command line."""
    # The matrices are small: several threads of the linear algebra are slower than one (measured: five times). The
    # libraries read these variables when they are first imported.
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
        os.environ.setdefault(name, "1")
    # Processes that libraries start do not import files of the working folder as modules.
    os.environ.setdefault("PYTHONSAFEPATH", "1")
    # Most objects of a command are used until it ends. A search for cycles after every 700 objects takes a twentieth of
    # a diagnosis; the last one, over everything that was imported, half a second.
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
