__all__ = [
    "CONSOLIDATED",
    "CONTROLLER",
    "Design",
    "Finding",
    "Identification",
    "Limits",
    "Rig",
    "Row",
    "SHORTEST_TO_SPLIT",
    "Source",
    "campaign_tables",
    "check_closed_loop",
    "control_advice",
    "controller_parameters",
    "controller_settings",
    "controller_html",
    "controller_m",
    "corrected_init",
    "course_values",
    "design_controller",
    "design_table",
    "design_pid",
    "rank_proposals",
    "diagnose_rigs",
    "diagnose_source",
    "find_effects",
    "experiment_table",
    "fleet_html",
    "combine_rigs",
    "fleet_sentence",
    "fleet_tables",
    "flight_outlooks",
    "flight_table",
    "generate_rigs",
    "identify",
    "linearise",
    "margin_table",
    "rig_folders",
    "find_rigs",
    "run_campaign",
    "source_digest",
    "split_logs",
    "step_figure",
    "summarise_rows",
    "write_voltages",
]

from .campaign import CONSOLIDATED, Row, campaign_tables, diagnose_source, run_campaign, summarise_rows
from .controller import control_advice, design_controller, design_pid
from .design_files import (
    controller_html,
    controller_m,
    corrected_init,
    course_values,
    design_table,
    margin_table,
    step_figure,
)
from .experiment import Limits, experiment_table, find_effects, rank_proposals, write_voltages
from .fleet import Finding, combine_rigs, diagnose_rigs
from .fleet_page import fleet_html, fleet_sentence, fleet_tables
from .flight import flight_outlooks, flight_table
from .identification import Identification, identify
from .judging import Design
from .linearisation import linearise
from .loop import CONTROLLER, check_closed_loop, controller_parameters, controller_settings
from .rigs import (
    SHORTEST_TO_SPLIT,
    Rig,
    Source,
    find_rigs,
    generate_rigs,
    rig_folders,
    source_digest,
    split_logs,
)
