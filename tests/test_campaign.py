"""Campaigns: where rigs come from, one row per rig whatever is killed, and what the rows say together."""

import io
import os
import signal
import sys
from collections import Counter
from dataclasses import replace
from functools import partial
from importlib import import_module
from types import SimpleNamespace

import dask
import pandas as pd
import pytest

from heli_identifier import tools
from heli_identifier.errors import ConfigurationError
from heli_identifier.tools.campaign import KEYS, parquet_bytes, read_row, summarise_rows
from heli_identifier.tools.rigs import source_digest
from heli_identifier.tracing import DiagnosisSettings
from tests.commands import run_python

SETTINGS = DiagnosisSettings()


def test_every_sub_folder_with_a_log_is_a_rig_whose_content_follows_every_byte_that_a_diagnosis_reads(tmp_path):
    files = "b/run1.mat b/run2.csv a/train.csv a/held1.csv a/heli.toml a/notes.txt notes/readme.txt other.csv lab.toml"
    for path in map(tmp_path.joinpath, files.split()):
        path.parent.mkdir(exist_ok=True)
        path.write_text(path.name)
    sources, empty = tools.find_rigs(tmp_path, tmp_path / "lab.toml")
    assert ([source.rig for source in sources], empty) == (["a", "b"], ["notes"])
    for source, own in zip(sources, (("train.csv", "held1.csv", "heli.toml"), ("run1.mat", "run2.csv")), strict=True):
        seen = {source.content()}
        (tmp_path / "a" / "notes.txt").write_text("nothing that a diagnosis reads")
        assert source.content() in seen
        for name in (*(f"{source.rig}/{file}" for file in own), *(("lab.toml",) if source.rig == "b" else ())):
            (tmp_path / name).write_text("other")
            assert source.content() not in seen
            seen.add(source.content())


