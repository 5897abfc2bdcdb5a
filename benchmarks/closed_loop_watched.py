"""Scores of watched effects in closed loop: how often an absent effect passes 3, and how often a present one does.

python -m benchmarks.closed_loop_watched
"""

import numpy as np

from benchmarks.closed_loop_rigs import closed_loop_rigs
from benchmarks.tables import table
from heli_identifier.online import PREDICTION_ERROR, IdentifierSettings, prepare, start, step

PRESENT = {
    ("dry_friction", "pitch"): {"dry_friction_pitch": 0.03},
    ("quadratic_drag", "pitch"): {"quadratic_drag_pitch": 0.3},
    ("dry_friction", "elevation"): {"dry_friction_elevation": 0.02},
    ("dry_friction", "travel"): {"dry_friction_travel": 0.03},
    ("quadratic_thrust", "pitch"): {"quadratic_thrust": 0.1},
}
"""Watched effects, and the strength at which the power is measured [rad/s^2], [1/rad], [1/V]."""

LIMIT, SEEDS = 3.0, (2, 3)


def scores(rigs):
    """Return the scores of all watched effects in every log, (logs, effects)."""
    found = []
    for rig in rigs:
        for log in rig.logs:
            settings = IdentifierSettings(
                sample_time=log.step, method=PREDICTION_ERROR, watched=tuple(PRESENT), report_interval=0.5
            )
            plan = prepare(settings)
            rows = np.column_stack((log.voltages, log.angles)).tolist()
            state = start(plan, *rows[0])
            for row in rows[1:]:
                state, output = step(state, *row, plan)
            found.append([score.score for score in output.scores])
    return np.array(found)


def main():
    absent = np.abs(np.concatenate([scores(closed_loop_rigs(seed)) for seed in SEEDS])) > LIMIT
    rows = []
    for column, (name, effects) in enumerate(PRESENT.items()):
        present = np.abs(scores(closed_loop_rigs(SEEDS[0], effects=effects))[:, column]) > LIMIT
        strength = ", ".join(f"{value:g}" for value in effects.values())
        alarms = absent[:, column]
        rows.append((":".join(name), f"{100 * alarms.mean():.1f} %", strength, f"{100 * present.mean():.0f} %"))
    rows.append(("all", f"{100 * absent.mean():.1f} % of {absent.size}", "", ""))
    print(table(("effect", f"absent, beyond {LIMIT:g}", "strength", f"present, beyond {LIMIT:g}"), rows))


if __name__ == "__main__":
    main()
