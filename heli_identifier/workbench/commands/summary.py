"""A diagnosis on the terminal."""

import typer

from heli_identifier.tracing import Diagnosis
from heli_identifier.workbench.commands.terminal import print_table, warn
from heli_identifier.workbench.report.rounding import angle_text, significant, with_interval
from heli_identifier.workbench.report.sentences import effect_title, verdict_sentence, withdrawn_sentence
from heli_identifier.workbench.report.tables import floor_missing, parameter_rows


def print_diagnosis(diagnosis: Diagnosis, reasons: bool = False) -> None:
    """Print the verdict, the effects, the parameters and the errors; with ``reasons`` the catalogue as well."""
    typer.secho(verdict_sentence(diagnosis), bold=True)
    print_effects(diagnosis)
    print_parameters(diagnosis)
    print_errors(diagnosis)
    for entry in diagnosis.withdrawn:
        typer.echo(withdrawn_sentence(entry))
    if reasons:
        print_catalogue(diagnosis)
    for text in diagnosis.notes:  # last, as what stands last on a terminal is seen
        warn(text)


def print_effects(diagnosis: Diagnosis) -> None:
    """Print what was found."""
    if diagnosis.effects:
        print_table(
            "Effects that the model lacks (± 1.96 standard errors)",
            ("effect", "coefficient >", "verdict", "score >", "as likely"),
            [
                (
                    effect_title(found),
                    with_interval(found.coefficient) if found.coefficient else "",
                    found.verdict,
                    significant(found.score),
                    ", ".join(f"{name} {axis}" for name, axis in found.alternatives),
                )
                for found in diagnosis.effects
            ],
        )
        if any(found.alternatives for found in diagnosis.effects):
            typer.echo("as likely: explains these logs about as well; the report says what to measure to decide")


def print_parameters(diagnosis: Diagnosis) -> None:
    """Print the parameters before and after with their 95 % intervals."""
    columns = ("name", "meaning", "before", "after", "unit")
    print_table(
        "Parameters (± the half-width of the 95 % interval: 1.96 standard errors)",
        ("parameter", "meaning", "before >", "after >", "unit"),
        [[row[column] for column in columns] for row in parameter_rows(diagnosis)],
    )


def print_errors(diagnosis: Diagnosis) -> None:
    """Print the error of the 1 s and 2 s predictions and of the free run on the held-out logs."""
    kinds = (("prediction_1s", "1 s ahead"), ("prediction_2s", "2 s ahead"), ("free_run", "free run"))
    print_table(
        "Error on held-out logs [mrad]",
        ("axis", "error", "before >", "after >", "noise floor >"),
        [
            (axis, what, *(angle_text(getattr(error, kind)) for error in (r.before, r.after, r.noise_floor)))
            for axis, r in diagnosis.axes.items()
            for kind, what in kinds
            if getattr(r.before, kind) or getattr(r.after, kind)
        ],
    )
    if floor_missing(diagnosis.axes):
        typer.echo("no noise floor: the model is unstable, even on its own data")


def print_catalogue(diagnosis: Diagnosis) -> None:
    """Print the verdict on every entry of the catalogue with its reason."""
    print_table(
        "Catalogue",
        ("effect", "axis", "verdict", "coefficient >", "visibility >", "why"),
        [
            (
                entry.name,
                entry.axis,
                entry.verdict,
                with_interval(entry.estimate),
                f"{100.0 * entry.visibility:.0f} %",
                entry.why,
            )
            for entry in diagnosis.catalogue
        ],
    )
    typer.echo("visibility: share of an effect's signature that no change of the fitted parameters could imitate")
