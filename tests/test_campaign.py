"""Campaigns: where rigs come from, one row per rig whatever is killed, and what the rows say together."""

import io
import json
import os
from collections import Counter
from functools import partial
from importlib import import_module
from types import SimpleNamespace

import pandas as pd
import pytest

import heli_identifier
from heli_identifier import tools
from heli_identifier.errors import ConfigurationError
from heli_identifier.tools.campaign import parquet_bytes


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


# What a worker does here in place of a diagnosis: it notes who begins and ends what. The first process that works on
# rig 0 kills itself, and every one that works on rig -1.
MODULE = """
import os, time
from pathlib import Path

def work(source):
    seed, folder = source.load()
    is_first = not list(Path(folder).glob(f"began.{seed}.*"))
    mark = f"{seed}.{os.getpid()}.{time.time_ns()}"
    (Path(folder) / f"began.{mark}").touch()
    if seed < 0 or (seed == 0 and is_first):
        os.kill(os.getpid(), 9)
    (Path(folder) / f"ended.{mark}").touch()
    return {"rig": source.rig, "verdict": "model adequate", "effects": []}
"""


def test_a_folder_that_is_none_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigurationError, match="file is a file, a folder is needed there"):
        tools.run_campaign([], tmp_path / "file")


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Run campaigns of work that only notes itself, and tell (event, seed) of all that the workers noted."""
    name = f"made_{tmp_path.name}"  # another module for every test
    (tmp_path / f"{name}.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)  # of the processes
    (tmp_path / "marks").mkdir()
    marks, folder, work = str(tmp_path / "marks"), tmp_path / "results", import_module(name).work

    def run(seeds, **options):
        sources = [tools.Source(f"rig {seed}", partial(tuple, (seed, marks)), str) for seed in seeds]
        return tools.run_campaign(sources, folder, work=work, **options)

    def noted(event):
        return Counter(int(path.name.split(".")[1]) for path in (tmp_path / "marks").glob(f"{event}.*"))

    return SimpleNamespace(run=run, noted=noted, folder=folder)


def test_killed_process_costs_no_result_and_doubles_none_and_a_restart_makes_only_what_is_missing(stand_in):
    rows = stand_in.run(range(4), workers=2)
    assert [(row["rig"], row["error"]) for row in rows] == [(f"rig {seed}", None) for seed in range(4)]
    # only the rig that the dead process was at was begun again, and each was ended once
    assert (stand_in.noted("began"), stand_in.noted("ended")) == (Counter([0, *range(4)]), Counter(range(4)))
    stored = [stand_in.folder / "rows" / f"rig {seed}.json" for seed in range(4)]
    assert sorted((stand_in.folder / "rows").iterdir()) == stored
    assert list(pd.read_parquet(stand_in.folder / tools.CONSOLIDATED)["rig"]) == [row["rig"] for row in rows]
    stored[1].unlink()
    stored[2].write_text("torn")
    told = []
    again = stand_in.run(range(5), workers=1, progress=lambda what, share: told.append(what))
    assert again[:4] == rows and stand_in.noted("ended") == Counter([1, 2, *range(5)])
    assert told == [f"{done} of 5 rigs diagnosed" for done in (2, 3, 4, 5)]
    # with nothing left to do no cluster is asked: this scheduler is not there
    assert stand_in.run(range(5), scheduler="tcp://127.0.0.1:1") == again


def test_rig_that_kills_every_process_fails_alone_and_is_tried_again_by_a_restart(stand_in):
    told = []
    bad, good = stand_in.run((-1, 1), workers=1, progress=lambda what, share: told.append(what))
    assert "its process was ended by signal 9 (Killed)" in bad["error"] and good["error"] is None
    assert told[-1] == "1 of 2 rigs diagnosed, 1 failed" and stand_in.noted("began") == Counter([-1, -1, 1])
    assert stand_in.run((-1, 1))[1] == good and stand_in.noted("began") == Counter([-1, -1, -1, -1, 1])


@pytest.mark.slow
def test_scheduler_that_runs_already_is_used_and_left_running_but_not_one_of_another_version(stand_in, monkeypatch):
    from distributed import Client, LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as machines:
        address = machines.scheduler_address
        assert [row["verdict"] for row in stand_in.run(range(2), scheduler=address)] == ["model adequate"] * 2
        with Client(machines) as still:
            assert len(still.nthreads()) == 1
        # A worker digests its own packages.
        monkeypatch.setattr(tools.campaign, "heli_plant", heli_identifier)
        with pytest.raises(ConfigurationError, match="another version of this software"):
            stand_in.run((5,), scheduler=address)


def test_what_ends_before_the_first_result_leaves_no_folder(stand_in):
    def ended(what, share):
        raise KeyboardInterrupt

    for seeds, options, kind, said in (
        ((1,), {"progress": ended}, KeyboardInterrupt, None),
        ((1,), {"scheduler": "nonsense"}, ConfigurationError, "no Dask scheduler answers at nonsense"),
    ):
        with pytest.raises(kind, match=said):
            stand_in.run(seeds, **options)
    assert not stand_in.folder.exists()


def test_missing_package_is_told_with_the_command_that_installs_it(monkeypatch, tmp_path):
    monkeypatch.setattr(tools.campaign, "find_spec", lambda name: None if name == "distributed" else name)
    with pytest.raises(ConfigurationError, match=r"package distributed: .*heli-twin\[cluster\]"):
        tools.run_campaign([], tmp_path, scheduler="tcp://lab:8786")


FRICTION = {"name": "dry_friction", "axis": "pitch", "coefficient": {"value": 0.02, "standard_error": 0.001}}
LAG = {"name": "motor_lag", "axis": "rotors", "coefficient": None}
BAD = {"rig": "bad", "error": "unreadable", "seconds": 0.1}


def row(*effects, verdict="effects shown", **columns):
    return {"rig": "r", "error": None, "verdict": verdict, "effects": list(effects), "seconds": 2.0, **columns}


def test_the_table_has_every_column_whatever_the_rows_lack():
    whole = row(FRICTION, parameters_after={"a_wx": {"value": 0.061, "standard_error": 0.001, "unit": "1/s"}})
    rows = [whole, BAD, row()]
    table = pd.read_parquet(io.BytesIO(parquet_bytes(rows)))
    known = table["parameters_after_a_wx_value"]
    assert known[0] == 0.061 and known.isna()[1] and table["error"][1] == "unreadable"
    assert json.loads(table["effects"][0])[0]["name"] == "dry_friction"
    assert [*pd.read_parquet(io.BytesIO(parquet_bytes([row()])))][:3] == ["rig", "error", "verdict"]


def test_the_printed_table_counts_verdicts_and_effects():
    table = tools.campaign_table([row(FRICTION), row(LAG), row(LAG), row(verdict="model adequate"), BAD])
    counts = [("effects shown", "3"), ("model adequate", "1"), ("motor_lag rotors", "2"), ("dry_friction pitch", "1")]
    assert table.rows == counts and table.title == "4 of 5 rigs were diagnosed"
