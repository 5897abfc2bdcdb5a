"""SSP files: valid, flat, complete, and the same bytes again."""

import pytest
from fmpy.ssp.ssd import find_components, get_connections, read_ssd, read_ssv

from fmu_src import SCENARIOS, unit_class
from fmu_src.ssp import write_ssp

GIVEN = {"plant.pitch.gain": 1.0 / 3.0, "plant.encoder.enabled": True}


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_file_is_valid_flat_the_same_again_and_holds_wiring_and_parameters(name, fmus, tmp_path):
    wiring = SCENARIOS[name]
    files = {name: fmus[kind] for name, kind in wiring.units}
    path = write_ssp(wiring, tmp_path / "once.ssp", GIVEN, files)
    assert write_ssp(wiring, tmp_path / "again.ssp", GIVEN, files).read_bytes() == path.read_bytes()
    system = read_ssd(str(path), validate=True).system
    assert [component.name for component in find_components(system)] == [name for name, _ in wiring.units]
    wires = {(a.parent.name, a.name, b.parent.name, b.name) for a, b in get_connections(system)}
    assert wires == {(w.source_unit, w.source, w.target_unit, w.target) for w in wiring.connections}
    held = {}
    for name, kind in wiring.units:
        parameters = read_ssv(str(path), f"resources/{name}.ssv", validate=True).parameters
        expected = [v.name for v in unit_class(kind).variables if v.causality == "parameter"]
        assert [parameter.name for parameter in parameters] == expected
        held |= {f"{name}.{parameter.name}": parameter.value for parameter in parameters}
    for name, value in {**dict(wiring.parameters), **GIVEN}.items():
        assert held[name] == (repr(value).lower() if isinstance(value, bool) else str(value))
    assert system.connectors == [] and not any(hasattr(element, "elements") for element in system.elements)
    for component in find_components(system):
        for connector in component.connectors:  # every listed input is fed
            assert connector.kind == "output" or (component.name, connector.name) in {wire[2:] for wire in wires}
