"""The wiring table: complete, unambiguous, and with the delay where its docstring says."""

import pytest

from fmu_src import SCENARIOS, UNITS, Connection, Scenario, WiringError, scenario, unit_class


@pytest.mark.parametrize("name", SCENARIOS)
def test_connections_join_an_output_to_an_input_of_its_unit_of_measure_and_what_is_not_fed_rests(name):
    """Not fed are the moving mass and those inputs by which a plant follows a rig."""
    wiring = SCENARIOS[name]
    variables = {unit: {v.name: v for v in unit_class(kind).variables} for unit, kind in wiring.units}
    for wire in wiring.connections:
        source, target = variables[wire.source_unit][wire.source], variables[wire.target_unit][wire.target]
        assert (source.causality, target.causality, source.unit) == ("output", "input", target.unit)
    fed = {(wire.target_unit, wire.target) for wire in wiring.connections}
    for unit, own in variables.items():
        for variable in own.values():
            if variable.causality == "input" and (unit, variable.name) not in fed:
                rests = variable.name == "mass_position" or variable.name.startswith(("measured.", "correction."))
                rests = rests or variable.name.endswith("_reference")  # a second opinion, for those who have them
                assert rests or variable.name in ("observer.bandwidth", "fresh")
                assert variable.start == (1.0 if variable.name in ("fresh", "measured.fresh") else 0.0)


def test_no_output_at_the_start_depends_on_an_input_so_that_one_pass_initialises_all():
    for kind in UNITS:
        variables = {v.name: v for v in unit_class(kind).variables}
        for variable in variables.values():
            for name in variable.initial_dependencies:
                assert variables[name].causality == "parameter"


def test_an_input_fed_twice_a_unit_that_is_not_there_and_an_unknown_scenario_are_refused():
    wires = (Connection("a", "x", "b", "u"), Connection("c", "x", "b", "u"))
    with pytest.raises(WiringError, match="b.u is connected twice"):
        Scenario("twice", "", (("a", "A"), ("b", "B"), ("c", "C")), wires)
    with pytest.raises(WiringError, match="names the unit 'z'"):
        Scenario("lost", "", (("a", "A"),), (Connection("a", "x", "z", "u"),))
    with pytest.raises(WiringError, match="did you mean 'closed_loop'"):
        scenario("close_loop")
