"""A diagnosis on the terminal."""

import typer

from heli_identifier.tracing import Diagnosis
from heli_identifier.workbench.commands.terminal import print_table, warn
from heli_identifier.workbench.report.rounding import angle_text, significant, unit_text, with_interval
from heli_identifier.workbench.report.sentences import effect_title, meaning, verdict_sentence
from heli_identifier.workbench.report.tables import floor_missing


def print_diagnosis(diagnosis: Diagnosis, reasons: bool = False) -> None:
    """Print the verdict, the effects, the parameters and the errors; with ``reasons`` the catalogue as well."""
    typer.secho(verdict_sentence(diagnosis), bold=True)
    print_effects(diagnosis)
    print_parameters(diagnosis)
    print_errors(diagnosis)
    for name, axis, why in diagnosis.withdrawn:
        typer.echo(f"withdrawn: {name} on {axis}: {why}")
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


def print_parameters(diagnosis: Diagnosis) -> None:
    """Print the parameters before and after with their 95 % intervals."""
    before, after = diagnosis.parameters_before, diagnosis.parameters_after
    print_table(
        "Parameters (± the half-width of the 95 % interval: 1.96 standard errors)",
        ("parameter", "meaning", "before >", "after >", "unit"),
        [
            (
                name,
                meaning(name, value),
                with_interval(before[name], unit=False) if name in before else "",
                with_interval(value, unit=False),
                unit_text(value.unit),
            )
            for name, value in after.items()
        ],
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
        typer.echo("no noise floor: the model is unstable and runs away from the rig even on its own data")


def print_catalogue(diagnosis: Diagnosis) -> None:
    """Print the verdict on every entry of the catalogue with its reason."""
    print_table(
        "Catalogue",
        ("effect", "axis", "verdict", "coefficient >", "visible >", "why"),
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
