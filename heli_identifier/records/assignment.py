"""Which columns of an unknown log are angles and voltages, by what they do to each other.

Every choice of pitch, elevation, travel and a pair of voltages is scored by how much of the three accelerations the
voltages explain (`response`). The pair may be front and rear, or sum and difference. The travel decides most: nothing
but k_y (v_f + v_r) sin θ moves it, so that this explains nine tenths and more of it even where a controller has made
everything depend on everything.

Columns that are the derivative of another one are neither. Four columns of which two are sum and difference of the
other two are the voltages. Encoders turn in steps, so an angle that does is preferred to a reference or an estimate.
"""

from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records.response import coarse, encoder_step, filtered, radians_of
from heli_identifier.records.units import ANGLES, COMBINED, VOLTAGES

_Key = tuple[str, int, int]
"""Of a regressor: sum + or difference - of two columns, or one column alone."""

MOST_COLUMNS = 24
"""Columns among which is searched; the work grows with their fourth power."""

CERTAIN = 0.5
"""Share of the travel's acceleration from which the choice is beyond doubt."""

_BOTH = 0.05  # by which front and rear are preferred to sum and difference where a file holds both
_ALIKE = 0.95  # correlation of a column with the derivative of another that makes it that derivative
_IN_STEPS = 0.3  # by which an angle that an encoder measured is preferred


def assign_columns(columns: NDArray[np.float64], rate_hz: float, known: dict[str, int]) -> dict[str, int] | None:
    """Choose the columns that respond to each other as pitch, elevation, travel and voltages do.

    Parameters
    ----------
    columns : NDArray, shape (N, k)
        Candidates, uniformly sampled at `rate_hz` [Hz].
    known : dict
        Index of the column of signals that are known by name.

    Returns
    -------
    dict or None
        Index of the column of each signal, with v_front and v_rear or v_sum and v_difference; None if there are too
        few or too many candidates.
    """
    count = columns.shape[1]
    if not 5 <= count <= MOST_COLUMNS:
        return None
    values, step = coarse(columns, rate_hz)
    derived = _derivatives(values, step) - set(known.values())
    moving = [index for index in range(count) if np.ptp(values[:, index]) > 0.0 and index not in derived]
    if not set(known) & {*VOLTAGES, *COMBINED}:
        related, combinations_of_them = _related(columns, moving)
        known = {**known, **related}
        moving = [index for index in moving if index not in combinations_of_them]
    pairs = _pairs(moving, known)
    if not pairs:
        return None
    free = {angle: [known[angle]] if angle in known else moving for angle in ANGLES}
    taken = set(known.values())
    free = {a: [i for i in those if a in known or i not in taken] for a, those in free.items()}
    best: tuple[float, dict[str, int]] | None = None
    shares = _Shares(values, step, {key for pair in pairs for key in pair[1:]})
    in_steps = {index: encoder_step(columns[:, index]) is not None for index in moving + list(known.values())}
    for names, total, difference in pairs:
        own = {int(part) for part in names.values()}
        pitch = {p: shares.of(p, difference) for p in free["pitch"] if p not in own}
        lift = {e: shares.of(e, total) for e in free["elevation"] if e not in own}
        for p in sorted(pitch, key=lambda p: -pitch[p] - _IN_STEPS * in_steps[p])[:6]:
            for t in free["travel"]:
                if t in own or t == p:
                    continue
                travel = shares.of(t, total, p)
                others = [e for e in lift if e not in (p, t)]
                if not others:
                    continue
                e = max(others, key=lambda e: lift[e] + _IN_STEPS * in_steps[e])
                turning = sum(_IN_STEPS * in_steps[angle] for angle in (p, e, t))
                score = 2.0 * travel + pitch[p] + lift[e] + turning + (_BOTH if "v_front" in names else 0.0)
                if best is None or score > best[0] + 1e-6:
                    best = score, {**names, "pitch": p, "elevation": e, "travel": t}
    return best[1] if best else None


def _derivatives(values: NDArray[np.float64], step: float) -> set[int]:
    """Columns of ``values``, shape (M, k), that are the derivative of another one in the same unit per second."""
    found = filtered(values, step)
    value = found.value - found.value.mean(axis=0)
    rate = found.rate - found.rate.mean(axis=0)
    own, of_rates = (value**2).sum(axis=0), (rate**2).sum(axis=0)
    both = rate.T @ value  # row: whose derivative, column: which column
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = both / np.sqrt(np.outer(of_rates, own))
        slope = both / of_rates[:, None]
    alike = (correlation > _ALIKE) & (np.abs(slope - 1.0) < 1.0 - _ALIKE + 0.15)
    return set(np.flatnonzero(alike.any(axis=0)).tolist())


