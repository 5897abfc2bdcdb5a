"""A campaign: every rig of a list diagnosed once, whatever happens to workers or to the campaign itself.

Only the client writes results, each as it arrives, and then releases Dask's copy. A worker that dies loses at most the
rig that it was diagnosing, which Dask gives to another worker. A campaign that is stopped and started again continues
where it stopped; rigs that failed are tried again.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heli_identifier.errors import ConfigurationError
from heli_identifier.tracing import DiagnosisSettings
from heli_identifier.workbench.campaign.cluster import check_workers, client, require_packages
from heli_identifier.workbench.campaign.key import code_digest, result_key, source_digest
from heli_identifier.workbench.campaign.results import Results, complete
from heli_identifier.workbench.campaign.row import Row, diagnosed
from heli_identifier.workbench.campaign.sources import Source, named_function

if TYPE_CHECKING:
    from distributed import Client, Future

Work = Callable[[Source, DiagnosisSettings, str | None], Row]
Progress = Callable[[int, int, Row | None], None]
"""Called with the number of rigs done, the number in all, and the row that has just arrived, if any."""

TASK = "diagnose-"
"""Prefix of the name of a rig's task in Dask; its key follows."""


def run_campaign(
    sources: Sequence[Source],
    folder: str | Path,
    settings: DiagnosisSettings | None = None,
    measure: str | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    work: Work = diagnosed,
) -> list[Row]:
    """Diagnose every rig that has no result yet.

    Parameters
    ----------
    sources : sequence of Source
        Their names must differ.
    folder : path
        Folder of the results, see :class:`Results`.
    settings : DiagnosisSettings, optional
    measure : str, optional
        "module:function" of further figures, see :func:`diagnosed`.
    scheduler, workers
        Where to run; see :func:`heli_identifier.workbench.campaign.cluster.client`.
    progress : callable, optional
        Called after every result.
    work : callable, optional
        What a worker does with a source; see :func:`diagnosed`.

    Returns
    -------
    list of dict
        One row per source, in their order; also written to ``campaign.parquet``.

    Raises
    ------
    ConfigurationError
        Two rigs have the same name, an optional package is missing, or cluster or folder cannot be used.
    """
    require_packages()
    check_workers(scheduler, workers)  # before a folder is made
    settings, progress = settings or DiagnosisSettings(), progress or (lambda done, total, row: None)
    by_key = _keyed(sources, settings, measure)
    present = Path(folder).exists()
    results = Results(Path(folder))
    try:
        known = {key: row for key in by_key if (row := results.read(key)) and row["error"] is None}
        progress(len(known), len(by_key), None)
        waiting = {key: source for key, source in by_key.items() if key not in known}
        if waiting:
            with client(scheduler, workers) as connected:
                for row in _rows(connected, waiting, (settings, measure), work):
                    results.write(row)
                    known[row["key"]] = complete(row)
                    progress(len(known), len(by_key), row)
        rows = [known[key] for key in by_key]
        results.consolidate(rows)
        return rows
    finally:
        with suppress(OSError):  # folders that hold results stay
            results.rows.rmdir()
            if not present:
                results.folder.rmdir()


def _keyed(sources: Sequence[Source], settings: DiagnosisSettings, measure: str | None) -> dict[str, Source]:
    """Return the sources by the keys of their results."""
    twice = [name for name, count in Counter(source.rig for source in sources).items() if count > 1]
    if twice:
        raise ConfigurationError(f"two rigs are called {twice[0]!r}; every rig needs its own name.")
    code = code_digest()
    if measure:
        named_function(measure)
        code += f" {measure} {source_digest([measure.partition(':')[0]])}"
    return {result_key(source.rig, source.content(), settings, code): source for source in sources}


def _rows(connected: "Client", waiting: Mapping[str, Source], how: tuple[Any, ...], work: Work) -> Iterator[Row]:
    """Yield each row as it arrives.

    A worker gets one rig at a time: when a worker dies, Dask suspects every rig that it held, and gives up a rig that
    it has suspected four times.
    """
    from distributed import as_completed

    left, arriving = iter(waiting.items()), as_completed()

    def supply() -> None:
        free = max(1, len(connected.nthreads())) - arriving.count()
        for key, source in islice(left, max(0, free)):
            arriving.add(connected.submit(work, source, *how, key=f"{TASK}{key}", pure=False))

    supply()
    for future in arriving:
        row = _arrived(future, waiting)
        # While this process holds a future, Dask would compute its result again after the death of a worker.
        future.release()
        supply()
        yield row


def _arrived(future: "Future", waiting: Mapping[str, Source]) -> Row:
    """Return the row of a task that has ended, with a result or not."""
    key = str(future.key).removeprefix(TASK)
    if future.cancelled():
        raise ConfigurationError(
            "the scheduler went away; the results so far are kept, and the same command continues from there."
        )
    try:
        row = future.result()
    except Exception as error:
        row = {"rig": waiting[key].rig, "error": f"{type(error).__name__}: {error}"}
    return row | {"key": key}
