"""The command line ``heli``, one file per command.

Whatever takes time to import is imported inside the functions that need it: ``heli --help`` answers at once.
"""

import atexit
import gc
import os

_SINGLE_THREADED = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def main() -> None:
    """Run the command line."""
    # The matrices here are small, and simulations already run side by side: threads of the linear algebra only get in
    # each other's way (measured: five times slower). They read this when they are first imported.
    for name in _SINGLE_THREADED:
        os.environ.setdefault(name, "1")
    # At its end the interpreter looks for cycles in everything that was ever imported: half a second for nothing.
    atexit.register(gc.freeze)
    from heli_identifier.workbench.commands.app import app

    app()
