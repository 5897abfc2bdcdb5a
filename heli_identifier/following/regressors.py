"""The accelerations by which each change would act, from the motion that the observer sees (:mod:`.changes`)."""

from math import cos, sin

from heli_plant.state import PlantState

from ..online import Candidate, Motion, candidate_value


def acting(
    state: PlantState, mu_diff: float, mu_sum: float, laws: tuple[tuple[Candidate, ...], ...], theta0: float
) -> tuple[list[float], list[float], list[float]]:
    """Return the regressors' accelerations on pitch, elevation and travel [rad/s^2 per unit of their coefficients].

    Parameters
    ----------
    state : PlantState
        As the observer sees it.
    mu_diff, mu_sum : float
        Difference and sum of the rotors' thrust voltages [V].
    laws : tuple of three tuples
        From :func:`.changes.laws`.
    theta0 : float
        Pitch at which gravity has no torque [rad].
    """
    th, ep, la, w1, w2, w3, nu_front, nu_rear, _, _, _, rest = state
    up, aside = cos(th), sin(th)
    on_pitch = [mu_diff, mu_sum, 1.0, -w1]
    on_elevation = [mu_sum * up, mu_diff * up, -1.0, -w2]
    on_travel = [mu_sum * aside, mu_diff * aside, 1.0, -w3]
    of_pitch, of_elevation, of_travel = laws
    motion = Motion(th, ep, la, w1, w2, w3, nu_front, nu_rear, rest)
    for law in of_pitch:
        on_pitch.append(candidate_value(law, motion))
    for law in of_elevation:
        on_elevation.append(candidate_value(law, motion))
    for law in of_travel:
        on_travel.append(candidate_value(law, motion))
    on_pitch.append(-sin(th - theta0))
    on_elevation.append(-ep)
    return on_pitch, on_elevation, on_travel
