"""The excitation level: an eigenvalue, free of units, zero when something cannot be seen."""

from math import cos, radians

import numpy as np
import pytest

from heli_identifier.online.moments import excitation_level, smallest_eigenvalue


def packed(z):
    gram = z.T @ z / len(z)
    return gram[np.triu_indices(len(gram))].tolist()


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_the_smallest_eigenvalue_is_that_of_lapack(n):
    for seed in range(20):
        x = np.random.default_rng(seed).standard_normal((n, n)) * np.geomspace(1e-3, 1.0, n)
        a = x @ x.T
        # Both know an eigenvalue to rounding of the largest one.
        assert smallest_eigenvalue(a.tolist()) == pytest.approx(np.linalg.eigvalsh(a)[0], abs=1e-14 * n)


def test_orthogonal_regressors_have_level_one_whatever_their_units():
    t = np.linspace(0.0, 2 * np.pi, 1000, endpoint=False)
    z = np.column_stack([1e3 * np.sin(t), np.cos(t), 0.5 * np.sin(2 * t), np.zeros_like(t)])
    # Against the silence of 1e-2 a signal of rms .35 counts (.35^2)/(.35^2 + 1e-4): 1 - 8e-4.
    assert excitation_level(packed(z), 4, 3) == pytest.approx(1.0, abs=1e-3)


def test_two_regressors_at_a_known_angle_have_the_level_of_that_angle():
    t = np.linspace(0.0, 2 * np.pi, 1000, endpoint=False)
    angle = radians(20.0)
    z = np.column_stack([np.sin(t), np.sin(t + angle), t])
    # Eigenvalues of [[1, c], [c, 1]] are 1 +- c; silence takes 2e-4 of the unit diagonal and the same share of c.
    assert excitation_level(packed(z), 3, 2) == pytest.approx(1.0 - cos(angle), rel=3e-4)


def test_dependent_or_silent_regressors_have_level_zero():
    t = np.linspace(0.0, 2 * np.pi, 1000, endpoint=False)
    dependent = np.column_stack([np.sin(t), np.cos(t), np.sin(t) + np.cos(t), t])
    silent = np.column_stack([np.sin(t), 1e-6 * np.cos(t), t])
    assert excitation_level(packed(dependent), 4, 3) < 1e-5
    assert excitation_level(packed(silent), 3, 2) < 1e-5
    assert excitation_level([0.0] * 6, 3, 2) == 0.0
