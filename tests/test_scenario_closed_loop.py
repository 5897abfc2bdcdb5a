"""The scenario closed_loop as users run it: PID flying, exciter on top, identifier right."""

from benchmarks.figures import ORDER
from fmu_src.master import run_apart
from heli_plant.parameters import TABLE_2


def test_the_identifier_finds_gain_and_stiffness_and_sees_the_loop(fmus):
    files = {
        "exciter": fmus["Exciter"],
        "controller": fmus["PidController"],
        "plant": fmus["HelicopterPlant"],
        "identifier": fmus["AdaptiveIdentifier"],
    }
    result = run_apart("closed_loop", 60.0, 0.01, ORDER, files)
    last = {name: float(result.column(f"identifier.{name}")[-1]) for name in ("closed_loop", "determined.k_z")}
    assert last == {"closed_loop": 1.0, "determined.k_z": 1.0}
    for name in ("k_x", "k_z", "a_e"):
        found = float(result.column(f"identifier.{name}")[-1])
        error = float(result.column(f"identifier.standard_error.{name}")[-1])
        # 3.5 standard errors; the adaptation is 10 and more of its own away from k_z.
        assert abs(found - getattr(TABLE_2, name)) < 3.5 * error