def _related(columns: NDArray[np.float64], moving: list[int]) -> tuple[dict[str, int], set[int]]:
    """Front and rear voltage where further columns are their sum and their difference, and those; nothing elsewhere."""
    scale = np.abs(columns).max(axis=0)
    for i, j in combinations(moving, 2):
        total, difference = columns[:, i] + columns[:, j], columns[:, i] - columns[:, j]
        small = 1e-6 * max(scale[i], scale[j])
        others = [k for k in moving if k not in (i, j)]
        totals = {k for k in others if np.abs(columns[:, k] - total).max() < small}
        differences = {
            k
            for k in others
            if min(np.abs(columns[:, k] - difference).max(), np.abs(columns[:, k] + difference).max()) < small
        }
        if totals and differences:
            return {"v_front": i, "v_rear": j}, totals | differences
    return {}, set()


def _pairs(moving: list[int], known: dict[str, int]) -> list[tuple[dict[str, int], _Key, _Key]]:
    """Candidates of the voltages: columns by signal, and what makes their sum and their difference."""
    found = []
    taken = {index for signal, index in known.items() if signal not in (*VOLTAGES, *COMBINED)}
    for kind in (VOLTAGES, COMBINED):
        if any(signal in known for signal in kind):
            options = [[known[s]] if s in known else [i for i in moving if i not in taken] for s in kind]
            choices = [(i, j) for i in options[0] for j in options[1] if i != j]
        elif any(signal in known for signal in (*VOLTAGES, *COMBINED)):
            continue
        else:
            choices = list(permutations([i for i in moving if i not in taken], 2))
            if kind == VOLTAGES:  # the sign of the gain will tell the two apart
                choices = [(i, j) for i, j in choices if i < j]
        for i, j in choices:
            if kind == VOLTAGES:
                found.append(({kind[0]: i, kind[1]: j}, ("+", i, j), ("-", i, j)))
            else:
                found.append(({kind[0]: i, kind[1]: j}, ("", i, i), ("", j, j)))
    return found


def _total(values: NDArray[np.float64], key: _Key) -> NDArray[np.float64]:
    sign, i, j = key
    if not sign:
        return values[:, i]
    return values[:, i] + values[:, j] if sign == "+" else values[:, i] - values[:, j]


class _Shares:
    """Shares of accelerations that regressors explain, each computed once."""

    def __init__(self, values: NDArray[np.float64], step: float, keys: set[_Key]) -> None:
        self.values, self.step = values, step
        self.place = {key: index for index, key in enumerate(sorted(keys))}
        self.regressors = np.column_stack([_total(values, key) for key in self.place])
        self.filtered = filtered(values, step)
        self.turned = {-1: filtered(self.regressors, step).value}
        self.bases: dict[int, tuple[NDArray[np.float64], NDArray[np.float64]]] = {}
        self.found: dict[tuple[int, int], NDArray[np.float64]] = {}

    def of(self, angle: int, key: _Key, pitch: int = -1) -> float:
        """Share of an angle's acceleration that a regressor explains, times the sine of ``pitch`` unless it is -1."""
        if (angle, pitch) not in self.found:
            self.found[angle, pitch] = self._all(angle, pitch)
        return float(self.found[angle, pitch][self.place[key]])

    def _all(self, angle: int, pitch: int) -> NDArray[np.float64]:
        if pitch not in self.turned:
            sine = np.sin(radians_of(self.values[:, pitch]))
            self.turned[pitch] = filtered(self.regressors * sine[:, None], self.step).value
        regressors = self.turned[pitch]
        basis, y = self._base(angle)
        x = regressors - basis @ (basis.T @ regressors)
        xx, whole = (x * x).sum(axis=0), (regressors * regressors).sum(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.nan_to_num(np.where(xx > 1e-9 * whole, (y @ x) ** 2 / (xx * float(y @ y)), 0.0))

    def _base(self, angle: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Orthonormal basis of an angle's own motion and a constant, and what they leave of its acceleration."""
        if angle not in self.bases:
            found = self.filtered
            own = np.column_stack((found.rate[:, angle], found.value[:, angle], np.ones(len(found.value))))
            basis = np.linalg.qr(own / np.maximum(np.abs(own).max(axis=0), 1e-300))[0]
            y = found.acceleration[:, angle]
            self.bases[angle] = basis, y - basis @ (basis.T @ y)
        return self.bases[angle]
