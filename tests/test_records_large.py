"""A log of more rows than are read at once: nothing shows where the pieces meet."""

import gzip
import hashlib
import tracemalloc

import numpy as np
import pytest

from heli_identifier.errors import LogError
from heli_identifier.records import read_log, stream, survey

ROWS, RATE = 130_000, 200.0
HEADER = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]"


@pytest.fixture(scope="module")
def lines():
    t = np.arange(ROWS) / RATE
    columns = (t, 1.0 + 0.5 * np.sin(3 * t), 1.0 + 0.5 * np.sin(2 * t), 0.2 * np.sin(t), 0.1 * np.cos(t), 0.1 * t)
    return [HEADER, *(",".join(f"{x:.5f}" for x in row) for row in zip(*(c.tolist() for c in columns), strict=True))]


def written(folder, lines):
    path = folder / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_all_rows_are_read_in_order(tmp_path, lines):
    log = read_log(written(tmp_path, lines))
    assert log.samples == ROWS
    # the file has five decimals
    np.testing.assert_allclose(log.angles[:, 2], 0.1 * np.arange(ROWS) / RATE, rtol=0.0, atol=6e-6)


@pytest.mark.parametrize(
    ("cell", "said"), [("x", "row 120001, column 'pitch"), ("1,2,3", "row 120001: 8 cells stand under 6 headers")]
)
def test_a_mistake_in_a_later_piece_is_named_by_its_row(tmp_path, lines, cell, said):
    changed = list(lines)
    cells = changed[120_000].split(",")
    changed[120_000] = ",".join((*cells[:3], cell, *cells[4:]))
    with pytest.raises(LogError, match=said):
        read_log(written(tmp_path, changed))


def test_where_the_pieces_of_the_first_pass_meet_makes_no_difference(tmp_path, lines, monkeypatch):
    part = lines[:2001]
    whole = read_log(written(tmp_path, part))
    for size in (1, 7, 64, 1000):
        monkeypatch.setattr(stream, "PIECE", size)
        monkeypatch.setattr(survey, "PIECE", size)
        log = read_log(tmp_path / "log.csv")
        assert np.array_equal(log.angles, whole.angles)
        assert log.notes == whole.notes
        if size >= 1000:  # with less than some lines there is nothing to compare the last line with
            (tmp_path / "cut.csv").write_text("\n".join(part)[:-5])
            assert "row 2001 is left out" in " ".join(read_log(tmp_path / "cut.csv").notes)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_an_encoding_is_understood_wherever_its_pieces_are_cut(tmp_path, lines, monkeypatch, encoding):
    text = "\n".join([lines[0] + ",Ort", *(f"{line},Köln" for line in lines[1:1501])])
    path = tmp_path / "log.csv"
    path.write_bytes(text.encode(encoding))
    monkeypatch.setattr(stream, "PIECE", 3)
    log = read_log(path)
    assert log.samples == 1500
    assert log.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_a_packed_log_is_unpacked_piece_by_piece(tmp_path, lines):
    data = "\n".join(lines[:3000]).encode()
    members = gzip.compress(data[:1000]) + gzip.compress(data[1000:])  # as `cat a.gz b.gz` makes them
    (tmp_path / "log.csv.gz").write_bytes(members)
    log = read_log(tmp_path / "log.csv.gz")
    assert (log.samples, log.sha256) == (2999, hashlib.sha256(members).hexdigest())


def test_a_log_that_grows_is_read_as_far_as_it_went_and_one_that_changes_is_refused(tmp_path, lines):
    path = written(tmp_path, lines[:5001])
    opened = stream.log_file(path, 100.0)
    size = path.stat().st_size
    with path.open("a") as file:
        file.write("\n".join(lines[5001:5100]))
    assert sum(map(len, opened.pieces())) == size
    path.write_text(path.read_text().replace("0.1", "0.2", 1))
    with pytest.raises(LogError, match="changed while it was read"):
        list(opened.pieces())
    path.write_text("cut")
    with pytest.raises(LogError, match="changed while it was read"):
        list(stream.LogFile(path, size, size).pieces())


def test_reading_takes_little_more_memory_than_the_arrays(tmp_path, lines):
    path = written(tmp_path, lines)
    read_log(path)  # what the first reading imports and keeps is not the log's
    tracemalloc.start()
    log = read_log(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # the six columns, half of them a second time while they are put side by side, and the piece that pandas reads:
    # 600 000 cells with its own copies, some 20 MB
    assert peak < 1.6 * 48 * log.samples + 25e6
    assert peak < 4 * path.stat().st_size