# What a worker does here in place of a diagnosis: it notes who begins and ends what, and takes its time.
MODULE = """
import os, time
from pathlib import Path

def work(source, settings):
    seed, folder, seconds, first = source.load()
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
def module(tmp_path, monkeypatch):
    """Give the name of a module for work, another one for every test."""
    name = f"made_{tmp_path.name}"
    (tmp_path / f"{name}.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    return name


def test_a_result_has_the_name_of_its_settings_and_code_in_every_process(module, tmp_path):
    before = source_digest((module,))
    source_digest.cache_clear()
    (tmp_path / f"{module}.py").write_text(MODULE.replace("9", "8"))
    assert source_digest((module,)) != before
    other = run_python("import dask.base, heli_identifier as hi; print(dask.base.tokenize(hi.DiagnosisSettings()))")
    assert dask.base.tokenize(SETTINGS) == dask.base.tokenize(replace(SETTINGS)) == other.stdout.strip()
    assert dask.base.tokenize(replace(SETTINGS, voltage_limit=6.0)) != dask.base.tokenize(SETTINGS)


def test_results_and_folders_that_are_none_are_refused(tmp_path):
    torn = tmp_path / "k.json"
    torn.write_text("torn")
    for wrong, said in (
        (partial(read_row, torn), r"k\.json is not a result"),
        (partial(tools.run_campaign, [], torn), "k.json is a file, a folder is needed there"),
    ):
        with pytest.raises(ConfigurationError, match=said):
            wrong()


@pytest.fixture
def stand_in(module, tmp_path):
    """Run campaigns of work that takes some seconds, and tell (event, seed, process) of all that the workers noted."""
    (tmp_path / "marks").mkdir()
    marks, folder, work = str(tmp_path / "marks"), tmp_path / "results", import_module(module).work

    def run(seeds, seconds=0.0, first=None, **options):
        """Rigs that take some seconds, the first time as many as ``first`` says of a seed."""
        rigs = [(seed, marks, seconds, (first or {}).get(seed, seconds)) for seed in seeds]
        sources = [tools.Source(f"rig {own[0]}", partial(tuple, own), str) for own in rigs]
        return tools.run_campaign(sources, folder, work=work, **options)

    def noted(event):
        files = sorted((tmp_path / "marks").glob(f"{event}.*"), key=lambda path: path.name.split(".")[3])
        return [(int(seed), int(process)) for _, seed, process, _ in (path.name.split(".") for path in files)]

    return SimpleNamespace(run=run, noted=noted, folder=folder)


@pytest.mark.slow
def test_killed_worker_costs_no_result_and_doubles_none_and_a_restart_makes_only_what_is_missing(stand_in):
    killed = []

    def kill_the_one_at_work(what, share):
        if what == "3 of 8 rigs done":
            ((_, process),) = {own for own in stand_in.noted("began") if own[0] == 0}  # it takes a minute at first
            killed.append(process)
            os.kill(process, signal.SIGKILL)

    rows = stand_in.run(range(8), 0.2, {0: 60.0}, workers=2, progress=kill_the_one_at_work)
    assert [(row["rig"], row["error"]) for row in rows] == [(f"rig {seed}", None) for seed in range(8)]
    assert len(list((stand_in.folder / "rows").iterdir())) == 8
    assert list(pd.read_parquet(stand_in.folder / tools.CONSOLIDATED)["rig"]) == [row["rig"] for row in rows]
    # Only the rig that the dead process was at was begun again, in another process, and each was ended once.
    assert Counter(seed for seed, _ in stand_in.noted("began")) == Counter([0, *range(8)])
    assert sorted(seed for seed, _ in stand_in.noted("ended")) == list(range(8))
    assert dict(stand_in.noted("ended"))[0] not in killed
    (stand_in.folder / "rows" / f"{rows[1]['key']}.json").unlink()
    told = []
    again = stand_in.run(range(9), workers=1, progress=lambda what, share: told.append(what))
    assert [row["rig"] for row in again[:8]] == [row["rig"] for row in rows] and again[2:8] == rows[2:]
    assert Counter(seed for seed, _ in stand_in.noted("ended")) == Counter([1, *range(9)])
    assert told == ["7 of 9 rigs done", "8 of 9 rigs done", "9 of 9 rigs done"]
    # with nothing left to do no cluster is started: this scheduler is not there
    assert stand_in.run(range(9), scheduler="tcp://127.0.0.1:1") == again


@pytest.mark.slow
def test_rig_that_kills_every_worker_fails_alone_however_long_they_take_to_come_back(stand_in):
    """As on a busy machine: each start takes 5 s more, so that 15 s after its first death a worker is away again."""
    with dask.config.set({"distributed.worker.preload": ["import time; time.sleep(5.0)\n"]}):
        bad, good = stand_in.run((-1, 1), workers=1)
    assert "KilledWorker" in bad["error"]
    assert (bad["rig"], bad["verdict"], good["verdict"]) == ("rig -1", None, "model adequate")


@pytest.mark.slow
def test_scheduler_that_runs_already_is_used_and_left_running_but_not_one_of_another_version(
    stand_in, monkeypatch, request
):
    from distributed import Client, LocalCluster

    source_digest.cache_clear()  # of this process, which may be older than a source that was saved since
    request.addfinalizer(source_digest.cache_clear)
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as machines:
        address = machines.scheduler_address
        assert [row["verdict"] for row in stand_in.run(range(2), scheduler=address)] == ["model adequate"] * 2
        with Client(machines) as still:
            assert len(still.nthreads()) == 1
        # As if this process had fewer packages; a worker digests all that it has itself.
        monkeypatch.setattr(tools.campaign, "CODE", ("heli_plant",))
        with pytest.raises(ConfigurationError, match="another version of this software"):
            stand_in.run((5,), scheduler=address)


def test_what_ends_before_the_first_result_leaves_no_folder(stand_in):
    def ended(what, share):
        raise KeyboardInterrupt

    for seeds, options, kind, said in (
        ((1,), {"progress": ended}, KeyboardInterrupt, None),
        ((1, 1), {}, ConfigurationError, "two rigs are called 'rig 1'"),
        ((1,), {"scheduler": "tcp://127.0.0.1:1", "workers": 2}, ConfigurationError, "has its own"),
    ):
        with pytest.raises(kind, match=said):
            stand_in.run(seeds, **options)
    assert not stand_in.folder.exists()


def test_missing_package_is_told_with_the_command_that_installs_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)  # Python's way to say that a package is not there
    monkeypatch.delitem(sys.modules, "heli_identifier.tools.campaign")
    monkeypatch.delitem(vars(tools), "run_campaign", raising=False)
    with pytest.raises(ConfigurationError, match=r"package distributed; .*heli-twin\[cluster\]"):
        tools.run_campaign  # noqa: B018


FRICTION = {"name": "dry_friction", "axis": "pitch", "coefficient": {"value": 0.02, "standard_error": 0.001}}
LAG = {"name": "motor_lag", "axis": "rotors", "coefficient": None}


BAD = dict.fromkeys(KEYS) | {"rig": "bad", "error": "unreadable", "seconds": 0.1}


def row(*effects, verdict="effects shown", **columns):
    known = {"rig": "r", "key": "k", "verdict": verdict, "effects": list(effects), "seconds": 2.0}
    return dict.fromkeys(KEYS) | known | columns


def test_the_table_has_every_column_whatever_the_rows_lack():
    whole = row(FRICTION, parameters_after={"a_wx": {"value": 0.061, "standard_error": 0.001, "unit": "1/s"}})
    rows = [whole, BAD, row()]
    table = pd.read_parquet(io.BytesIO(parquet_bytes(rows)))
    known = table["parameters_after_a_wx_value"]
    assert known[0] == 0.061 and known.isna()[1] and table["error"][1] == "unreadable"
    assert table["effects"][0][0]["name"] == "dry_friction"


def test_summary_counts_verdicts_effects_and_failures_apart():
    rows = [row(FRICTION), row(LAG), row(LAG), row(verdict="model adequate")]
    summary = summarise_rows([*rows, BAD])
    assert summary["verdicts"] == {"effects shown": 3, "model adequate": 1, "unknown effect": 0}
    assert summary["effects"] == [("motor_lag rotors", 2), ("dry_friction pitch", 1)]
    assert (summary["rigs"], summary["failures"]) == (4, [("bad", "unreadable")])
