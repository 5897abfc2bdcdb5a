"""The fit alone beside general tools: scipy's least_squares, and the same with CasADi's Jacobian.

Four logs of 90 s at 100 Hz of the blind generator, the eleven parameters of the simplified model. The general tools
minimise the errors of a simulation over the whole log, which needs no noise model: they do less. Each starts where our
fit starts and ends at its own tolerance. Times are of one core, after compilation.
"""

from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from benchmarks.harness import section, table
from benchmarks.rigs import likelihood_of, log_of
from heli_identifier.online import ModelParameters
from heli_identifier.results import significant
from heli_identifier.tracing import Likelihood
from heli_identifier.tracing import fit as likelihood_fit
from heli_plant.parameters import PlantParameters
from tests.blind.generator import simulate_log
from tests.blind.rigs import draw_rig
from tests.blind.signals import multisines

Array = NDArray[np.float64]
H, LOGS, SECONDS, ROUNDS = 0.01, 4, 90.0, 3
NAMES = ModelParameters._fields


def shooting(likelihood: Likelihood, start: PlantParameters) -> Array:
    """Fit by least squares of simulation errors, derivatives by finite differences of the compiled plant."""
    rig = likelihood.rig
    x0 = np.array([getattr(start, name) for name in NAMES])
    width = np.maximum(np.abs(x0), 0.05)

    def errors(x: Array) -> Array:
        p = start._replace(**dict(zip(NAMES, (float(v) for v in x * width), strict=True)))
        parts = [rig.simulate(r.inputs, r.step, r.start, p) - r.angles for r in likelihood.records]
        return np.nan_to_num(np.concatenate(parts).ravel(), nan=1e3, posinf=1e3, neginf=-1e3)

    return least_squares(errors, x0 / width, method="trf", x_scale="jac").x * width


def casadi_shooting(likelihood: Likelihood, start: PlantParameters) -> Array:
    """Fit the same by CasADi: RK4 as a mapped function, its exact Jacobian for least_squares."""
    import casadi as ca

    p, x, u = ca.MX.sym("p", len(NAMES)), ca.MX.sym("x", 8), ca.MX.sym("u", 2)
    k = dict(zip(NAMES, ca.vertsplit(p), strict=True))
    h, T = H, start.T_m

    def slope(x: Any) -> Any:
        th, e, _, wx, wz, wy, f, r = ca.vertsplit(x)
        diff, total = f - r, f + r
        return ca.vertcat(
            wx, wz, wy,
            -k["a_wx"] * wx - k["a_th"] * ca.sin(th - k["theta0"]) + k["k_x"] * diff,
            -k["a_wz"] * wz - k["a_e"] * e - k["a_1"] - k["a_lt"] * wx * wy + k["k_z"] * total * ca.cos(th),
            -k["a_wy"] * wy + k["k_y"] * total * ca.sin(th),
            (u[0] - f) / T, (u[1] - r) / T,
        )  # fmt: skip

    a = slope(x)
    b = slope(x + 0.5 * h * a)
    c = slope(x + 0.5 * h * b)
    d = slope(x + h * c)
    step = ca.Function("step", [x, u, p], [x + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)])
    residuals = []
    for record in likelihood.records:
        run = step.mapaccum(record.samples - 1)
        angles = run(record.start[:8], record.inputs[:-1].T, p)[:3, :]
        residuals.append(ca.vec(angles - record.angles[1:].T))
    r = ca.vertcat(*residuals)
    value, jacobian = (ca.Function("f", [p], [f]) for f in (r, ca.jacobian(r, p)))
    x0 = np.array([getattr(start, name) for name in NAMES])
    return least_squares(lambda x: value(x).full().ravel(), x0, lambda x: jacobian(x).full(), x_scale="jac").x


def fit() -> str:
    """Measure, and give the section of the page."""
    generated = draw_rig(np.random.SeedSequence(11), "clean")
    flights = [multisines(SECONDS, np.random.default_rng(number)) for number in range(LOGS)]
    logs = [log_of(f"log{k}", 1.0 / H, simulate_log(generated, flight, k)) for k, flight in enumerate(flights)]
    likelihood = likelihood_of(logs)
    rig, start = likelihood.rig, likelihood.rig.estimate(likelihood.records)
    fields = [name for name in rig.base if name in NAMES]

    def ours(likelihood: Likelihood, _start: PlantParameters) -> Array:
        found = likelihood_fit(likelihood, fields).parameters
        return np.array([getattr(found, name) for name in NAMES])

    contenders: dict[str, Callable[[Likelihood, PlantParameters], Array]] = {
        "this project: likelihood, air and offsets": ours,
        "scipy least_squares on simulation errors": shooting,
        "CasADi single shooting, exact Jacobian": casadi_shooting,
    }
    rows, least = [], 0.0
    with threadpool_limits(1):
        ours(likelihood, start)
        for name, run in contenders.items():
            times, found = [process_time()], np.empty(0)
            for _ in range(ROUNDS):
                found = run(likelihood, start)
                times.append(process_time())
            time = float(np.median(np.diff(times)))
            least = least or time
            off = max(abs(found[NAMES.index(k)] / getattr(generated.base, k) - 1.0) for k in ("k_x", "k_z", "k_y"))
            rows.append((name, significant(time), f"{time / least:.1f}", f"{off:.2%}"))
    samples = sum(record.samples for record in likelihood.records)
    return section(
        "The fit alone",
        f"{len(fields)} parameters, {samples} samples, processor time of one core, median of {ROUNDS}; the largest "
        "error of a gain against the truth.",
        table(("fit", "time [s]", "over ours", "gains off by"), rows),
        packages=("numpy", "scipy", "casadi"),
    )
