"""The Python interface: light to import, the same diagnosis as the command line's, shown in a notebook."""

import ast
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import heli_identifier as hi
from heli_identifier.errors import LogError
from tests.diagnosis_example import adequate, example, made_log
from tests.test_report_page import Page

PACKAGE = Path(hi.__file__).parent


def test_importing_the_package_loads_the_standard_library_alone():
    script = (
        "import sys; before = set(sys.modules); import heli_identifier; "
        "tops = {name.partition('.')[0] for name in set(sys.modules) - before}; "
        "print(sorted(tops - set(sys.stdlib_module_names) - {'heli_identifier'}))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_an_fmu_that_vendors_the_package_vendors_nothing_of_its_interface():
    from fmu_src.packaging.sources import needed_sources

    sources = needed_sources("heli_identifier")
    assert list(sources) == ["heli_identifier/__init__.py"]


@pytest.mark.parametrize("name", hi.__all__)
def test_every_public_name_is_found(name):
    assert getattr(hi, name).__doc__
    assert name in dir(hi)


def test_a_name_that_does_not_exist_is_said_to_be_missing():
    with pytest.raises(AttributeError, match="no attribute 'diagnoze'"):
        hi.diagnoze  # noqa: B018


def test_what_type_checkers_see_is_what_there_is():
    stub = ast.parse((PACKAGE / "__init__.pyi").read_text(encoding="utf-8"))
    seen = {alias.asname for node in stub.body for alias in node.names}
    assert seen == set(hi.__all__)


def test_a_log_that_was_fitted_cannot_judge():
    training, _ = hi.demo_logs("rig-a")
    log = hi.read_log(training[0])
    with pytest.raises(LogError, match="shares samples"):
        hi.diagnose(log, held_out=log)


def test_without_a_held_out_log_nothing_is_judged():
    with pytest.raises(LogError, match="no log is held out"):
        hi.diagnose(made_log(), held_out=())


@pytest.mark.slow
def test_three_lines_go_from_logs_to_the_corrected_unit(tmp_path):
    """Rig-a's truth holds dry friction of .025 rad/s^2 in the pitch; the bar is 15 %."""
    training, held_out = hi.demo_logs("rig-a")
    # one log of the three is enough for an effect whose score is 100 with all of them
    diagnosis = hi.diagnose(hi.read_log(training[0]), held_out=hi.read_logs(held_out))
    assert (diagnosis.effects[0].name, diagnosis.effects[0].axis) == ("dry_friction", "pitch")
    assert diagnosis.effects[0].coefficient.value == pytest.approx(0.025, rel=0.15)
    folder = hi.write_results(diagnosis, tmp_path / "result", "rig-a")
    assert sorted(file.name for file in folder.iterdir()) == [
        "HelicopterPlant.fmu", "diagnosis.json", "parameters.json", "report.html",
    ]  # fmt: skip


@pytest.mark.parametrize("made", [example, adequate])
def test_a_notebook_shows_every_effect_and_error_in_closed_tags(made):
    diagnosis = made()
    text = diagnosis._repr_html_()
    page = Page(text)
    assert page.open == []
    assert page.addresses == [address for address in page.addresses if address.startswith("#")]
    for effect in diagnosis.effects:
        assert effect.verdict in text
    for axis in diagnosis.axes:
        assert f">{axis}<" in text


def test_a_notebook_says_what_has_to_be_kept_in_mind_behind_the_verdict():
    text = example()._repr_html_()
    assert text.index("</strong>") < text.index("<li>voltages reach 5.10 V</li>") < text.index("<figure")
    assert "<ul>" not in replace(example(), notes=())._repr_html_()


def test_a_diagnosis_prints_as_its_verdict_and_not_as_its_arrays():
    assert repr(adequate()) == "<Diagnosis: model adequate>"
    assert repr(example()).startswith("<Diagnosis: effects shown: dry_friction on pitch, arm_bending on elevation")


def test_what_a_notebook_shows_is_light_enough_to_be_saved_in_it():
    """A notebook keeps every output; half a megabyte of them would bury the text in a review."""
    assert len(example()._repr_html_().encode()) < 200_000
