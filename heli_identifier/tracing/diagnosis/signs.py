"""Signs of the fitted gains as a check of a log's conventions: more voltage lifts.

A larger v_f - v_r raises the pitch, k_x > 0; a larger v_f + v_r raises the elevation, k_z > 0 (Table 2). A log whose
pitch counts the other way, whose front and rear are exchanged or whose elevation counts downwards fits the null model
as well, with a negative gain, but the search for effects would then go wrong. The sign of k_y alone is a convention,
the sense of the travel; where k_x < 0 it distinguishes the two causes:

| k_x | k_y | k_z | then |
|---|---|---|---|
| < 0 | > 0 | > 0 | the pitch counts the other way |
| < 0 | < 0 | > 0 | front and rear are exchanged |
| > 0 | | < 0 | the elevation counts the other way |
| < 0 | > 0 | < 0 | pitch and elevation count the other way, or both voltages do |
| < 0 | < 0 | < 0 | front and rear are exchanged, and the elevation counts the other way |
"""

from collections.abc import Mapping

from heli_identifier.online import Estimate

CERTAIN = 3.0
"""Standard errors from zero at which a sign is beyond chance: one gain in a thousand is by chance."""


def sign_notes(estimates: Mapping[str, Estimate]) -> tuple[str, ...]:
    """Warn of gains that are significantly negative, and name what to change in the rig's configuration.

    Parameters
    ----------
    estimates : mapping of str to Estimate
        Of the null model, by the paper's symbols.
    """
    pitch, elevation, travel = (_sign(estimates[name]) for name in ("k_x", "k_z", "k_y"))
    negative = [name for name, sign in (("k_x", pitch), ("k_z", elevation)) if sign < 0]
    if not negative:
        return ()
    causes, remedies = [], []
    if pitch < 0 and travel < 0:
        causes, remedies = ["front and rear are exchanged"], ["swap_rotors = true under [log]"]
    elif pitch < 0 and travel > 0:
        causes, remedies = ["the pitch counts the other way"], ["pitch = -1 under [log.signs]"]
    elif pitch < 0:
        causes = ["the pitch counts the other way or front and rear are exchanged"]
        remedies = ["pitch = -1 under [log.signs] or swap_rotors = true under [log]"]
    if elevation < 0:
        causes.append("the elevation counts the other way")
        remedies.append("elevation = -1 under [log.signs]")
    cause, advice = " and ".join(causes), f"set {' and '.join(remedies)} of heli.toml (`heli init` writes one)"
    if pitch < 0 and elevation < 0 and travel >= 0:
        cause += ", or both voltages do"
        advice += " (for the voltages v_front = -1 and v_rear = -1)"
    gains = " and ".join(f"{name} = {estimates[name].value:.3g} {estimates[name].unit}" for name in negative)
    are = "are" if len(negative) > 1 else "is"
    return (
        f"WRONG SIGN: {gains} {are} negative, so {cause}; do not trust this result but {advice}, "
        "or take the entry away if it stands there already, and run it again",
    )


def _sign(estimate: Estimate) -> int:
    """Give -1 or 1 where a sign is beyond chance, else 0."""
    if abs(estimate.value) <= CERTAIN * (estimate.standard_error or 0.0):
        return 0
    return 1 if estimate.value > 0.0 else -1
