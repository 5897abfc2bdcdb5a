"""Where a campaign runs: processes on this machine by default, or the workers of a Dask scheduler on many.

One rig at a time per worker, on one core: rigs are independent, so cores are better spent on further rigs than on one.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from logging import CRITICAL
from typing import TYPE_CHECKING

from heli_identifier.errors import ConfigurationError
from heli_identifier.workbench.campaign.key import code_digest

if TYPE_CHECKING:
    from distributed import Client

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Environment of a worker process; a linear-algebra library reads it once, when it is loaded."""

CONNECTING = 20.0
"""Time [s] that a scheduler has to answer, and then its first worker to be there."""


def require_packages() -> None:
    """Refuse to begin where the optional packages are missing.

    Raises
    ------
    ConfigurationError
        Names them and how to install them.
    """
    missing = [name for name in ("distributed", "pyarrow") if find_spec(name) is None]
    if missing:
        raise ConfigurationError(
            f"a campaign needs Dask and pyarrow, and {' and '.join(missing)} cannot be found; install both with "
            "pip install 'heli-twin[cluster]'."
        )


@contextmanager
def client(scheduler: str | None = None, workers: int | None = None) -> "Iterator[Client]":
    """Connect to a cluster, which is closed at the end if it is ours.

    Parameters
    ----------
    scheduler : str, optional
        Address of a running scheduler, "tcp://host:8786"; else processes are started on this machine.
    workers : int, optional
        How many processes to start; one per core if not given.

    Yields
    ------
    distributed.Client

    Raises
    ------
    ConfigurationError
        If no scheduler answers, it has no worker, or its workers run another version of this software.
    """
    require_packages()
    if scheduler is None:
        with _local(workers if workers is not None else os.cpu_count() or 1) as local:
            yield local
        return
    if workers is not None:
        raise ConfigurationError(f"workers = {workers} is for processes on this machine; {scheduler} has its own.")
    with _remote(scheduler) as remote:
        yield remote


@contextmanager
def _local(workers: int) -> "Iterator[Client]":
    import dask
    from distributed import Client, LocalCluster

    if workers < 1:
        raise ConfigurationError(f"workers = {workers} must be at least 1.")
    with (
        dask.config.set({"distributed.nanny.pre-spawn-environ": ONE_THREAD}),
        # No memory limit: a diagnosis needs what it needs, and pausing it would not make that less.
        # Any free port for Dask's own pages: two campaigns may run at once.
        LocalCluster(
            n_workers=workers, threads_per_worker=1, memory_limit=0, dashboard_address=":0", silence_logs=CRITICAL
        ) as cluster,
        Client(cluster) as connected,
    ):
        yield connected


@contextmanager
def _remote(scheduler: str) -> "Iterator[Client]":
    from distributed import Client

    try:
        connected = Client(scheduler, timeout=CONNECTING)
    except (OSError, ValueError) as error:
        raise ConfigurationError(
            f"no Dask scheduler answers at {scheduler}; start one with `dask scheduler` and give its tcp:// address."
        ) from error
    with connected:
        try:
            connected.wait_for_workers(1, timeout=CONNECTING)
        except TimeoutError:
            raise ConfigurationError(
                f"the scheduler at {scheduler} has no worker; start some with "
                f"`dask worker {scheduler} --nthreads 1 --nworkers -1`."
            ) from None
        _check_versions(connected)
        yield connected


def _check_versions(connected: "Client") -> None:
    """Refuse workers whose code differs: their rows would pass for results of this version."""
    try:
        digests = connected.run(code_digest)
    except ImportError as error:
        raise ConfigurationError(
            f"a worker cannot import {error.name}; install this software, with its cluster extra, on every machine."
        ) from error
    others = sorted(worker for worker, digest in digests.items() if digest != code_digest())
    if others:
        raise ConfigurationError(
            f"the worker at {others[0]} runs another version of this software ({len(others)} of {len(digests)} do); "
            "install the same one on every machine."
        )
