"""Where a campaign runs: processes on this machine by default, or the workers of a Dask scheduler on many.

Each worker diagnoses one rig at a time on one core: rigs are independent, so more rigs at once use the cores better
than more threads per rig.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from logging import CRITICAL
from typing import TYPE_CHECKING

from heli_identifier.drafts import draft_folder
from heli_identifier.errors import ConfigurationError
from heli_identifier.workbench.campaign.key import code_digest

if TYPE_CHECKING:
    from distributed import Client

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Environment of a worker process; linear-algebra libraries read it once, when they are loaded."""

MOST_WORKERS = 1000
"""Processes that are started on one machine at most."""

CONNECTING = 60.0
"""Time limit [s] for a scheduler to answer, and then for its first worker."""


def require_packages() -> None:
    """Check that the optional packages are installed.

    Raises
    ------
    ConfigurationError
        One is missing; the message says how to install it.
    """
    missing = [name for name in ("distributed", "pyarrow") if find_spec(name) is None]
    if missing:
        raise ConfigurationError(
            f"a campaign needs Dask and pyarrow, and {' and '.join(missing)} cannot be found; install both with "
            "pip install 'heli-twin[cluster]'."
        )


def check_workers(scheduler: str | None, workers: int | None) -> None:
    """Refuse a number of processes that cannot be started.

    Raises
    ------
    ConfigurationError
        It is below 1, above `MOST_WORKERS`, or given with a scheduler.
    """
    if workers is None:
        return
    if scheduler is not None:
        raise ConfigurationError(f"workers = {workers} is for processes on this machine; {scheduler} has its own.")
    if not 1 <= workers <= MOST_WORKERS:
        raise ConfigurationError(f"workers = {workers} must lie in [1, {MOST_WORKERS}].")


@contextmanager
def client(scheduler: str | None = None, workers: int | None = None) -> "Iterator[Client]":
    """Connect to a cluster; one that was started here is closed at the end.

    Parameters
    ----------
    scheduler : str, optional
        Address of a running scheduler, "tcp://host:8786"; without it processes are started on this machine.
    workers : int, optional
        Number of processes to start; one per core if not given.

    Yields
    ------
    distributed.Client

    Raises
    ------
    ConfigurationError
        No scheduler answers, it has no worker, or its workers run another version of this software.
    """
    require_packages()
    check_workers(scheduler, workers)
    if scheduler is None:
        with _local(workers if workers is not None else os.cpu_count() or 1) as local:
            yield local
        return
    with _remote(scheduler) as remote:
        yield remote


RESTART = {"distributed.deploy.lost-worker-timeout": "1 day", "distributed.scheduler.no-workers-timeout": "10 minutes"}
"""How long a worker that has died may take to come back.

Dask looks 15 s after the death of a worker whether there is one, and otherwise gives its place up for good. On a busy
machine, where a start takes seconds, it may find it between two deaths; without a worker a campaign would never end.
Should there be none for a long time all the same, the rigs that wait for one fail, with a row that says so.
"""


@contextmanager
def _local(workers: int) -> "Iterator[Client]":
    import dask
    from distributed import Client, LocalCluster

    with (
        draft_folder() as scratch,
        # The scheduler makes its folder, too; that of the workers is named below.
        dask.config.set(
            {"distributed.nanny.pre-spawn-environ": ONE_THREAD, "temporary-directory": str(scratch), **RESTART}
        ),
        # No memory limit: pausing a diagnosis would not reduce the memory that it needs.
        # Any free port for Dask's own pages: two campaigns may run at once.
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            memory_limit=0,
            dashboard_address=":0",
            silence_logs=CRITICAL,
            local_directory=str(scratch),
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
    """Refuse workers whose code differs: their rows would be taken for results of this version."""
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
