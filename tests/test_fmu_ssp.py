"""SSP files: valid, flat, complete, the same bytes again, and parameter sets that come back as they went."""

import zipfile
from xml.etree import ElementTree

import pytest
from fmpy.ssp.ssd import find_components, get_connections, read_ssd, read_ssv

from fmu_src import SCENARIOS, BuildError, WiringError, build, unit_class
from fmu_src.ssp import read_parameter_set, write_parameter_set, write_ssp
from heli_plant.parameters import TABLE_2, to_names

NAMESPACES = {"ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription"}


def files_of(wiring, fmus):
    return {name: fmus[kind] for name, kind in wiring.units}


@pytest.fixture(scope="module", params=SCENARIOS)
def written(request, fmus, tmp_path_factory):
    wiring = SCENARIOS[request.param]
    path = tmp_path_factory.mktemp("ssp") / f"{wiring.name}.ssp"
    return wiring, write_ssp(wiring, path, {"plant.pitch.gain": 0.3}, files_of(wiring, fmus))


def test_structure_and_parameter_sets_are_valid_against_the_schema_and_hold_the_wiring(written):
    wiring, path = written
    structure = read_ssd(str(path), validate=True)
    assert [component.name for component in find_components(structure.system)] == [name for name, _ in wiring.units]
    wires = {(a.parent.name, a.name, b.parent.name, b.name) for a, b in get_connections(structure.system)}
    assert wires == {(w.source_unit, w.source, w.target_unit, w.target) for w in wiring.connections}
    for name, kind in wiring.units:
        parameters = read_ssv(str(path), f"resources/{name}.ssv", validate=True).parameters
        expected = [v.name for v in unit_class(kind).variables if v.causality == "parameter"]
        assert [parameter.name for parameter in parameters] == expected


def test_the_system_is_flat_and_every_listed_input_is_fed(written):
    wiring, path = written
    with zipfile.ZipFile(path) as archive:
        root = ElementTree.fromstring(archive.read("SystemStructure.ssd"))
    assert root.find("ssd:System/ssd:Connectors", NAMESPACES) is None
    assert root.find("ssd:System/ssd:Elements/ssd:System", NAMESPACES) is None
    fed = {(wire.target_unit, wire.target) for wire in wiring.connections}
    for component in root.iterfind("ssd:System/ssd:Elements/ssd:Component", NAMESPACES):
        for connector in component.iterfind("ssd:Connectors/ssd:Connector", NAMESPACES):
            assert connector.get("kind") == "output" or (component.get("name"), connector.get("name")) in fed


def test_an_ssp_holds_the_given_and_the_scenarios_own_parameters(written, tmp_path):
    wiring, path = written
    with zipfile.ZipFile(path) as archive:
        for name, _ in wiring.units:
            (tmp_path / f"{name}.ssv").write_bytes(archive.read(f"resources/{name}.ssv"))
    assert read_parameter_set(tmp_path / "plant.ssv")["pitch.gain"] == 0.3
    for full, value in wiring.parameters:
        unit, _, name = full.partition(".")
        assert read_parameter_set(tmp_path / f"{unit}.ssv")[name] == value


def test_a_second_ssp_is_the_same_bytes(written, fmus, tmp_path):
    wiring, path = written
    again = write_ssp(wiring, tmp_path / "again.ssp", {"plant.pitch.gain": 0.3}, files_of(wiring, fmus))
    assert again.read_bytes() == path.read_bytes()


def test_a_corrected_plant_goes_into_an_ssv_and_comes_back_to_the_bit(tmp_path):
    corrected = to_names(TABLE_2._replace(a_wx=1.0 / 17.0, dry_friction_pitch=0.0247))
    path = write_parameter_set("HelicopterPlant", corrected, tmp_path / "corrected.ssv")
    back = read_parameter_set(path)
    assert {name: back[name] for name in corrected} == corrected
    assert back["encoder.enabled"] is False and back["encoder.counts_pitch"] == 4096
    assert read_ssv(str(path), validate=True).name == "HelicopterPlant"


def test_a_parameter_set_comes_back_as_an_fmu_of_the_same_values(tmp_path):
    given = {"pitch.gain": 0.31, "encoder.enabled": True}
    path = write_parameter_set("HelicopterPlant", given, tmp_path / "set.ssv")
    fmu = build("HelicopterPlant", tmp_path, read_parameter_set(path))
    with zipfile.ZipFile(fmu) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    start = {v.get("name"): v[0].get("start") for v in root.iter("ScalarVariable")}
    assert (start["pitch.gain"], start["encoder.enabled"]) == ("0.31", "true")


@pytest.mark.parametrize(
    ("parameters", "message"),
    [({"pitch.gian": 1.0}, "did you mean 'pitch.gain'"), ({"pitch.gain": 1e9}, "pitch.gain = 1000000000.0")],
)
def test_bad_parameters_are_refused_and_nothing_is_written(parameters, message, tmp_path):
    with pytest.raises(BuildError, match=message):
        write_parameter_set("HelicopterPlant", parameters, tmp_path / "set.ssv")
    with pytest.raises(BuildError, match=message):
        write_ssp("open_loop", tmp_path / "s.ssp", {f"plant.{k}": v for k, v in parameters.items()})
    assert list(tmp_path.iterdir()) == []


def test_unknown_scenarios_and_units_are_refused(tmp_path):
    with pytest.raises(WiringError, match="no scenario"):
        write_ssp("open", tmp_path / "s.ssp")
    with pytest.raises(WiringError, match="has no unit 'pilot'"):
        write_ssp("open_loop", tmp_path / "s.ssp", {"pilot.x": 1.0})
    with pytest.raises(WiringError, match="an FMU is given for 'pilot'"):
        write_ssp("open_loop", tmp_path / "s.ssp", fmus={"pilot": "x.fmu"})


BAD_SETS = {
    "entities": (b'<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "has a document type"),
    "entities in UTF-16": ('<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>'.encode("utf-16"), "has a document type"),
    "no XML": (b"<", "cannot be read"),
    "a value that is no number": (
        b'<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"><ssv:Parameters>'
        b'<ssv:Parameter name="a"><ssv:Real value="much"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>',
        "a has no value that can be read",
    ),
}


@pytest.mark.parametrize("case", BAD_SETS)
def test_a_hostile_or_damaged_parameter_set_is_refused(tmp_path, case):
    text, said = BAD_SETS[case]
    (tmp_path / "set.ssv").write_bytes(text)
    with pytest.raises(BuildError, match=said):
        read_parameter_set(tmp_path / "set.ssv")
