"""Settings for reading and loading a survey's files, as recorded in the ledger."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import psycopg

from tunneldb.errors import UserError
from tunneldb.pointcloud.selection import FilterSettings
from tunneldb.pointcloud.units import GivenUnits
from tunneldb.store.survey import Survey


def settings_of(parameters: Mapping[str, Any]) -> FilterSettings:
    """Make settings from parameters; missing ones have their defaults."""
    default = parameters_of(FilterSettings())
    value = {name: parameters.get(name, default[name]) for name in default}
    return FilterSettings(
        None if value["load.density"] == "all" else float(value["load.density"]),
        int(value["load.noise_points"]),
        float(value["load.noise_diameter"]),
        float(value["load.max_distance"]),
        float(value["load.max_left_out"]),
        GivenUnits(value["load.unit"], value["load.height_unit"]),
    )


def parameters_of(settings: FilterSettings) -> dict[str, Any]:
    """Return settings as parameters: ``load.density`` (points per m², or ``all``), ``load.noise_points``, …."""
    return {
        "load.density": "all" if settings.density is None else settings.density,
        "load.noise_points": settings.noise_points,
        "load.noise_diameter": settings.noise_diameter,
        "load.max_distance": settings.max_distance,
        "load.max_left_out": settings.max_left_out,
        "load.unit": settings.units.plan,
        "load.height_unit": settings.units.height,
    }


def require_same_density(conn: psycopg.Connection[Any], survey: Survey, settings: FilterSettings) -> None:
    """Require a survey's single density: another one would thin existing points, or leave them thinner than new ones.

    Raises
    ------
    UserError
        If the survey has files that were loaded with another one.
    """
    row = conn.execute(
        """
        SELECT r.parameters -> 'load.density' FROM tunnel.run r
         WHERE r.survey_id = %(survey)s AND r.stage = 'load' AND r.outcome = 'done' AND r.parameters ? 'load.density'
           AND EXISTS (SELECT FROM tunnel.scan_file f WHERE f.survey_id = %(survey)s)
         ORDER BY r.id DESC LIMIT 1
        """,
        {"survey": survey.id},
    ).fetchone()
    if row is None:
        return
    there = settings_of({"load.density": row[0]}).density
    if there != settings.density:
        text = "all" if there is None else f"{there:g}"
        raise UserError(
            f"survey {survey.name} is loaded with density {text}: load with --density {text}, or remove the survey "
            "and load all its files anew"
        )
