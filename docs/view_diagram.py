"""The diagram of the views of tunnel_api, as Mermaid, made from the catalogue of an installed database."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psycopg

from tunneldb.database.schema import sql_files

TOPICS = {
    "Axis and sections": ("stationing", "survey", "survey_ends", "outline", "alignment"),
    "The scanner": ("scanner",),
    "Leaks and findings": ("finding", "learned"),
    "How wet, and what was seen": ("coverage", "statistics", "waterproof", "coverage_gap"),
    "Ground and objects": ("ground",),
    "Inspection sheets": ("sheet",),
    "Change between surveys": ("epochs",),
    "Design profile": ("deviation", "deviation_layer", "thickness", "evenness"),
    "Clearance": ("clearance", "clearance_layer"),
    "Rings": ("ring",),
    "Structures": ("structures",),
    "Under water": ("sonar", "closed_section"),
    "Stages and queue": ("status", "queue", "remark", "size"),
    "Who did what": ("audit", "change"),
}
"""Boxes of the diagram, and the files whose views stand in each; views of other files stand in a box of their file's name."""

OWNERS = {"tunnel", "survey"}
"""Views that nearly all others lead to, by tunnel_id and survey_id: boxes of their own."""

LEADS_TO = {
    "finding_id": "finding",
    "profile_id": "design_profile",
    "scan_id": "scan_station",
    "sonar_point.scan_id": "sonar_scan",
    "registration_residual.scan_id": "sonar_scan",
}
"""Views that a key leads to, where it is not named after the view."""

HELPERS = {"face_placement"}
"""Views that only say where others draw."""

COLUMNS = 3
"""Boxes beside each other."""

WIDE = '%%{init: {"flowchart": {"wrappingWidth": 700, "rankSpacing": 25, "nodeSpacing": 25}}}%%'
"""Lets Mermaid wrap no line."""

PLACES = ("_unrolled", "_map", "_3d", "_face", "_sheet")
"""Endings of views that show the rows of another with one geometry."""


def view_diagram(conn: psycopg.Connection[Any]) -> str:
    """Return the code of the diagram."""
    keys: dict[str, list[str]] = {}
    for view, column in conn.execute(
        "SELECT c.relname, a.attname FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0"
        " WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v' ORDER BY c.oid, a.attnum"
    ):
        keys.setdefault(view, [])
        if column.endswith("_id"):
            keys[view].append(column)
    boxes = list(_boxes(keys, _bases(conn, set(keys))))
    lines = [WIDE, "flowchart LR", '  tunnel["`**tunnel**`"] -- tunnel_id --> survey["`**survey**`"]']
    for n, (title, views) in enumerate(boxes):
        text = "\n".join([f"**{title}**", *views])
        lines.append(f'  b{n}["`{text}`"]')
    lines += [f"  survey -- survey_id --> b{n}" for n in range(0, len(boxes), COLUMNS)]
    lines += [f"  b{n} ~~~ b{n + 1}" for n in range(len(boxes) - 1) if (n + 1) % COLUMNS]
    return "\n".join(lines) + "\n"


def _boxes(keys: dict[str, list[str]], base: dict[str, str]) -> Iterator[tuple[str, list[str]]]:
    """Titles of boxes and the lines in each."""
    homes = {view: _home(path) for path in sql_files() for view in _made(path)}
    shown: dict[str, list[str]] = {title: [] for title in TOPICS}
    for view, columns in keys.items():
        if view in OWNERS or base[view] != view:
            continue
        others = [other.removeprefix(view) for other in keys if base[other] == view != other]
        named = {LEADS_TO.get(f"{view}.{column}", LEADS_TO.get(column, column.removesuffix("_id"))) for column in columns}
        leads = sorted(named & set(keys) - OWNERS - {view})
        line = f"{view}{', ' + ', '.join(others) if others else ''}{' → ' + ', '.join(leads) if leads else ''}"
        shown.setdefault(homes.get(view, homes.get(view.rpartition("_")[0], "Other")), []).append(line)
    yield from ((title, lines) for title, lines in shown.items() if lines)


def _home(path: Path) -> str:
    return next((title for title, stems in TOPICS.items() if path.stem in stems), path.stem.replace("_", " ").capitalize())


def _made(path: Path) -> list[str]:
    """Views that a file makes, those that it has made of a view with three geometries as well."""
    text = path.read_text("utf-8")
    made = re.findall(r"^CREATE OR REPLACE VIEW tunnel_api\.(\w+)", text, re.MULTILINE)
    return made + [f"{stem}{place}" for stem in re.findall(r"make_geometry_views\(\s*'\w+', '(\w+)'", text) for place in PLACES]


def _bases(conn: psycopg.Connection[Any], views: set[str]) -> dict[str, str]:
    """Of each view the one whose rows it shows with one geometry: the only one it rests on, or that of its name."""
    rests: dict[str, set[str]] = {view: set() for view in views}
    for view, other in conn.execute(
        "SELECT DISTINCT v.relname, o.relname FROM pg_class v JOIN pg_rewrite r ON r.ev_class = v.oid"
        " JOIN pg_depend d ON d.classid = 'pg_rewrite'::regclass AND d.objid = r.oid AND d.refclassid = 'pg_class'::regclass"
        " JOIN pg_class o ON o.oid = d.refobjid AND o.oid <> v.oid AND o.relkind = 'v'"
        " WHERE v.relnamespace = 'tunnel_api'::regnamespace AND o.relnamespace = v.relnamespace"
    ):
        if other not in HELPERS:
            rests[view].add(other)
    bases = {}
    for view in views:
        found = view
        while place := next((place for place in PLACES if found.endswith(place)), None):
            stem = found.removesuffix(place)
            if len(rests[found]) == 1:
                (found,) = rests[found]
            elif stem in views:
                found = stem
            else:
                break
        bases[view] = found
    return bases
