"""The blind rigs: independent of the code that they test, similar to measured logs, without traces of their truth."""

import ast
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfiltfilt

from tests.blind.battery import BATTERY, PAIRS, SINGLE, UNKNOWN
from tests.blind.coefficients import Coefficients
from tests.blind.encoders import COUNTS_PER_TURN, read
from tests.blind.generator import HEADER, NAMES, make_rig
from tests.blind.kinds import STRENGTHS, draw_rig
from tests.blind.rigs import DRAWN, SPREAD
from tests.blind.signals import V_MAX, multisines, square_and_chirp

HERE = Path(__file__).parent
DEMO = HERE.parent / "heli_identifier" / "demo_logs"
KINDS = (*STRENGTHS, *PAIRS, *UNKNOWN)


def logs_of(blind):
    return (*blind.train, blind.held)


@pytest.fixture(scope="module")
def clean():
    return make_rig(5)


def imported_by(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}: a relative import hides what it takes"
            yield node.module
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") in {"__import__", "exec", "eval"}:
            raise AssertionError(f"{path.name}: {node.func.id} hides what it takes")


def test_generator_imports_nothing_of_the_code_that_it_tests():
    allowed = {"numpy", "numba"} | (sys.stdlib_module_names - {"importlib", "runpy"})
    for path in sorted((HERE / "blind").rglob("*.py")):
        for module in imported_by(path):
            assert module.startswith("tests.blind.") or module.split(".")[0] in allowed, f"{path.name}: {module}"


@pytest.mark.parametrize("kind", KINDS)
def test_effect_of_zero_strength_leaves_the_logs_as_they_are_bit_for_bit(kind, clean):
    for log, reference in zip(logs_of(make_rig(5, kind, scale=0.0)), logs_of(clean), strict=True):
        assert np.array_equal(log, reference)


@pytest.mark.parametrize("kind", KINDS)
def test_effect_changes_what_the_encoders_read_and_not_the_voltages(kind, clean):
    changed = np.array(logs_of(make_rig(5, kind))) - np.array(logs_of(clean))
    assert np.all(changed[:, :, :3] == 0.0)
    # Five counts somewhere are far above the noise of the encoders. Only multisines reach negative thrust.
    seen = np.abs(changed[:, :, 3:]).max(axis=(1, 2)) > 5 * 2 * np.pi / 4096
    assert seen[2:].all()
    assert seen[:2].all() or kind == "reverse_thrust_loss"


def test_parameters_lie_within_their_spread_and_fill_it():
    nominal = Coefficients()
    shares = np.array([[getattr(draw_rig(s).base, n) / getattr(nominal, n) for n in DRAWN] for s in range(200)])
    assert np.all(np.abs(shares - 1) <= SPREAD)
    # A uniform variable on +-.2 has a deviation of .115; 200 draws determine it to about 5 %.
    assert shares.std(axis=0) == pytest.approx(SPREAD / np.sqrt(3), rel=0.2)
    assert draw_rig(3).base.theta0 == pytest.approx(np.deg2rad(-7.8), rel=1e-15)
    assert draw_rig(3).base.t_m == 0.08


def test_every_seed_gives_the_same_logs_again():
    for once, again in zip(logs_of(make_rig(8, "dead_zone")), logs_of(make_rig(8, "dead_zone")), strict=True):
        assert np.array_equal(once, again)


def test_moving_mass_moves_at_the_same_time_in_every_log_of_a_rig():
    rig = draw_rig(4, "moving_mass")
    (effect,) = rig.effects
    assert abs(effect.coefficient) == STRENGTHS["moving_mass"][0][0][1]
    assert rig.coefficients().mass_time == effect.shape["t_1"]
    assert 20.0 <= effect.shape["t_1"] <= 70.0


def test_joint_effects_come_with_one_entry_per_axis():
    assert [(e.axis, e.coefficient) for e in draw_rig(1, "gyroscopic_coupling").effects] == [
        ("pitch", 0.04),
        ("elevation", 0.02),
    ]


def test_axis_of_a_kind_is_drawn_unless_it_is_named():
    drawn = {draw_rig(seed, "dry_friction").effects[0].axis for seed in range(30)}
    assert drawn == {"pitch", "elevation", "travel"}
    assert draw_rig(1, "dry_friction:travel", 0.35).effects[0].coefficient == pytest.approx(0.35 * 0.03)


@pytest.mark.parametrize("kind", ["friction", "dry_friction:roll", "unknown:wind"])
def test_kind_that_does_not_exist_is_refused_by_name(kind):
    with pytest.raises(ValueError, match=kind.split(":")[-1]):
        draw_rig(1, kind)


def test_periodic_torque_stays_away_from_the_resonance():
    for seed in range(100):
        rig = draw_rig(seed, "unknown:periodic")
        frequency = rig.unknown.shape["frequency"]
        stiffness = {"pitch": rig.base.a_th, "elevation": rig.base.a_e, "travel": 0.0}[rig.unknown.axis]
        assert 0.15 <= frequency <= 1.5
        assert abs(2 * np.pi * frequency - np.sqrt(stiffness)) > 0.24 * np.sqrt(stiffness)


