"""SSP files: valid, flat, complete, and the same bytes again."""

import pytest
from fmpy.ssp.ssd import find_components, get_connections, read_ssd, read_ssv

from fmu_src import SCENARIOS, unit_class
from fmu_src.ssp import write_ssp

GIVEN = {"plant.pitch.gain": 1.0 / 3.0, "plant.encoder.enabled": True}


@pytest.fixture(scope="module", params=SCENARIOS)
def written(request, fmus, tmp_path_factory):
    wiring = SCENARIOS[request.param]
    folder, files = tmp_path_factory.mktemp("ssp"), {name: fmus[kind] for name, kind in wiring.units}
    path = write_ssp(wiring, folder / "once.ssp", GIVEN, files)
    assert write_ssp(wiring, folder / "again.ssp", GIVEN, files).read_bytes() == path.read_bytes()
    return wiring, path


def test_structure_and_parameter_sets_are_valid_against_the_schema_and_hold_wiring_and_parameters(written):
    wiring, path = written
    structure = read_ssd(str(path), validate=True)
    assert [component.name for component in find_components(structure.system)] == [name for name, _ in wiring.units]
    wires = {(a.parent.name, a.name, b.parent.name, b.name) for a, b in get_connections(structure.system)}
    assert wires == {(w.source_unit, w.source, w.target_unit, w.target) for w in wiring.connections}
    held = {}
    for name, kind in wiring.units:
        parameters = read_ssv(str(path), f"resources/{name}.ssv", validate=True).parameters
        expected = [v.name for v in unit_class(kind).variables if v.causality == "parameter"]
        assert [parameter.name for parameter in parameters] == expected
        held |= {f"{name}.{parameter.name}": parameter.value for parameter in parameters}
    for name, value in {**dict(wiring.parameters), **GIVEN}.items():
        assert held[name] == (repr(value).lower() if isinstance(value, bool) else str(value))


def test_the_system_is_flat_and_every_listed_input_is_fed(written):
    wiring, path = written
    system = read_ssd(str(path)).system
    assert system.connectors == [] and not any(hasattr(element, "elements") for element in system.elements)
    fed = {(wire.target_unit, wire.target) for wire in wiring.connections}
    for component in find_components(system):
        for connector in component.connectors:
            assert connector.kind == "output" or (component.name, connector.name) in fed
