"""Random damage to every kind of file, and the findings of longer runs, which stay here."""

from pathlib import Path
from random import Random

import pytest

from tests.fuzzing import READERS, complaint, tried

APART = ("a MATLAB log", "a spreadsheet")
"""Each file is read by a process of its own, which takes a second."""


@pytest.mark.parametrize(
    "reader", [pytest.param(r, marks=[pytest.mark.slow] if r in APART else []) for r in READERS]
)
def test_a_damaged_file_is_read_or_refused_in_one_sentence(tmp_path, reader):
    random = Random(16)
    assert [found for _ in range(150) if (found := tried(reader, tmp_path, random)) is not None] == []


CORPUS = sorted((Path(__file__).parent / "corpus").glob("*/*"))
"""Small files of long runs, by reader: ``found`` ones broke it, ``covered`` ones reach what no other file does."""


@pytest.mark.parametrize("file", CORPUS, ids=lambda file: f"{file.parent.name}/{file.name}")
def test_a_file_of_the_corpus_is_read_or_refused_in_one_sentence(tmp_path, file):
    (reader,) = [name for name in READERS if name.replace(" ", "-") == file.parent.name]
    path = tmp_path / READERS[reader][0]
    path.write_bytes(file.read_bytes())
    for seed in range(6):
        assert complaint(reader, path, Random(seed)) is None
