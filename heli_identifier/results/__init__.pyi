__all__ = [
    "AFTER",
    "BEFORE",
    "ERROR_COLUMNS",
    "GAIN_COLUMNS",
    "INK",
    "MEASURED",
    "MUTED",
    "PLANT",
    "RESULTS",
    "START",
    "THIRD",
    "Check",
    "Diagnosis",
    "Look",
    "ParameterSet",
    "Simulation",
    "Tabular",
    "__version__",
    "build",
    "canvas",
    "check",
    "check_free_run",
    "diagnose",
    "document_text",
    "drawn_values",
    "effect_name",
    "effect_title",
    "error_rows",
    "estimate_entry",
    "figure_text",
    "floor_missing",
    "from_command_line",
    "from_python",
    "gain_rows",
    "grid",
    "held_out_sentence",
    "inline_svg",
    "key",
    "law_text",
    "listed",
    "look",
    "meaning",
    "meaning_of",
    "p_text",
    "parameter_rows",
    "plain",
    "plant_values",
    "possible_rows",
    "read_parameters",
    "run_figure",
    "several",
    "shades",
    "significant",
    "simulate",
    "started",
    "styled",
    "tabled_sentence",
    "thinned",
    "unit_text",
    "verdict_sentence",
    "whole_folder",
    "with_interval",
    "write_figure",
    "write_results",
]

from .checking import Check, check
from .diagnosis import RESULTS, Diagnosis, diagnose
from .draws import drawn_values
from .figure_over_time import run_figure
from .folder import START, check_free_run, write_results
from .looking import Look, look
from .parameter_file import read_parameters
from .parameters import PLANT, ParameterSet, plant_values
from .provenance import __version__, from_command_line, from_python
from .rounding import p_text, significant, unit_text, with_interval
from .schema import document_text, estimate_entry, plain
from .simulation import Simulation, several, simulate, started
from .staging import whole_folder
from .style import (
    AFTER,
    BEFORE,
    INK,
    MEASURED,
    MUTED,
    THIRD,
    canvas,
    figure_text,
    grid,
    inline_svg,
    key,
    shades,
    styled,
    thinned,
    write_figure,
)
from .tables import ERROR_COLUMNS, GAIN_COLUMNS, error_rows, floor_missing, gain_rows, parameter_rows, possible_rows
from .tabular import Tabular
from .units import build
from .words import (
    effect_name,
    effect_title,
    held_out_sentence,
    law_text,
    listed,
    meaning,
    meaning_of,
    tabled_sentence,
    verdict_sentence,
)
