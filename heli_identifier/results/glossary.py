"""The words of a report, each in a sentence or two: a page on paper has no tooltips."""

from heli_identifier.results.words import significant
from heli_identifier.tracing import Diagnosis


def glossary(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Give terms and what they mean, with the numbers of this diagnosis."""
    needed = significant(float(diagnosis.settings["score_needed"]), 2)
    return [
        ("±", "Half-width of the 95 % interval: 1.96 standard errors."),
        (
            "before, after",
            "The simplified model, and the corrected plant: with the effects that are shown, and with those of the "
            "possible ones that make logs likelier which were left out of the fit. Both are fitted to the training "
            "logs.",
        ),
        (
            "likelihood",
            "Of the innovations: what the model, corrected towards the measured angles at every sample, did not "
            "foresee of the next one. Beside the plant it has a torque of the air on every axis, whose level and "
            "colour are estimated, and a constant torque of every log. A nat is a factor of 2.7 in probability.",
        ),
        (
            "score",
            f"What the log-likelihood of the training logs gains by an effect, in nats. It is shown from {needed} "
            "on, which is a coefficient of four standard errors.",
        ),
        (
            "possible",
            "The likelihood favours the effect without establishing it. It is no finding.",
        ),
        (
            "left-out logs gain",
            "How much likelier a training log gets with the effect in a fit to the other logs, summed over the logs.",
        ),
        (
            "determined from outside",
            "References, which move the rig and know nothing of the air, give the same value by instruments.",
        ),
        (
            "rests on the noise model",
            "Only the likelihood gives the value. It holds if the torque of the air is as it was modelled.",
        ),
        (
            "not determined",
            "The interval is too wide for a controller, or references contradict the likelihood. The plant has the "
            "likeliest value within what is plausible for any rig of this kind.",
        ),
        (
            "held-out logs",
            "They take no part in fit and search and decide nothing. The figures before and after are theirs.",
        ),
        ("bound", "Largest size of an effect that was not shown that the logs still allow, at 95 %."),
        (
            "visibility",
            "Share of an effect's signature, that is of the change it makes to the innovations, which no change of the "
            "fitted parameters could imitate. Below 1 % an effect is not testable.",
        ),
        (
            "correlation",
            "Of the signatures of two effects, after everything has been taken out that the fitted parameters could "
            "imitate. At ±1 the two effects leave the same trace in these logs, at 0 nothing in common.",
        ),
        ("as likely", "Another effect that explains these logs about as well: the data do not decide between them."),
        (
            "noise floor",
            "Error of the corrected model on data that it generated itself, in the air and with the encoders that were "
            "estimated. If an error is at the floor, nothing is left to explain. A dash: the model is unstable, and no "
            "floor can be computed.",
        ),
        (
            "Ljung-Box p",
            "Probability that white noise is as correlated with its own past over a second as the innovations are. "
            "A small p says that the model is not exact. With thousands of samples the test also sees imperfections "
            "far below what matters for a prediction; the errors against the noise floor say how much they cost.",
        ),
    ]
