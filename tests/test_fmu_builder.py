"""Building units: content, determinism, parameters, and what a unit may hold."""

import ast
import re
import sys
import zipfile
from xml.etree import ElementTree

import pytest
from fmpy.validation import validate_fmu

from fmu_src import UNITS, BuildError, build, unit_class
from fmu_src.vendoring import content_hash, needed_sources, renamed


def description(path):
    with zipfile.ZipFile(path) as archive:
        return ElementTree.fromstring(archive.read("modelDescription.xml"))


@pytest.mark.parametrize("unit", UNITS)
def test_fmpy_validate_finds_nothing(fmus, unit):
    assert validate_fmu(str(fmus[unit])) == []


@pytest.mark.parametrize("unit", UNITS)
def test_a_rebuild_is_the_same_bytes(fmus, unit, tmp_path):
    assert build(unit, tmp_path).read_bytes() == fmus[unit].read_bytes()


@pytest.mark.parametrize("unit", UNITS)
def test_a_unit_holds_icon_documentation_licence_and_both_binaries(fmus, unit):
    with zipfile.ZipFile(fmus[unit]) as archive:
        names = set(archive.namelist())
        page = archive.read("documentation/index.html").decode()
    assert {"model.png", "documentation/index.html", "documentation/licenses/pythonfmu.txt"} <= names
    assert {f"binaries/linux64/{unit}.so", f"binaries/win64/{unit}.dll"} <= names
    assert "Python" in page and all(variable.name in page for variable in unit_class(unit).variables)


@pytest.mark.parametrize("unit", UNITS)
def test_vendored_sources_import_only_their_own_hashed_names_and_the_standard_library(fmus, unit):
    with zipfile.ZipFile(fmus[unit]) as archive:
        sources = {name: archive.read(name).decode() for name in archive.namelist() if name.endswith(".py")}
    own = {name.split("/")[1].removesuffix(".py") for name in sources}
    assert all(re.search(r"_[0-9a-f]{12}$", name) for name in own)
    for name, text in sources.items():
        for node in ast.walk(ast.parse(text, feature_version=(3, 9))):
            modules = []
            if isinstance(node, ast.Import):
                modules = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                modules = [node.module]
            for module in modules:
                root = module.split(".")[0]
                assert root in own or root in sys.stdlib_module_names, f"{name} imports {module}"
    assert not any("strict=True" in text for text in sources.values())  # zip's strict is Python 3.10


def test_parameters_become_start_values_and_change_hash_and_guid(fmus, tmp_path):
    corrected = build("HelicopterPlant", tmp_path, {"effects.dry_friction.pitch": 0.025, "encoder.enabled": 1})
    assert validate_fmu(str(corrected)) == []
    before, after = description(fmus["HelicopterPlant"]), description(corrected)
    start = {v.get("name"): v[0].get("start") for v in after.iter("ScalarVariable")}
    assert start["effects.dry_friction.pitch"] == "0.025"
    assert start["encoder.enabled"] == "true"
    assert before.get("guid") != after.get("guid")
    with zipfile.ZipFile(fmus["HelicopterPlant"]) as a, zipfile.ZipFile(corrected) as b:
        assert a.read("resources/slavemodule.txt") != b.read("resources/slavemodule.txt")


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"pitch.dampling": 1.0}, "no parameter 'pitch.dampling'; did you mean 'pitch.damping'"),
        ({"motor.time_constant": -0.03}, "motor.time_constant = -0.03 s must lie in [0, 5] s"),
        ({"effects.dry_friction.pitch": float("nan")}, "effects.dry_friction.pitch = nan"),
        ({"encoder.counts_pitch": 0.5}, "encoder.counts_pitch = 0.5 must be a whole number"),
        ({"v_front": 1.0}, "no parameter 'v_front'"),
        ({"pitch.damping": "much"}, "pitch.damping = 'much'"),
    ],
)
def test_a_bad_parameter_is_refused_by_name_value_and_bound_and_nothing_is_written(parameters, message, tmp_path):
    with pytest.raises(BuildError, match=re.escape(message)):
        build("HelicopterPlant", tmp_path / "out", parameters)
    assert not (tmp_path / "out").exists()


def test_an_unknown_unit_is_refused_with_the_nearest_name(tmp_path):
    with pytest.raises(BuildError, match="did you mean 'HelicopterPlant'"):
        build("HelicoperPlant", tmp_path)


def test_a_build_that_fails_in_writing_leaves_what_was_there_and_no_part(tmp_path):
    in_the_way = tmp_path / "Exciter.fmu" / "old"
    in_the_way.mkdir(parents=True)
    with pytest.raises(OSError, match="Exciter.fmu"):
        build("Exciter", tmp_path)
    assert list(tmp_path.rglob("*")) == [tmp_path / "Exciter.fmu", in_the_way]


def test_a_module_that_needs_more_than_the_standard_library_is_refused():
    with pytest.raises(BuildError, match="imports numpy, which is not in the standard library"):
        needed_sources("fmu_src.master.result")


def test_every_structure_entry_points_at_its_variable(fmus):
    for path in fmus.values():
        root = description(path)
        variables = root.findall("ModelVariables/ScalarVariable")
        outputs = [index for index, v in enumerate(variables, 1) if v.get("causality") == "output"]
        listed = [int(u.get("index")) for u in root.findall("ModelStructure/Outputs/Unknown")]
        assert listed == outputs
        for unknown in root.findall("ModelStructure/InitialUnknowns/Unknown"):
            for known in (int(index) for index in unknown.get("dependencies").split()):
                assert variables[known - 1].get("causality") == "parameter"


def test_sources_of_different_content_have_different_names():
    sources = needed_sources("fmu_src.units.exciter")
    changed = {**sources, "heli_plant/motor.py": sources["heli_plant/motor.py"] + "\n# changed\n"}
    assert content_hash(sources, {}) != content_hash(changed, {})
    assert content_hash(sources, {}) != content_hash(sources, {"excitation.base": 0.25})
    tag = content_hash(sources, {})
    assert all(path.split("/")[0].endswith(tag) for path in renamed(sources, tag))


def test_values_are_brought_to_the_type_of_their_variable(tmp_path):
    plant = build("HelicopterPlant", tmp_path, {"encoder.enabled": 1.0, "encoder.counts_pitch": 2048.0})
    start = {v.get("name"): v[0].get("start") for v in description(plant).iter("ScalarVariable")}
    assert (start["encoder.enabled"], start["encoder.counts_pitch"]) == ("true", "2048")