def test_encoders_give_whole_counts_with_noise_of_a_quarter_count():
    ramp = np.outer(np.arange(20_000) * 1e-4, np.ones(3))
    counts = read(ramp, 0.25, np.random.default_rng(2)) / (2 * np.pi / COUNTS_PER_TURN)
    assert np.abs(counts - counts.round()).max() < 1e-9
    # Variances of quantisation 1/12 and noise 1/16, six times each in a second difference; 20000 values give 1 %.
    assert np.diff(counts, 2, axis=0).std(axis=0) == pytest.approx(np.sqrt(6 * (1 / 12 + 1 / 16)), rel=0.03)


def test_multisines_have_the_stated_mean_and_rms_within_the_voltage_limit():
    v = multisines(90.0, np.random.default_rng(1))
    mu_s, mu_d = v.sum(axis=1), v[:, 0] - v[:, 1]
    # The record holds whole periods; voltages are rounded to five decimals.
    assert (mu_s.mean(), mu_d.mean()) == pytest.approx((2.0, 0.0), abs=1e-5)
    assert (mu_s.std(), mu_d.std()) == pytest.approx((0.9, 0.45), abs=1e-5)
    assert np.abs(v).max() < V_MAX
    assert abs(np.mean((mu_s - 2.0) * mu_d)) < 1e-5  # disjoint lines


@pytest.mark.parametrize(("name", "slowness"), [("train1", 1.0), ("train2", 2.0)])
def test_training_signals_are_those_of_the_measured_logs(name, slowness):
    measured = np.loadtxt(DEMO / "rig-c" / f"{name}.csv", delimiter=",", skiprows=1)
    assert np.array_equal(measured[:, 1:3], square_and_chirp(90.0, slowness))


def unexplained(log):
    """Residual of least squares on pitch and travel below .5 Hz [rad/s^2], and the noise of the counts."""
    h, t_m, theta0 = 0.01, 0.08, np.deg2rad(-7.8)
    low = butter(4, 0.5, fs=100, output="sos")
    v = log[:, 1:3]
    stay = np.exp(-h / t_m)
    nu = v[0] + lfilter([0.0, 1 - stay], [1.0, -stay], v - v[0], axis=0)
    angles = sosfiltfilt(low, log[:, 3:], axis=0, padlen=1500)
    w = np.gradient(angles, h, axis=0)
    pitch = np.column_stack([w[:, 0], np.sin(log[:, 3] - theta0), nu[:, 0] - nu[:, 1], np.ones(len(w))])
    travel = np.column_stack([w[:, 2], nu.sum(axis=1) * np.sin(log[:, 3]), np.ones(len(w))])
    inner = slice(400, -400)  # the filter's ends
    left = []
    for axis, columns in ((0, pitch), (2, travel)):
        x = sosfiltfilt(low, columns, axis=0, padlen=1500)[inner]
        y = np.gradient(w[:, axis], h)[inner]
        left.append((y - x @ np.linalg.lstsq(x, y, rcond=None)[0]).std())
    counts = np.diff(log[:, 3:] * COUNTS_PER_TURN / (2 * np.pi), 2, axis=0).std(axis=0)
    return np.array([*left, *counts])


@pytest.mark.parametrize(("folder", "kind", "scale"), [("rig-c", "clean", 1.0), ("rig-a", "dry_friction:pitch", 1.25)])
def test_residual_of_the_logs_is_as_large_as_that_of_measured_ones(folder, kind, scale):
    measured = [np.loadtxt(DEMO / folder / f"{name}.csv", delimiter=",", skiprows=1) for name in NAMES]
    reference = np.mean([unexplained(log) for log in measured], axis=0)
    made = np.mean([unexplained(log) for seed in (1, 2) for log in logs_of(make_rig(seed, kind, scale))], axis=0)
    # Four logs hold about 4 * 80 independent torques: 5 % on a deviation. The parameters of the rigs differ as well.
    assert made == pytest.approx(reference, rel=0.25)


def test_files_contain_the_measured_columns_only(tmp_path):
    blind = make_rig(6, "arm_bending")
    paths = blind.write(tmp_path / "rig")
    assert sorted(path.name for path in (tmp_path / "rig").iterdir()) == sorted(f"{name}.csv" for name in NAMES)
    for path, log in zip(paths, logs_of(blind), strict=True):
        assert path.read_text().splitlines()[0] == HEADER
        assert np.array_equal(np.loadtxt(path, delimiter=",", skiprows=1), log)
        assert log.shape == (9000, 6)


def test_battery_holds_every_bar_with_seeds_that_no_two_rigs_share():
    groups = {group: sum(c.count for c in BATTERY if c.group == group) for group in ("clean", "single", "pair")}
    assert groups == {"clean": 200, "single": 20 * len(SINGLE), "pair": 120}
    assert len(SINGLE) == 16
    seeds = [case.seed(i) for case in BATTERY for i in range(case.count)]
    assert len(set(seeds)) == len(seeds)
