"""The stages ``axis``, ``segments`` and ``sections``: they are done in the database, by the functions of sql/geometry."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, LiteralString

import psycopg

from tunneldb.counted import counted
from tunneldb.errors import NotReadyError, UserError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.stages.stage import Counts, Progress
from tunneldb.store.surface import load_alignment
from tunneldb.store.survey import Survey

MAX_NAMED = 5
"""Maximum number of rejected vertices that are named."""

MAX_WIDTH = 20.0
"""Maximum width of a tunnel, m: four lanes or three tracks under one vault."""

TOUCHING = 0.1
"""Distance below which stretches are one, m."""

FOOT = 0.3048
"""m."""

FEW_POINTS = 10_000
"""Minimum number of points of a kilometre at the end of a tunnel for it to need a section of its own."""


def axis(conn: psycopg.Connection[Any], survey: Survey, km: int, values: Mapping[str, float], progress: Progress) -> Counts:
    """Find the axis (stage 1 of Gonçalves et al., 2012); vertices edited by hand (stage 2) stay."""
    _place_vertices(conn, survey)
    passes = conn.execute(
        """
        SELECT moved, measured FROM tunnel_internal.axis_refine(
            %(survey)s, %(km)s, half_width => %(half_width)s, angle_step => %(angle_step)s, tolerance => %(tolerance)s,
            max_iterations => %(max_iterations)s::int, max_deviation => %(max_deviation)s, max_rejected => %(max_rejected)s)
        """,
        {"survey": survey.id, "km": km, **{name.removeprefix("axis."): value for name, value in values.items()}},
    ).fetchall()
    moved, measured = passes[-1]
    rejected = conn.execute(
        "SELECT label, remark FROM tunnel_api.axis_vertex WHERE survey_id = %s AND km = %s AND remark IS NOT NULL ORDER BY n",
        [survey.id, km],
    ).fetchall()
    named = ", ".join(f"the vertex at {label} {remark}" for label, remark in rejected[:MAX_NAMED])
    named += f" and {len(rejected) - MAX_NAMED} more" if len(rejected) > MAX_NAMED else ""
    if moved >= values["axis.tolerance"] or len(rejected) > max(1, values["axis.max_rejected"] * measured):
        if moved >= values["axis.tolerance"]:
            more, setting = "allow more passes", f"max_iterations={min(100, 2 * len(passes))}"
        else:
            share = min(1.0, math.ceil(100.0 * len(rejected) / max(measured - len(rejected), 1)) / 100.0)
            more, setting = "interpolate more", f"max_rejected={share:g}"
        raise UserError(
            f"the axis of kilometre {km} was not found in {len(passes)} passes: {named or f'it still moves by {moved:.3f} m'};"
            f" correct the given axis there, or {more}: tunneldb run {survey.name} --km {km} --from axis --set axis.{setting}"
        )
    vertices = dict(
        conn.execute(
            "SELECT source, count(*) FROM tunnel.axis_vertex WHERE survey_id = %s AND km = %s GROUP BY source",
            [survey.id, km],
        ).fetchall()
    )
    if not measured and not vertices.get("edited"):
        raise UserError(f"kilometre {km} has too few points near the axis' vertices to find the tunnel's centre")
    note = {"rejected": len(rejected), "note": f"{named}: interpolated between its neighbours"} if rejected else {}
    return {"iterations": len(passes), "moved": moved, **vertices, **note}


def _place_vertices(conn: psycopg.Connection[Any], survey: Survey) -> None:
    """Set the survey's vertices on the given axis, if they are not there yet."""
    alignment = load_alignment(conn, survey)
    chainage = alignment.number * alignment.spacing
    x, y, z = alignment.vertices.T.tolist()
    conn.execute(
        """
        INSERT INTO tunnel.axis_vertex (survey_id, n, km, geom, given, points, source)
        SELECT %(survey)s, v.n, v.km, p.point, p.point, 0, 'interpolated'
        FROM unnest(%(n)s::int[], %(km)s::int[], %(x)s::float8[], %(y)s::float8[], %(z)s::float8[]) AS v (n, km, x, y, z),
             ST_SetSRID(ST_MakePoint(v.x, v.y, v.z), %(srid)s) AS p (point)
        ON CONFLICT (survey_id, n) DO NOTHING
        """,
        {
            "survey": survey.id,
            "srid": survey.srid,
            "n": alignment.number.tolist(),
            "km": (chainage // KILOMETRE).astype(int).tolist(),
            "x": x,
            "y": y,
            "z": z,
        },
    )


def segments(conn: psycopg.Connection[Any], survey: Survey, km: int, values: Mapping[str, float], progress: Progress) -> Counts:
    """Make segments, and the segment and chainage of every point (stage 3)."""
    built = _one(conn, "SELECT tunnel_internal.segment_build(%s, %s)", survey.id, km)
    if not built:
        raise NotReadyError(f"kilometre {km} has no axis yet: tunneldb run {survey.name} --km {km} --from axis")
    progress(0.1)
    return {"segments": built, "points": _one(conn, "SELECT tunnel_internal.segment_tag(%s, %s)", survey.id, km)}


def sections(conn: psycopg.Connection[Any], survey: Survey, km: int, values: Mapping[str, float], progress: Progress) -> Counts:
    """Make two cross-sections per segment (stage 4)."""
    if not _one(conn, "SELECT count(*) FROM tunnel.segment WHERE survey_id = %s AND km = %s", survey.id, km):
        raise NotReadyError(f"kilometre {km} has no segments yet: tunneldb run {survey.name} --km {km} --from segments")
    built = _one(
        conn,
        "SELECT tunnel_internal.section_build(%s, %s, %s, %s, %s, %s, %s)",
        survey.id,
        km,
        values["section.angle_step"],
        values["section.half_width"],
        values["section.max_half_width"],
        int(values["section.min_points"]),
        values["section.protrusion"],
    )
    points = _one(conn, "SELECT coalesce(sum(points), 0) FROM tunnel.segment WHERE survey_id = %s AND km = %s", survey.id, km)
    if not built and points >= FEW_POINTS:
        raise NotReadyError(
            f"kilometre {km} has no section: the {points} points in its segments fill no section"
            f" (tunneldb run {survey.name} --km {km} --from segments, or load more)"
        )
    classes = conn.execute(
        "SELECT c.state, count(*) FROM tunnel.section s JOIN tunnel.section_class c ON c.section_id = s.id"
        " WHERE s.survey_id = %s AND s.km = %s GROUP BY c.state",
        [survey.id, km],
    ).fetchall()
    width = conn.execute(
        "SELECT percentile_cont(0.5) WITHIN GROUP (ORDER BY (SELECT max(c.radius * abs(sind(c.angle)))"
        " FROM tunnel.section_class c WHERE c.section_id = s.id)) FROM tunnel.section s WHERE s.survey_id = %s AND s.km = %s",
        [survey.id, km],
    ).fetchone()
    open_length, unroofed = _without_roof(conn, survey, km, values)
    notes = [unroofed, _too_wide(2.0 * width[0]) if width is not None and width[0] is not None else ""]
    return {
        "sections": built,
        **{f"classes_{state}": count for state, count in classes},
        **({"open": round(open_length, 1)} if open_length else {}),
        **({"note": "; ".join(filter(None, notes))} if any(notes) else {}),
    }


def _without_roof(conn: psycopg.Connection[Any], survey: Survey, km: int, values: Mapping[str, float]) -> tuple[float, str]:
    """Return the length (m) with a floor and no roof, such as portals and open cuts, and a note on it."""
    planes = conn.execute(
        "SELECT chainage_from, chainage_to FROM tunnel_internal.section_open(%s, %s, %s, %s, %s)",
        [survey.id, km, values["section.angle_step"], values["section.max_half_width"], int(values["section.min_points"])],
    ).fetchall()
    stretches: list[list[float]] = []
    for low, high in planes:
        if stretches and low - stretches[-1][1] < TOUCHING:
            stretches[-1][1] = high
        else:
            stretches.append([low, high])
    named = []
    for stretch in stretches[:MAX_NAMED]:
        labels = conn.execute(
            "SELECT label FROM unnest(%s::float8[]) WITH ORDINALITY AS c (chainage, i),"
            " tunnel_api.stationing((SELECT tunnel_id FROM tunnel.survey WHERE id = %s), c.chainage) ORDER BY i",
            [[round(end, 1) for end in stretch], survey.id],
        ).fetchall()
        named.append(" and ".join(label for (label,) in labels))
    more = f" and {counted(len(stretches) - MAX_NAMED, 'more stretch', 'more stretches')}" if len(stretches) > MAX_NAMED else ""
    note = f"no roof between {', between '.join(named)}{more}: an open cut or a portal, without sections and lining"
    return sum(high - low for low, high in stretches), note if stretches else ""


def _too_wide(width: float) -> str:
    """Question sections of an implausible width (m), for example from coordinates in feet."""
    if width <= MAX_WIDTH:
        return ""
    return (
        f"the sections are {width:.1f} m wide: are the coordinates in feet ({width * FOOT:.1f} m then), is it a cavern,"
        " or are there two tubes? Transform the scan to metres"
    )


def _one(conn: psycopg.Connection[Any], query: LiteralString, *arguments: Any) -> int:
    row = conn.execute(query, arguments).fetchone()
    assert row is not None
    return int(row[0])
