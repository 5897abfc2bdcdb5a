"""The words of a report, each in a sentence or two: a page on paper has no tooltips."""

from heli_identifier.tracing import Diagnosis
from heli_identifier.workbench.report.rounding import significant
from heli_identifier.workbench.report.sentences import listed


def glossary(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Give terms and what they mean, with the numbers of this diagnosis."""
    settings = diagnosis.settings
    threshold, suggestive = (significant(float(settings[name]), 2) for name in ("threshold", "hint"))
    search = significant(float(settings["filter_frequency_rad_s"]))
    clean = f"{100.0 - 100.0 * float(settings['significance']):g}"
    others = listed([significant(float(omega)) for omega in settings["agreement_frequencies_rad_s"]])
    return [
        ("±", "Half-width of the 95 % interval: 1.96 standard errors."),
        (
            "before, after",
            "The simplified model, and the corrected one: with the effects that are shown and the predictive ones. All "
            "models are fitted to the training logs.",
        ),
        (
            "shown",
            "The likelihood of the samples one step ahead detects the effect. Of rigs that lack nothing, few have any "
            "effect shown: see threshold.",
        ),
        (
            "predictive",
            "The effect improves predictions over half a second to two seconds beyond the effects that are shown, and "
            "most halves of the training data find it. Its cause is not established.",
        ),
        (
            "by likelihood",
            "The coefficient of a predictive effect as the samples one step ahead give it, beside the effects shown. "
            "Where it differs from the one that predicts best, a controller or another effect may be the cause.",
        ),
        (
            "stability",
            "Share of halves of the training data that find the effect or another one of its family. From 80 % an "
            "effect can be shown or predictive, from 30 % it is called possible.",
        ),
        (
            "error without",
            "Share by which the error of the axis that needs the effect most grows in a fit without it.",
        ),
        (
            "everything",
            "A ridge fit of all effects of the catalogue at once. No single coefficient of it means much, but its "
            "error says how much the catalogue could explain.",
        ),
        (
            "held-out logs",
            "They take no part in fit and search, but they decide whether an effect is withdrawn, and the errors "
            "before and after are theirs. For an error on data that decided nothing, run heli check on a further log.",
        ),
        (
            "score",
            "A coefficient over its standard error; of an unknown torque, the square root of its likelihood-ratio "
            "statistic, brought to the same scale.",
        ),
        (
            "threshold",
            f"Score from which an effect is shown, here {threshold}. If the model lacks nothing, the largest score of "
            f"the whole catalogue stays below it in {clean} % of the diagnoses. It is found with surrogates: copies of "
            "these logs' residual in which signs are drawn at random.",
        ),
        (
            "suggestive",
            f"A score between {suggestive} and {threshold}. Of rigs that lack nothing, one in "
            f"{round(0.1 / float(settings['significance']))} has such a score somewhere in the catalogue. It changes "
            "no verdict.",
        ),
        ("bound", "Largest size of an effect that was not shown that the logs still allow, at 95 %."),
        (
            "visibility",
            "Share of an effect's signature, that is of the change it makes to the residual, which no change of the "
            "fitted parameters could imitate. Below 1 % an effect is not testable.",
        ),
        (
            "correlation",
            "Of the signatures of two effects, after everything has been taken out that the fitted parameters could "
            "imitate. At ±1 the two effects leave the same trace in these logs, at 0 nothing in common.",
        ),
        ("as likely", "Another effect that explains these logs about as well: the data do not decide between them."),
        (
            "residual",
            "Innovations of an observer: what the model, corrected towards the measured angles, did not foresee of the "
            "next sample, as an acceleration.",
        ),
        (
            "other filter frequencies",
            f"Bandwidth of the observer's correction: {search} rad/s in the search. The coefficient of an effect has "
            f"to be the same at {others} rad/s; otherwise the effect is withdrawn.",
        ),
        (
            "process noise",
            "Torques that are in no voltage, such as draughts and the pull of the cable. They are slow, differ in "
            "every run, and are no fault of the model. A free run adds them up over the whole log.",
        ),
        (
            "noise floor",
            "Error of the corrected model on data that it generated itself, driven by noise of the residual's size and "
            "spectrum. If an error is at the floor, noise like the residual explains all of it. A dash: the model is "
            "unstable, and no floor can be computed.",
        ),
        (
            "Ljung-Box p",
            "Probability that white noise is as correlated with its own past over two seconds as the residual is. "
            "A small p says that the model is not exact. With thousands of samples the test also sees imperfections "
            "far below what matters for a prediction; the errors against the noise floor say how much they cost.",
        ),
        (
            "times its 95 % bound",
            "Largest correlation, over 50 lags, of the residual with the voltages of the past two seconds. In clean "
            "records a single lag stays below 1 in 95 of 100 cases, and the largest of 50 lags reaches about 1.6.",
        ),
    ]
