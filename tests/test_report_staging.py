"""Results appear complete or not at all."""

from pathlib import Path

import pytest

from heli_identifier import signals
from heli_identifier.errors import ConfigurationError
from heli_identifier.results.folder import whole_folder


def names(folder):
    return sorted(path.name for path in Path(folder).iterdir())


def test_a_folder_that_does_not_exist_is_made_with_its_parents(tmp_path):
    with whole_folder(tmp_path / "a" / "b") as draft:
        (draft / "x").write_text("1")
        assert not (tmp_path / "a").exists()
    assert names(tmp_path / "a" / "b") == ["x"]
    assert names(tmp_path) == ["a"]


def test_an_exception_leaves_nothing_behind_and_nothing_changed(tmp_path):
    (tmp_path / "x").write_text("old")
    with pytest.raises(RuntimeError), whole_folder(tmp_path) as draft:
        (draft / "x").write_text("new")
        raise RuntimeError
    assert names(tmp_path) == ["x"]
    assert (tmp_path / "x").read_text() == "old"
    with pytest.raises(RuntimeError), whole_folder(tmp_path / "a" / "b"):
        raise RuntimeError
    assert names(tmp_path) == ["x"]


def test_files_of_the_same_name_are_replaced_and_others_stay(tmp_path):
    (tmp_path / "x").write_text("old")
    (tmp_path / "mine").write_text("kept")
    with whole_folder(tmp_path) as draft:
        (draft / "x").write_text("new")
    assert names(tmp_path) == ["mine", "x"]
    assert (tmp_path / "x").read_text() == "new"
    assert (tmp_path / "mine").read_text() == "kept"


@pytest.mark.parametrize("signalled", [False, True])
def test_a_move_that_fails_or_is_ended_by_a_signal_takes_back_those_before_it(tmp_path, signalled):
    (tmp_path / "a").write_text("old")
    (tmp_path / "b").write_text("old")
    (tmp_path / "c").write_text("old")
    original = Path.replace

    def replace(self, target):
        # the disk fails when the last file is moved to its place
        if self.name == "c" and Path(target) == tmp_path / "c" and ".replaced" not in str(self):
            for _, undo in reversed(signals._to_undo if signalled else []):  # what the handler of a signal does
                undo()
            raise OSError(28, "No space left on device")
        return original(self, target)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "replace", replace)
        with pytest.raises(ConfigurationError, match="nothing was changed"), whole_folder(tmp_path) as draft:
            for name in "abc":
                (draft / name).write_text("new")
    assert (tmp_path / "a").read_text() == "old"
    assert (tmp_path / "b").read_text() == "old"
    assert (tmp_path / "c").read_text() == "old"
    assert names(tmp_path) == ["a", "b", "c"]


def test_a_target_that_cannot_be_a_folder_is_refused_before_the_work_begins(tmp_path):
    file = tmp_path / "x"
    file.write_text("1")
    for target in (file, file / "below"):
        with pytest.raises(ConfigurationError, match="is a file"), whole_folder(target):
            pytest.fail("the work began")


def test_a_folder_of_the_user_is_not_replaced_by_a_file_of_the_same_name(tmp_path):
    (tmp_path / "x").mkdir()
    (tmp_path / "x" / "mine").write_text("kept")
    with pytest.raises(ConfigurationError, match="is a folder and is not replaced"), whole_folder(tmp_path) as draft:
        (draft / "x").write_text("new")
    assert (tmp_path / "x" / "mine").read_text() == "kept"
    assert names(tmp_path) == ["x"]


def test_a_link_to_a_folder_and_a_link_in_it_are_followed(tmp_path):
    real = tmp_path / "real"
    real.mkdir()
    (tmp_path / "elsewhere").write_text("old")
    (real / "x").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "link").symlink_to(real)
    (tmp_path / "dangling").symlink_to(tmp_path / "made")
    for target in ("link", "dangling"):
        with whole_folder(tmp_path / target) as draft:
            (draft / "x").write_text("new")
    assert (real / "x").is_symlink()
    assert (tmp_path / "elsewhere").read_text() == "new"
    assert names(tmp_path / "made") == ["x"]
    assert (tmp_path / "dangling").is_symlink()
