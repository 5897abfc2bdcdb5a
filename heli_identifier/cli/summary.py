"""A diagnosis on the terminal."""

import typer

from heli_identifier.cli.terminal import print_table, warn
from heli_identifier.results import (
    ERROR_COLUMNS,
    GAIN_COLUMNS,
    effect_title,
    error_rows,
    floor_missing,
    gain_rows,
    held_out_sentence,
    parameter_rows,
    possible_rows,
    significant,
    tabled_sentence,
    verdict_sentence,
    with_interval,
)
from heli_identifier.tracing import Diagnosis, Verdict


def print_diagnosis(diagnosis: Diagnosis, reasons: bool = False) -> None:
    """Print the verdict, the effects, the parameters and the errors; with ``reasons`` the catalogue as well."""
    typer.secho(verdict_sentence(diagnosis), bold=True)
    print_effects(diagnosis)
    print_possible(diagnosis)
    print_gains(diagnosis)
    print_parameters(diagnosis)
    print_errors(diagnosis)
    if reasons:
        print_catalogue(diagnosis)
    for text in diagnosis.notes:  # last, as what stands last on a terminal is seen
        warn(text)


def print_effects(diagnosis: Diagnosis) -> None:
    """Print what was found."""
    if diagnosis.effects:
        print_table(
            "Effects that the model lacks (± 1.96 standard errors)",
            ("effect", "coefficient >", "verdict", "score [nats] >", "as likely"),
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
        for found in diagnosis.effects:
            if found.verdict == Verdict.UNKNOWN and found.in_plant:
                typer.echo(tabled_sentence(found))
        if any(found.alternatives for found in diagnosis.effects):
            typer.echo("as likely: explains these logs about as well; the report says what to measure to decide")


def print_possible(diagnosis: Diagnosis) -> None:
    """Print what the likelihood favours without establishing it."""
    if diagnosis.possible:
        print_table(
            "Possible effects: no findings",
            ("effect", "coefficient >", "score [nats] >", "left-out logs gain >", "in the plant", "or, as well"),
            [tuple(row.values()) for row in possible_rows(diagnosis)],
        )


def print_gains(diagnosis: Diagnosis) -> None:
    """Print what the gains rest on and what each axis may be used for."""
    print_table(
        f"Gains as slopes at {significant(diagnosis.settings['operating_point'])} V",
        GAIN_COLUMNS,
        [tuple(row.values()) for row in gain_rows(diagnosis)],
    )


def print_parameters(diagnosis: Diagnosis) -> None:
    """Print the parameters before and after with their 95 % intervals."""
    columns = ("name", "meaning", "before", "after", "unit")
    print_table(
        "Parameters (± the half-width of the 95 % interval: 1.96 standard errors)",
        ("parameter", "meaning", "before >", "after >", "unit"),
        [[row[column] for column in columns] for row in parameter_rows(diagnosis)],
    )


def print_errors(diagnosis: Diagnosis) -> None:
    """Print what the held-out logs gain, and the errors of the angles on them."""
    typer.echo(held_out_sentence(diagnosis))
    print_table(
        "Error on held-out logs",
        [name if name in ("axis", "error") else f"{name} >" for name in ERROR_COLUMNS],
        [tuple(row.values()) for row in error_rows(diagnosis)],
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
