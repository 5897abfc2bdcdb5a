"""Random damage to every kind of file, and the findings of longer runs, which stay here."""

from pathlib import Path
from random import Random

import pytest

from heli_identifier.errors import ConfigurationError, LogError
from heli_identifier.records import guess, read_configuration, read_log
from tests.fuzzing import LOG, READERS, complaint, tried


@pytest.mark.parametrize(
    "reader", [pytest.param(r, marks=[pytest.mark.slow] if r == "a MATLAB log" else []) for r in READERS]
)
def test_a_damaged_file_is_read_or_refused_in_one_sentence(tmp_path, reader):
    random = Random(16)
    assert [found for _ in range(150) if (found := tried(reader, tmp_path, random)) is not None] == []


CORPUS = sorted((Path(__file__).parent / "corpus").glob("*/*"))
"""Small files of guided runs, by reader: ``found`` ones broke it, ``covered`` ones reach what no other file does."""


@pytest.mark.parametrize("file", CORPUS, ids=lambda file: f"{file.parent.name}/{file.name}")
def test_a_file_of_the_corpus_is_read_or_refused_in_one_sentence(tmp_path, file):
    (reader,) = [name for name in READERS if name.replace(" ", "-") == file.parent.name]
    path = tmp_path / READERS[reader][0]
    path.write_bytes(file.read_bytes())
    for seed in range(6):
        assert complaint(reader, path, Random(seed)) is None


def test_a_carriage_return_within_a_line_is_no_error_of_the_program(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(LOG.replace(b",1", b",1\r", 3))
    with pytest.raises(LogError):
        read_log(path)


@pytest.mark.parametrize("data", [b"\xff\xfe", b"\xff\xfe\xff\xfe", b"\xef\xbb\xbf\n"])
def test_a_file_that_holds_nothing_but_the_mark_of_its_encoding_is_empty(tmp_path, data):
    path = tmp_path / "log.csv"
    path.write_bytes(data)
    with pytest.raises(LogError, match="is empty"):
        read_log(path)


def test_a_cell_of_megabytes_is_refused(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(b"a" * 300_000 + b"," + LOG)
    with pytest.raises(LogError):
        read_log(path)


def test_a_log_that_is_shorter_than_a_block_of_the_guess_is_refused(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(b"\n".join(LOG.splitlines()[:4]))
    with pytest.raises(LogError, match="shorter than 5 s"):
        guess(path)


@pytest.mark.parametrize("key", ["", " ", "a.b", "a`b", "a\\nb"])
def test_a_key_that_is_no_word_is_unknown_in_one_sentence(tmp_path, key):
    path = tmp_path / "heli.toml"
    path.write_text(f'"{key}" = 1\n')
    with pytest.raises(ConfigurationError, match="is unknown") as refused:
        read_configuration(path)
    assert "\n" not in str(refused.value)
