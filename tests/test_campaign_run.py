"""Campaign on a cluster of processes: every rig once, whatever is killed; a restart repeats nothing that is done."""

import json
import os
import signal
import subprocess
import sys
from collections import Counter
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from heli_identifier.errors import ConfigurationError
from heli_identifier.records import Log, demo_logs, read_log, write_log
from heli_identifier.tools import CONSOLIDATED, GeneratedRig, Rig, TrueEffect, Truth, campaign, read_rows, run_campaign
from heli_identifier.tools.campaign import diagnosed
from heli_identifier.tools.rigs import digest_once
from heli_identifier.tracing import DiagnosisSettings

RIGS = 8

# What a worker does here in place of a diagnosis: it notes who begins and ends what, and takes its time.
STAND_IN = """
import os, time
from pathlib import Path

def work(source, settings, measure):
    seed, folder, seconds, first = source.arguments
    if not list(Path(folder).glob(f"began.{seed}.*")):
        seconds = first
    mark = f"{seed}.{os.getpid()}.{time.time_ns()}"
    (Path(folder) / f"began.{mark}").touch()
    if seed < 0:
        os.kill(os.getpid(), 9)
    time.sleep(seconds)
    (Path(folder) / f"ended.{mark}").touch()
    return {"rig": source.rig, "verdict": "model adequate", "effects": [], "seconds": seconds}
"""


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Give work for the workers, and a function that tells (event, seed, process) of all they noted."""
    name = f"stand_in_{tmp_path.name}"
    (tmp_path / f"{name}.py").write_text(STAND_IN)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "marks").mkdir()

    def sources(seeds, seconds, first=None):
        """Rigs that take some seconds, the first time as many as ``first`` says of a seed."""
        marks = str(tmp_path / "marks")
        return [
            GeneratedRig(f"rig {seed}", f"{name}:work", (seed, marks, seconds, (first or {}).get(seed, seconds)))
            for seed in seeds
        ]

    def noted():
        marks = sorted((tmp_path / "marks").iterdir(), key=lambda path: path.name.split(".")[3])
        return [(event, int(seed), int(process)) for event, seed, process, _ in (p.name.split(".") for p in marks)]

    return SimpleNamespace(work=import_module(name).work, sources=sources, noted=noted, folder=tmp_path / "results")


def test_killed_worker_costs_no_result_and_doubles_none(stand_in):
    killed, done_before = [], []

    def kill_the_one_at_work(done, total, row):
        if done == 3:
            done_before.extend((stand_in.folder / "rows").iterdir())
            # Rig 0 was given out first and is at work for a minute, if it is the first time.
            ((_, process),) = {(seed, by) for event, seed, by in stand_in.noted() if (event, seed) == ("began", 0)}
            killed.append(process)
            os.kill(process, signal.SIGKILL)

    rows = run_campaign(
        stand_in.sources(range(RIGS), 0.2, {0: 60.0}), stand_in.folder, workers=2, progress=kill_the_one_at_work,
        work=stand_in.work,
    )  # fmt: skip
    assert [row["rig"] for row in rows] == [f"rig {seed}" for seed in range(RIGS)]
    assert all(row["error"] is None for row in rows)
    assert len(list((stand_in.folder / "rows").iterdir())) == RIGS
    assert read_rows(stand_in.folder / CONSOLIDATED) == rows
    # Only the rig that the dead process was at was begun again, in another process, and each was ended once.
    assert len(done_before) == 3
    assert Counter(seed for event, seed, _ in stand_in.noted() if event == "began") == Counter([0, *range(RIGS)])
    ended = [(seed, by) for event, seed, by in stand_in.noted() if event == "ended"]
    assert sorted(seed for seed, _ in ended) == list(range(RIGS))
    assert dict(ended)[0] not in killed


def test_restart_makes_only_what_is_missing(stand_in):
    first = run_campaign(stand_in.sources(range(3), 0.0), stand_in.folder, workers=1, work=stand_in.work)
    (stand_in.folder / "rows" / f"{first[1]['key']}.parquet").unlink()
    told = []
    again = run_campaign(
        stand_in.sources(range(4), 0.0), stand_in.folder, workers=1, work=stand_in.work,
        progress=lambda done, total, row: told.append((done, total)),
    )  # fmt: skip
    assert again[:3] == first
    assert Counter(seed for event, seed, _ in stand_in.noted() if event == "ended") == {0: 1, 1: 2, 2: 1, 3: 1}
    assert told == [(2, 4), (3, 4), (4, 4)]
    # With nothing left to do no cluster is started: this call would fail on the scheduler that is not there.
    assert run_campaign(stand_in.sources(range(4), 0.0), stand_in.folder, scheduler="tcp://127.0.0.1:1") == again


def test_rig_that_kills_every_worker_fails_alone_and_is_tried_again(stand_in):
    bad, good = run_campaign(stand_in.sources((-1, 1), 0.0), stand_in.folder, workers=1, work=stand_in.work)
    assert "KilledWorker" in bad["error"]
    assert (bad["rig"], bad["verdict"]) == ("rig -1", None)
    assert good["verdict"] == "model adequate"
    attempts = sum(seed == -1 for _, seed, _ in stand_in.noted())
    run_campaign(stand_in.sources((-1, 1), 0.0), stand_in.folder, workers=1, work=stand_in.work)
    assert sum(seed == -1 for _, seed, _ in stand_in.noted()) > attempts
    assert sum(seed == 1 for event, seed, _ in stand_in.noted() if event == "ended") == 1


@pytest.mark.slow
def test_a_worker_that_takes_long_to_come_back_is_waited_for(stand_in):
    """As on a busy machine: each start takes 5 s more, so that 15 s after its first death it is away again."""
    import dask

    with dask.config.set({"distributed.worker.preload": ["import time; time.sleep(5.0)\n"]}):
        bad, good = run_campaign(stand_in.sources((-1, 1), 0.0), stand_in.folder, workers=1, work=stand_in.work)
    assert "KilledWorker" in bad["error"] and good["verdict"] == "model adequate"


def test_two_rigs_of_one_name_are_refused(stand_in):
    with pytest.raises(ConfigurationError, match="'rig 1'"):
        run_campaign(stand_in.sources((1, 1), 0.0), stand_in.folder)


@pytest.mark.parametrize(
    "options, said",
    [
        ({"workers": 0}, "workers = 0"),
        ({"scheduler": "tcp://127.0.0.1:1", "workers": 2}, "has its own"),
        ({"scheduler": "tcp://127.0.0.1:1"}, "no Dask scheduler answers at tcp://127.0.0.1:1"),
    ],
)
def test_cluster_that_cannot_be_had_is_refused_in_a_sentence(stand_in, monkeypatch, options, said):
    monkeypatch.setattr(campaign, "CONNECTING", 1.0)
    with pytest.raises(ConfigurationError, match=said):
        run_campaign(stand_in.sources((1,), 0.0), stand_in.folder, **options)


def test_scheduler_that_runs_already_is_used_and_left_running(stand_in):
    from distributed import Client, LocalCluster

    digest_once.cache_clear()  # of this process, which may be older than a source that was saved since
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as machines:
        rows = run_campaign(
            stand_in.sources(range(3), 0.0), stand_in.folder, scheduler=machines.scheduler_address, work=stand_in.work
        )
        with Client(machines) as still:
            assert len(still.nthreads()) == 2
    assert [row["verdict"] for row in rows] == ["model adequate"] * 3


def test_workers_of_another_version_are_refused(stand_in, monkeypatch, request):
    from distributed import LocalCluster

    # As if this process had fewer packages; a worker digests all that it has itself.
    monkeypatch.setattr(campaign, "CODE", ("heli_plant",))
    digest_once.cache_clear()
    request.addfinalizer(digest_once.cache_clear)
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as machines,
        pytest.raises(ConfigurationError, match="another version of this software"),
    ):
        run_campaign(stand_in.sources((1,), 0.0), stand_in.folder, scheduler=machines.scheduler_address)


def test_scheduler_without_a_worker_is_refused_with_the_command_that_starts_one(stand_in, monkeypatch):
    from distributed import LocalCluster

    monkeypatch.setattr(campaign, "CONNECTING", 10.0)  # a busy machine needs its time to connect
    with (
        LocalCluster(n_workers=0, dashboard_address=":0") as machines,
        pytest.raises(ConfigurationError, match="has no worker; start some with `dask worker tcp://"),
    ):
        run_campaign(stand_in.sources((1,), 0.0), stand_in.folder, scheduler=machines.scheduler_address)


def test_missing_package_is_told_with_the_command_that_installs_it(stand_in, monkeypatch):
    for package in ("distributed", "pyarrow"):
        monkeypatch.setitem(sys.modules, package, None)  # Python's way to say that a package is not there
    with pytest.raises(ConfigurationError, match=r"distributed and pyarrow cannot be found; .*heli-twin\[cluster\]"):
        run_campaign(stand_in.sources((1,), 0.0), stand_in.folder)


# --- the work itself ---------------------------------------------------------------------------------------------


class Given:
    """A source that has its rig already, or an error in its place."""

    rig = "given"

    def __init__(self, loaded):
        self.loaded = loaded

    def load(self):
        if isinstance(self.loaded, Exception):
            raise self.loaded
        return self.loaded


def still_rig(truth):
    """A rig that nothing drives: its diagnosis ends with an error."""
    logs = [Log(name, 100.0, np.zeros((400, 2)), np.zeros((400, 3))) for name in ("train", "held")]
    return Rig((logs[0],), (logs[1],), truth)


def test_truth_stands_beside_a_failed_diagnosis_and_changes_nothing_of_it():
    truth = Truth("dry_friction", {"a_wx": 0.06}, (TrueEffect("dry_friction", "pitch", 0.02),))
    with_truth, without = (diagnosed(Given(still_rig(one)), DiagnosisSettings()) for one in (truth, None))
    assert (with_truth["true_kind"], with_truth["true_a_wx"]) == ("dry_friction", 0.06)
    assert with_truth["error"] == without["error"] != ""


def test_error_that_nobody_foresaw_is_told_with_its_place():
    row = diagnosed(Given(ZeroDivisionError("nothing moves")), DiagnosisSettings())
    assert row["error"].startswith("ZeroDivisionError: nothing moves (in load, test_campaign_run.py line ")


def test_folder_of_rigs_is_diagnosed_from_the_command_line_and_a_bad_one_is_listed(tmp_path):
    training, held = demo_logs("rig-a")
    for name in ("a", "b"):
        (tmp_path / "rigs" / name).mkdir(parents=True)
    for path in (training[0], held[0]):
        # Half a minute of two logs is enough to see what a row holds, in a few seconds.
        write_log(read_log(path, end=30.0), tmp_path / "rigs" / "a" / path.name)
    (tmp_path / "rigs" / "b" / "train.csv").write_text("not a log\n")
    (tmp_path / "rigs" / "b" / "held.csv").write_text("not a log\n")
    done = heli("campaign", tmp_path / "rigs", "--output", tmp_path / "out", "--workers", 1, "--json")
    assert done.returncode == 1, done.stderr
    summary = json.loads(done.stdout)
    ((rig, error),) = summary["failures"]
    assert rig == "b"
    assert "train.csv" in error
    good, bad = read_rows(tmp_path / "out" / CONSOLIDATED)
    assert good["error"] is None
    assert bad["error"] == error
    assert good["verdict"] in ("effects shown", "model adequate", "unknown effect")
    assert good["a_th"] > 10.0 * good["a_th_se"] > 0.0
    # A second later the pitch is where the model says, to a small part of the .1 rad that it moves by.
    assert 0.0 < good["pitch_1s_noise_floor_rad"] <= 1.5 * good["pitch_1s_after_rad"] < 0.03
    assert good["true_kind"] is None


@pytest.mark.parametrize(
    "words, said",
    [
        ((), "either a folder of rigs or a --generator"),
        (("rigs", "--rigs", "3"), "--rigs 3 is for a --generator"),
        (("rigs", "--first-seed", "5"), "--first-seed 5 is for a --generator"),
        (("--generator", "json:loads"), "--rigs"),
        (("nowhere",), "nowhere is no folder"),
    ],
)
def test_command_that_makes_no_sense_gets_one_sentence_and_exit_2(tmp_path, words, said):
    done = heli("campaign", *words, folder=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def heli(*words, folder=None):
    command = [sys.executable, "-c", "from heli_identifier.cli import main; main()", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=folder, check=False)
