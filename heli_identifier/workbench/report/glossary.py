"""The words of a report, each in a sentence or two: a page on paper has no tooltips."""

from heli_identifier.tracing import Diagnosis
from heli_identifier.workbench.report.rounding import significant
from heli_identifier.workbench.report.sentences import listed


def glossary(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Give terms and what they mean, with the numbers of this diagnosis."""
    settings = diagnosis.settings
    threshold, hint = (significant(float(settings[name]), 2) for name in ("threshold", "hint"))
    search = significant(float(settings["filter_frequency_rad_s"]))
    clean = f"{100.0 - 100.0 * float(settings['significance']):g}"
    others = listed([significant(float(omega)) for omega in settings["agreement_frequencies_rad_s"]])
    return [
        ("±", "Half-width of the 95 % interval: 1.96 standard errors."),
        (
            "before, after",
            "The simplified model, and the same with the effects that were found; both fitted to the training logs.",
        ),
        (
            "held-out logs",
            "Take no part in fit and search. They do decide whether an effect is withdrawn, and the errors after are "
            "theirs; for a figure that nothing has been chosen by, run heli check on a further log.",
        ),
        ("score", "A coefficient over its standard error; of an unknown torque, a figure on the same scale."),
        (
            "threshold",
            f"Score from which an effect is shown, here {threshold}: the largest score of the whole catalogue stays "
            f"below it in {clean} % of diagnoses of a rig that lacks nothing, as surrogates show: copies of these "
            "logs' residual in which signs are drawn at random.",
        ),
        (
            "hint",
            f"A score between {hint} and {threshold}: one clean rig in {round(0.1 / float(settings['significance']))} "
            "has one somewhere in the catalogue. It changes no verdict.",
        ),
        ("bound", "Largest size of an effect that was not shown that the logs still allow, at 95 %."),
        ("visible", "Share of an effect's signature that no change of the fitted parameters could imitate."),
        (
            "residual",
            "What the model, gently corrected towards the measured angles, could not foresee of the next sample, as "
            "an acceleration (the innovations of an observer).",
        ),
        (
            "other filter frequencies",
            f"How gently it is corrected: {search} rad/s in the search. An effect of the rig has to come out the "
            f"same at {others} rad/s; one that does not is withdrawn.",
        ),
        (
            "torque of the room",
            "Draughts, the pull of the cable and whatever else moves the rig and is in no voltage: slow, never the "
            "same twice, and no fault of a model. A run without correction adds it up for minutes.",
        ),
        (
            "noise floor",
            "Error of the corrected model on data that it made itself, driven by noise of the residual's size and "
            "colour. What the residual still hides counts as noise there, so an error at the floor says that nothing "
            "is left that this noise would not explain as well. A dash: the model runs away from the rig even over a "
            "few seconds, and no floor can be computed.",
        ),
        (
            "Ljung-Box p",
            "Probability that white noise is as correlated with its own past over two seconds as the residual is. "
            "A small p after is no alarm by itself: a law of friction or thrust is an idealisation, and with thousands "
            "of samples the test sees imperfections far below what matters for a prediction. It says that the model "
            "is not exact; the errors against the noise floor say how much that costs.",
        ),
        (
            "times its 95 % bound",
            "The correlation of the residual with the voltages of the past two seconds, the largest of 50 lags. One "
            "lag alone stays below 1 in 95 of 100 clean records, the largest of 50 reaches some 1.6.",
        ),
    ]
