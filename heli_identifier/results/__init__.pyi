__all__ = [
    "AHEAD",
    "angle_text",
    "COLOURS",
    "Axes",
    "PLANT",
    "RESULTS",
    "Check",
    "Comparison",
    "Look",
    "ParameterSet",
    "PlantSource",
    "Simulation",
    "Table",
    "Tabular",
    "build",
    "check",
    "check_free_run",
    "compare",
    "corrected_parameters",
    "diagnosis_lines",
    "diagnosis_summary",
    "diagnosis_tables",
    "document_text",
    "drawn_values",
    "effect_name",
    "figure",
    "figure_file",
    "labelled",
    "law_text",
    "listed",
    "look",
    "meaning",
    "meaning_of",
    "notebook_view",
    "p_text",
    "played",
    "plain",
    "plant_of",
    "plant_values",
    "read_document",
    "read_parameters",
    "remarks",
    "rendered",
    "run_figure",
    "significant",
    "simulate",
    "started",
    "thinned",
    "typeset",
    "unit_text",
    "verdict_line",
    "whole_folder",
    "with_interval",
    "write_files",
    "write_results",
]

from .checking import Check, check
from .comparing import Comparison, compare
from .documents import document_text, plain, read_document
from .folder import whole_folder, write_files
from .looking import Look, diagnosis_lines, look
from .parameters import (
    PLANT,
    ParameterSet,
    corrected_parameters,
    drawn_values,
    plant_values,
)
from .report import RESULTS, notebook_view, rendered, write_results
from .simulation import Simulation, simulate, started
from .sources import PlantSource, plant_of, read_parameters
from .svg import COLOURS, Axes, figure, figure_file, run_figure, thinned
from .tables import (
    Table,
    Tabular,
    diagnosis_summary,
    diagnosis_tables,
)
from .unit import build, check_free_run, played
from .words import (
    AHEAD,
    angle_text,
    effect_name,
    labelled,
    law_text,
    listed,
    meaning,
    meaning_of,
    p_text,
    remarks,
    significant,
    typeset,
    unit_text,
    verdict_line,
    with_interval,
)
