"""A diagnosis on the terminal."""

import typer

from heli_identifier.tracing import Diagnosis, Verdict
from heli_identifier.workbench.commands.terminal import print_table, warn
from heli_identifier.workbench.report.rounding import share_text, significant, with_interval
from heli_identifier.workbench.report.sentences import (
    effect_title,
    plant_sentence,
    tabled_sentence,
    verdict_sentence,
    withdrawn_sentence,
)
from heli_identifier.workbench.report.tables import (
    ANGLE_ERRORS,
    ERROR_COLUMNS,
    error_rows,
    floor_missing,
    parameter_rows,
    possible_rows,
    predictive_rows,
)


def print_diagnosis(diagnosis: Diagnosis, reasons: bool = False) -> None:
    """Print the verdict, the effects, the parameters and the errors; with ``reasons`` the catalogue as well."""
    typer.secho(verdict_sentence(diagnosis), bold=True)
    print_effects(diagnosis)
    print_predictive(diagnosis)
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
            ("effect", "coefficient >", "verdict", "score >", "stability >", "as likely"),
            [
                (
                    effect_title(found),
                    with_interval(found.coefficient) if found.coefficient else "",
                    found.verdict,
                    significant(found.score),
                    share_text(found.stability),
                    ", ".join(f"{name} {axis}" for name, axis in found.alternatives),
                )
                for found in diagnosis.effects
            ],
        )
        for found in diagnosis.effects:
            if found.verdict == Verdict.UNKNOWN and found.in_plant:
                typer.echo(tabled_sentence(found))
            elif differs := plant_sentence(found, diagnosis.effects_after):
                typer.echo(differs)
        if any(found.alternatives for found in diagnosis.effects):
            typer.echo("as likely: explains these logs about as well; the report says what to measure to decide")


def print_predictive(diagnosis: Diagnosis) -> None:
    """Print the predictive effects, and those that only some of the training data find."""
    if diagnosis.predictive:
        print_table(
            "Predictive effects; their cause is not established",
            ("effect", "coefficient >", "by likelihood >", "stability >", "error without >", "or, as well"),
            [
                (r["effect"], r["coefficient"], r["likelihood"], r["stability"], r["worth"], r["or"])
                for r in predictive_rows(diagnosis)
            ],
        )
        for text in filter(None, (found.together for found in diagnosis.predictive)):
            typer.echo(text)
    if diagnosis.possible:
        print_table(
            "Possible effects, which the corrected model does not have",
            ("effect", "stability >", "error without >", "or, as well"),
            [(r["effect"], r["stability"], r["worth"], r["or"]) for r in possible_rows(diagnosis)],
        )
    if diagnosis.predictive:
        typer.echo("by likelihood: the coefficient that the same logs give one step ahead")
        typer.echo("or, as well: predicts these logs about as well in its place")
    if diagnosis.predictive or diagnosis.possible:
        typer.echo("stability: share of halves of the training data that find the effect or another one of its family")
        typer.echo("error without: by how much the error of the axis that needs it most grows in a fit without it")


def print_parameters(diagnosis: Diagnosis) -> None:
    """Print the parameters before and after with their 95 % intervals."""
    columns = ("name", "meaning", "before", "after", "unit")
    print_table(
        "Parameters (± the half-width of the 95 % interval: 1.96 standard errors)",
        ("parameter", "meaning", "before >", "after >", "unit"),
        [[row[column] for column in columns] for row in parameter_rows(diagnosis)],
    )


def print_errors(diagnosis: Diagnosis) -> None:
    """Print the errors of the angles on held-out logs; the effects shown alone have a column if there are others."""
    rows = error_rows(diagnosis.axes, ANGLE_ERRORS)
    skipped = () if diagnosis.predictive else ("shown",)
    heads = dict(zip(rows[0], ERROR_COLUMNS, strict=True))
    kept = [key for key in heads if key not in skipped]
    print_table(
        "Error on held-out logs",
        [heads[key] if key in ("axis", "what") else f"{heads[key]} >" for key in kept],
        [[row[key] for key in kept] for row in rows],
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
