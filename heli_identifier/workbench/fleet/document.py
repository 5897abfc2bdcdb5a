"""fleet.json: the contract ``heli-fleet/1``."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from heli_identifier.workbench.delivery.diagnosis_document import estimate_entry, plain
from heli_identifier.workbench.fleet.fleet import FALSE_DISCOVERY_RATE, Coefficient, Fleet
from heli_identifier.workbench.fleet.meta_analysis import LARGEST_LIKE_SPREAD, LEVEL

SCHEMA = "heli-fleet/1"


def fleet_document(fleet: Fleet, provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Give the content of fleet.json.

    Parameters
    ----------
    fleet : Fleet
    provenance : mapping
        Versions, command and date, from :func:`heli_identifier.workbench.delivery.provenance.provenance`.
    """
    return plain(
        {
            "schema": SCHEMA,
            "rigs": [
                {
                    "rig": rig,
                    "verdict": found.verdict.value,
                    "effects": [{"name": effect.name, "axis": effect.axis} for effect in found.effects],
                    "possible": [{"name": effect.name, "axis": effect.axis} for effect in found.possible],
                    "use": {axis: report.use.value for axis, report in found.axes.items()},
                    "held_out_nats": found.held_out.gain.value,
                    "prediction_1s_rad": {
                        axis: {"before": report.before.prediction_1s.value, "after": report.after.prediction_1s.value}
                        for axis, report in found.axes.items()
                    },
                    "data": [{"file": e.file, "sha256": e.sha256, "used_for": e.used_for} for e in found.data],
                    "notes": found.notes,
                    "seconds": found.seconds,
                }
                for rig, found in fleet.diagnoses.items()
            ],
            "effects": [
                {"name": effect.name, "axis": effect.axis, "finding": effect.finding, "named": effect.named}
                | _figures(effect)
                for effect in fleet.effects
            ],
            "parameters": [{"name": parameter.name} | _figures(parameter) for parameter in fleet.parameters],
            "settings": {
                "level": LEVEL,
                "false_discovery_rate": FALSE_DISCOVERY_RATE,
                "largest_like_spread": LARGEST_LIKE_SPREAD,
            },
            "provenance": provenance,
        }
    )


def _figures(coefficient: Coefficient) -> dict[str, Any]:
    return {
        "unit": coefficient.unit,
        "alike": coefficient.mean.alike if coefficient.mean else None,
        "pooled": asdict(coefficient.mean) if coefficient.mean else None,
        "rigs": [
            {"rig": entry.rig, **estimate_entry(entry.estimate), "verdict": entry.verdict, "left_out": entry.left_out}
            for entry in coefficient.rigs
        ],
    }
