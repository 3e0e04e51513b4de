"""The views of tunnel_api by topic, and which views show the same rows, from the catalogue of an installed database."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import psycopg

from tunneldb.database.schema import sql_files

TOPICS = {
    "Axis and sections": ("stationing", "survey", "survey_ends", "outline", "alignment", "section_dimension"),
    "The scanner": ("scanner",),
    "Leaks and findings": ("finding", "learned", "network"),
    "How wet, and what was seen": ("coverage", "statistics", "waterproof", "coverage_gap", "dark_band", "detectability"),
    "Ground and objects": ("ground",),
    "Images of other instruments": ("imported_image",),
    "Inspection sheets": ("sheet",),
    "Change between surveys": ("measures/change",),
    "Design profile": ("deviation", "deviation_layer", "thickness", "evenness"),
    "Clearance": ("clearance", "clearance_layer"),
    "Rings": ("rings",),
    "Elements and ratings": ("rating", "rating_layer", "crack"),
    "Actions": ("action",),
    "Alarms": ("alarms",),
    "Structures": ("structures",),
    "Under water": ("sonar", "closed_section"),
    "Stages and queue": ("status", "state", "queue", "remark", "size"),
    "Who did what": ("audit", "views/change"),
}
"""Topics, and the SQL files whose views belong to each; another file is a topic of its own."""

OWNERS = {"tunnel", "survey"}
"""Views that nearly all others lead to, by tunnel_id and survey_id."""

LEADS_TO = {
    "finding_id": "finding",
    "profile_id": "design_profile",
    "scheme_id": "rating_scheme",
    "scan_id": "scan_station",
    "sonar_point.scan_id": "sonar_scan",
    "registration_residual.scan_id": "sonar_scan",
}
"""Views that a key leads to, where it is not named after the view."""

PLACES = ("_unrolled", "_map", "_3d", "_face", "_sheet")
"""Endings of views that show the rows of another with one geometry."""


def views_by_topic(conn: psycopg.Connection[Any]) -> list[tuple[str, list[str]]]:
    """Return each topic and its views: sister views after a comma, the views that the keys lead to after an arrow."""
    keys: dict[str, list[str]] = {}
    for view, column in conn.execute(
        "SELECT c.relname, a.attname FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0"
        " WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v' ORDER BY c.oid, a.attnum"
    ):
        keys.setdefault(view, [])
        if column.endswith("_id"):
            keys[view].append(column)
    base = base_views(conn)
    topics = {view: _topic(path) for path in sql_files() for view in _made(path)}
    shown: dict[str, list[str]] = {title: [] for title in TOPICS}
    for view, columns in keys.items():
        if view in OWNERS or base[view] != view:
            continue
        others = [other.removeprefix(view) for other in keys if base[other] == view != other]
        named = {LEADS_TO.get(f"{view}.{column}", LEADS_TO.get(column, column.removesuffix("_id"))) for column in columns}
        leads = sorted(named & set(keys) - OWNERS - {view})
        line = f"{view}{', ' + ', '.join(others) if others else ''}{' → ' + ', '.join(leads) if leads else ''}"
        shown.setdefault(topics.get(view, topics.get(view.rpartition("_")[0], "Other")), []).append(line)
    return [(title, lines) for title, lines in shown.items() if lines]


def _topic(path: Path) -> str:
    names = {path.stem, f"{path.parent.name}/{path.stem}"}
    return next((title for title, stems in TOPICS.items() if names & set(stems)), path.stem.replace("_", " ").capitalize())


def _made(path: Path) -> list[str]:
    """Return the views that a file makes, with those that it has made of a view with three geometries."""
    text = path.read_text("utf-8")
    made = re.findall(r"^CREATE OR REPLACE VIEW tunnel_api\.(\w+)", text, re.MULTILINE)
    return made + [f"{stem}{place}" for stem in re.findall(r"make_geometry_views\(\s*'\w+', '(\w+)'", text) for place in PLACES]


def base_views(conn: psycopg.Connection[Any]) -> dict[str, str]:
    """Return for each view the one whose rows it shows with one geometry, else itself.

    That is the only view that it reads, or the one whose name it extends.
    """
    rows = conn.execute("SELECT viewname FROM pg_views WHERE schemaname = 'tunnel_api'")
    rests: dict[str, set[str]] = {view: set() for (view,) in rows}
    for view, other in conn.execute(
        "SELECT DISTINCT v.relname, o.relname FROM pg_class v JOIN pg_rewrite r ON r.ev_class = v.oid"
        " JOIN pg_depend d ON d.classid = 'pg_rewrite'::regclass AND d.objid = r.oid AND d.refclassid = 'pg_class'::regclass"
        " JOIN pg_class o ON o.oid = d.refobjid AND o.oid <> v.oid AND o.relkind = 'v'"
        " WHERE v.relnamespace = 'tunnel_api'::regnamespace AND o.relnamespace = v.relnamespace"
    ):
        rests[view].add(other)
    bases = {}
    for view in rests:
        found = view
        while place := next((place for place in PLACES if found.endswith(place)), None):
            stem = found.removesuffix(place)
            if len(rests[found]) == 1:
                (found,) = rests[found]
            elif stem in rests:
                found = stem
            else:
                break
        bases[view] = found
    return bases
