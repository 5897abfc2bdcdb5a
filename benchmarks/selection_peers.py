"""Stepwise selections of other packages on given regressor matrices, in a process and, if needed, an own environment.

    python benchmarks/selection_peers.py METHOD MATRIX...

Each MATRIX is an npz file with the regressors X (M, K), columns of unit length, and the regressand y (M,) of unit
variance. The program prints one JSON list with {"seconds", "chosen"} per matrix. Only the selection is timed, after one
run on a few rows. Nothing of this project is imported, because the environment of SysIdentPy does not contain it.

The tuned methods take from their path the model with the lowest Schwarz criterion M log(|e|^2/M) + k log M.
"""

import json
import sys
import warnings
from time import perf_counter

import numpy as np

FEW_ROWS = 500
MOST_TERMS = 15
"""SysIdentPy's default; the tuned pysindy FROLS goes as far."""


def schwarz(squares, rows, terms):
    """Criterion of models by their sums of squared errors and numbers of terms."""
    return rows * np.log(np.asarray(squares) / rows) + np.asarray(terms) * np.log(rows)


def best_on_path(path, squares, rows):
    """Terms of the model of a path that has the lowest criterion."""
    chosen = [np.flatnonzero(np.ravel(coefficients)) for coefficients in path]
    return chosen[int(np.argmin(schwarz(squares, rows, [len(terms) for terms in chosen])))]


def ssr(X, y):
    """Run pysindy's SSR as it comes."""
    from pysindy.optimizers import SSR

    return np.flatnonzero(np.ravel(SSR().fit(X, y[:, None]).coef_))


def ssr_tuned(X, y):
    """Run pysindy's SSR eliminating down to one term, the path's best by Schwarz's criterion."""
    from pysindy.optimizers import SSR

    path = SSR(alpha=1e-9, max_iter=X.shape[1]).fit(X, y[:, None])
    # the first entry of its history is the array that it continues to change, so it does not hold the full model
    return best_on_path(path.history_[1:], path.err_history_[1:], len(y))


def frols(X, y):
    """Run pysindy's FROLS as it comes."""
    from pysindy.optimizers import FROLS

    return np.flatnonzero(np.ravel(FROLS().fit(X, y[:, None]).coef_))


def frols_tuned(X, y):
    """Run pysindy's FROLS up to fifteen terms, the path's best by Schwarz's criterion."""
    from pysindy.optimizers import FROLS

    path = FROLS(alpha=1e-9, max_iter=MOST_TERMS).fit(X, y[:, None])
    explained = np.concatenate(([0.0], np.cumsum(path.ERR_global[:, 0])))[: len(path.history_)]
    return best_on_path(path.history_, y @ y * (1.0 - explained), len(y))


def sysidentpy(X, y):
    """Run SysIdentPy's FROLS as it comes: Akaike's criterion over fifteen orders, recursive least squares."""
    return _sysidentpy(X, y)


def sysidentpy_tuned(X, y):
    """Run SysIdentPy's FROLS with Schwarz's criterion and least squares."""
    from sysidentpy.parameter_estimation import LeastSquares

    return _sysidentpy(X, y, info_criteria="bic", estimator=LeastSquares())


def _sysidentpy(X, y, **options):
    """Order by information criterion, then terms by error reduction: what its ``fit`` does after making lags."""
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.model_structure_selection.ofr_base import get_min_info_value

    model = FROLS(ylag=1, xlag=1, n_info_values=min(MOST_TERMS, X.shape[1]), **options)
    model.max_lag = 0
    terms = int(get_min_info_value(model.information_criterion(X, y[:, None])))
    return model.run_mss_algorithm(X, y[:, None], terms)[1][:terms]


METHODS = {method.__name__: method for method in (ssr, ssr_tuned, frols, frols_tuned, sysidentpy, sysidentpy_tuned)}


def main(method, paths):
    work, answers = METHODS[method], []
    for path in paths:
        with np.load(path) as matrix:
            X, y = np.ascontiguousarray(matrix["X"]), matrix["y"]
        if not answers:
            work(X[:FEW_ROWS], y[:FEW_ROWS])
        began = perf_counter()
        chosen = work(X, y)
        answers.append({"seconds": perf_counter() - began, "chosen": [int(i) for i in chosen]})
    print(json.dumps(answers))


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main(sys.argv[1], sys.argv[2:])
