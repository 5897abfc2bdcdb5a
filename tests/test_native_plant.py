"""The translated plant gives CPython's bits: the same sums, products and library functions in the same order."""

import ctypes
import struct
from random import Random

import pytest

from fmu_src import build
from heli_plant import plant
from heli_plant.effects import AXES, CATALOGUE, VOLTAGE
from heli_plant.parameter_table import BY_FIELD, PARAMETERS
from heli_plant.parameters import TABLE_2, PlantParameters
from heli_plant.state import PlantState
from heli_plant.tabulated_torque import KNOTS, VARIABLES
from tests.native_builds import library, lockstep, needs_a_compiler

STEPS = 100_000
STATES = len(PlantState._fields)

_MANY = """
void many(const double *states, const double *inputs, const double *sets, const int *which, int n, double *out)
{
    for (int k = 0; k < n; k++) {
        PlantState state;
        memcpy(&state, states + 12 * k, sizeof state);
        const double *u = inputs + 5 * k;
        const PlantParameters *p = (const PlantParameters *)sets + which[k];
        const PlantState next = plant_step(&state, u[0], u[1], u[2], u[3], u[4], p);
        memcpy(out + 12 * k, &next, sizeof next);
    }
}
"""


def parameter_sets(draw):
    """Each effect alone, none, all, all on the general model, a table of each variable, at random values in range."""

    def value(entry):
        low, high = max(entry.lower, -0.2), min(entry.upper, 0.2)
        return draw.uniform(low, high) or 0.5 * high

    alone = [TABLE_2._replace(**{entry.field: value(entry)}) for entry in CATALOGUE]
    everything = {entry.field: value(entry) for entry in CATALOGUE}
    without_lag = TABLE_2._replace(T_m=0.0, **{e.field: value(e) for e in CATALOGUE if e.place == VOLTAGE})
    every = TABLE_2._replace(**everything)
    tables = [TABLE_2._replace(**table(draw, axis, number)) for axis in AXES for number in range(1, len(VARIABLES) + 1)]
    return [
        TABLE_2, TABLE_2._replace(general_model=1.0), without_lag, every, every._replace(general_model=1.0), *alone,
        *tables,
    ]  # fmt: skip


def table(draw, axis, number):
    """Fields of a random table that the states and inputs below reach, and reach beyond."""
    torques = {f"table_torque_{k}_{axis}": draw.uniform(-0.3, 0.3) for k in range(1, KNOTS + 1)}
    return {
        f"table_variable_{axis}": float(number),
        f"table_first_{axis}": draw.uniform(-1.5, -0.5),
        f"table_spacing_{axis}": draw.uniform(0.05, 0.2),
        **torques,
    }


def bits(values):
    return struct.pack(f"{len(values)}d", *values)


@pytest.mark.parametrize("flags", [("-O2",), ("-O0",), ("-O3", "-march=native")], ids=" ".join)
def test_a_step_in_c_has_the_bits_of_cpython(tmp_path, flags):
    """1e5 random steps over every effect and both models; no difference is allowed, so there is no tolerance."""
    draw = Random(14)
    sets = parameter_sets(draw)
    which = [draw.randrange(len(sets)) for _ in range(STEPS)]
    states = [[draw.uniform(-1.5, 1.5) for _ in range(STATES)] for _ in range(STEPS)]
    for state in states[::3]:
        state[10] = 0.0  # the ADO at rest in its middle
    inputs = [
        [draw.uniform(-8.0, 8.0), draw.uniform(-8.0, 8.0), draw.uniform(-0.3, 0.3), draw.uniform(0.0, 90.0),
         draw.uniform(1e-4, 0.05)]
        for _ in range(STEPS)
    ]  # fmt: skip
    built = library(tmp_path, [plant.step], _MANY, flags)
    out = (ctypes.c_double * (STATES * STEPS))()
    flat = [[x for row in table for x in row] for table in (states, inputs, sets)]
    arrays = [(ctypes.c_double * len(values))(*values) for values in flat]
    built.many(*arrays, (ctypes.c_int * STEPS)(*which), STEPS, out)
    different = 0
    for k in range(STEPS):
        expected = plant.step(PlantState(*states[k]), *inputs[k], sets[which[k]])
        different += bits(expected) != bits(out[STATES * k : STATES * (k + 1)])
    assert different == 0


def test_a_parameter_set_in_c_has_the_fields_of_python(tmp_path):
    """The tests above hand parameters over as a row of doubles."""
    built = library(
        tmp_path, [plant.step],
        "int size(void) { return (int)(sizeof(PlantParameters) / sizeof(double)); }",
    )  # fmt: skip
    assert built.size() == len(PlantParameters._fields) == len(PARAMETERS)


ALL_ON = {
    f"effects.{entry.name}.{entry.axis}": min(0.02, entry.upper)
    for entry in CATALOGUE
    if entry.name not in ("moving_mass", "thrust_fade")
}
INPUTS = {"v_front": [-5.0, 7.0], "v_rear": [-5.0, 7.0], "mass_position": [-0.2, 0.2]}


@pytest.mark.parametrize(
    "parameters",
    [
        {},
        {"encoder.enabled": True, "effects.dry_friction.pitch": 0.02},
        {**ALL_ON, "encoder.enabled": True, "solver.step": 0.003},
        {**ALL_ON, "general.enabled": 1.0, "effects.input_delay.rotors": 0.07},
        {"effects.arm_bending.elevation": 0.02, "effects.input_delay.rotors": 0.013, "motor.time_constant": 0.0},
        {
            BY_FIELD[field].name: value
            for axis, number in zip(AXES, (7, 2, 3), strict=True)
            for field, value in table(Random(number), axis, number).items()
        },
    ],
    ids=["plain", "encoders", "everything", "general model, delay", "bending, delay, no lag", "tables"],
)
def test_the_native_unit_shows_the_bits_of_the_pythonfmu_unit(tmp_path, fmus, parameters):
    """Steps of .2 to 30 ms, one third of them of random length; states are saved, serialised and restored between."""
    needs_a_compiler()
    from fmu_src.native import build_native

    twin = build_native("HelicopterPlant", tmp_path / "native")
    run = lockstep(
        tmp_path, fmus["HelicopterPlant"], twin, parameters=parameters, inputs=INPUTS, steps=2000, seed=3,
        longest=0.03, shortest=2e-4,
    )  # fmt: skip
    assert run["different"] == 0, run


def test_start_values_are_built_into_the_native_unit(tmp_path):
    needs_a_compiler()
    from fmu_src.native import build_native

    changed = {"pitch.gain": 0.25, "effects.dry_friction.pitch": 0.05}
    run = lockstep(
        tmp_path, build("HelicopterPlant", tmp_path / "python", changed),
        build_native("HelicopterPlant", tmp_path / "native", changed), parameters={}, inputs=INPUTS, steps=200, seed=5,
        longest=0.01, shortest=0.01,
    )  # fmt: skip
    assert run["different"] == 0, run
