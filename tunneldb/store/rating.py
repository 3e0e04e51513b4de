"""Elements of tunnels and rating schemes, to and from the database."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, LiteralString

import psycopg
from psycopg.rows import dict_row

from tunneldb.errors import UserError

MEASURES = {
    "area": "m²",
    "share": "",
    "largest_area": "m²",
    "length": "m",
    "density_length": "m/m²",
    "width_mm": "mm",
    "severity": "",
    "count": "",
    "growth": "m²/year",
}
"""Measures of rules, with their units."""

JOINT_WIDTH = 0.3
"""Distance along the tunnel within which findings are parts of one transverse joint, m."""

ZONES = {"crown": (10.0, 2.0), "right": (2.0, 5.0), "invert": (5.0, 7.0), "left": (7.0, 10.0)}
"""Zones of the circumference by clock position, clockwise looking up-chainage, hours."""


@dataclass(frozen=True)
class Element:
    """Element of a tunnel.

    Attributes
    ----------
    name : str
    chainage_from, chainage_to : float
        Along the given axis, m.
    clock : (float, float) or None
        Clock positions at which it begins and ends, hours; None for all round.
    """

    name: str
    chainage_from: float
    chainage_to: float
    clock: tuple[float, float] | None = None


@dataclass(frozen=True)
class Limits:
    """Limits of a measure.

    Attributes
    ----------
    kinds : tuple of str
        Codes of the kinds of findings; empty for all wet ones.
    measure : str
        One of :data:`MEASURES`.
    inclusive : bool
        True if a value equal to a limit reaches it.
    limits : tuple of float
        Limits, ascending.
    """

    kinds: tuple[str, ...]
    measure: str
    inclusive: bool
    limits: tuple[float, ...]


@dataclass(frozen=True)
class Rule:
    """Rule of a scheme.

    Attributes
    ----------
    text : str
        Rule in the owner's words.
    axis : Limits
        Measure and its limits.
    results : tuple of str
        Result at each limit; of a matrix row by row, one row for each class of the measure; empty if the rule has points.
    points : tuple of float or None
        Points at each limit.
    by : Limits or None
        Second measure of a matrix: its columns.
    """

    text: str
    axis: Limits
    results: tuple[str, ...]
    points: tuple[float, ...] | None = None
    by: Limits | None = None


@dataclass(frozen=True)
class Totals:
    """Results of a sum of points.

    Attributes
    ----------
    inclusive : bool
        True if a sum equal to a limit reaches it.
    limits : tuple of float
        Limits of the sum, ascending.
    results : tuple of str
        Result at each limit.
    """

    inclusive: bool
    limits: tuple[float, ...]
    results: tuple[str, ...]


@dataclass(frozen=True)
class Scheme:
    """Rating scheme of an owner.

    Attributes
    ----------
    name, version, source : str
    valid_from : date or None
    results : tuple of str
        Results from the best to the worst.
    min_inspected : float
        Inspected share below which a result is a lower bound.
    rules : tuple of Rule
    totals : Totals or None
        Results of the sum of the rules' points; None: the worst result of all rules is that of an element.
    """

    name: str
    version: str
    source: str
    valid_from: dt.date | None
    results: tuple[str, ...]
    min_inspected: float
    rules: tuple[Rule, ...]
    totals: Totals | None = None


def zoned(elements: Sequence[Element]) -> list[Element]:
    """Divide elements into the zones of :data:`ZONES`."""
    return [
        Element(f"{one.name} {zone}", one.chainage_from, one.chainage_to, clock)
        for one in elements
        for zone, clock in ZONES.items()
    ]


def save_elements(
    conn: psycopg.Connection[Any], tunnel_id: int, tunnel: str, name: str, source: str, elements: Sequence[Element]
) -> None:
    """Add a division of a tunnel.

    Raises
    ------
    UserError
        If the name is taken.
    """
    row = conn.execute(
        "INSERT INTO tunnel.element_set (tunnel_id, name, source) VALUES (%s, %s, %s) ON CONFLICT DO NOTHING RETURNING id",
        [tunnel_id, name, source],
    ).fetchone()
    if row is None:
        raise UserError(f"tunnel {tunnel} has elements named {name!r}: tunneldb elements remove {tunnel} {name}")
    clocks = [one.clock or (None, None) for one in elements]
    conn.execute(
        "INSERT INTO tunnel.element (element_set_id, number, name, chainage_from, chainage_to, clock_from, clock_to)"
        " SELECT %s, v.n, v.name, v.low, v.high, v.a, v.b FROM unnest(%s::text[], %s::float8[], %s::float8[], %s::float8[],"
        " %s::float8[]) WITH ORDINALITY AS v (name, low, high, a, b, n)",
        [
            row[0], [one.name for one in elements], [one.chainage_from for one in elements],
            [one.chainage_to for one in elements], [clock[0] for clock in clocks], [clock[1] for clock in clocks],
        ],
    )  # fmt: skip


def list_elements(conn: psycopg.Connection[Any], tunnel_id: int) -> list[dict[str, Any]]:
    """Return the divisions of a tunnel with the number of their elements and their ends, m."""
    rows = conn.cursor(row_factory=dict_row).execute(
        "SELECT e.element_set, e.source, count(*) AS elements, min(e.chainage_from) AS chainage_from,"
        " max(e.chainage_to) AS chainage_to FROM tunnel_api.element e WHERE e.tunnel_id = %s GROUP BY 1, 2 ORDER BY 1",
        [tunnel_id],
    )
    return rows.fetchall()


def remove_elements(conn: psycopg.Connection[Any], tunnel_id: int, tunnel: str, name: str) -> None:
    """Remove a division of a tunnel; raise UserError if there is none."""
    done = conn.execute("DELETE FROM tunnel.element_set WHERE tunnel_id = %s AND name = %s", [tunnel_id, name])
    if not done.rowcount:
        raise UserError(f"tunnel {tunnel} has no elements named {name!r}: tunneldb elements list {tunnel}")


def ring_elements(conn: psycopg.Connection[Any], survey_id: int, survey: str) -> list[Element]:
    """Return the rings of a survey as elements; raise UserError if it has none."""
    rows = conn.execute(
        "SELECT r.number, r.chainage_from, r.chainage_to FROM tunnel_api.ring r WHERE r.survey_id = %s"
        " ORDER BY r.chainage_from",
        [survey_id],
    ).fetchall()
    if not rows:
        raise UserError(f"survey {survey} has no rings: tunneldb rings {survey}")
    return [Element(f"ring {number}", low, high) for number, low, high in rows]


def joint_elements(conn: psycopg.Connection[Any], survey_id: int, survey: str) -> list[Element]:
    """Return the blocks between the transverse joints of a survey, from its beginning to its end.

    A joint is transverse if its findings within :data:`JOINT_WIDTH` of each other span half of the circumference or more.

    Raises
    ------
    UserError
        If it has no such joint.
    """
    rows = conn.execute(
        """
        SELECT v.chainage_from, v.chainage_to, f.middle, f.span / (s.arc[361] - s.arc[1])
          FROM tunnel_api.survey_ends(%(id)s) v
         CROSS JOIN LATERAL (SELECT (a.chainage_from + a.chainage_to) / 2 AS middle, a.arc_to - a.arc_from AS span
                               FROM tunnel_api.finding a WHERE a.survey_id = %(id)s AND a.kind = 'joint' AND a.counted) f
         CROSS JOIN LATERAL (SELECT c.arc FROM tunnel.section c WHERE c.survey_id = %(id)s
                              ORDER BY abs(c.chainage - f.middle) LIMIT 1) s
         ORDER BY f.middle
        """,
        {"id": survey_id},
    ).fetchall()
    joints: list[list[tuple[float, float]]] = []
    for _, _, middle, share in rows:
        if joints and middle - joints[-1][-1][0] <= JOINT_WIDTH:
            joints[-1].append((middle, share))
        else:
            joints.append([(middle, share)])
    places = [sum(at for at, _ in joint) / len(joint) for joint in joints if sum(share for _, share in joint) >= 0.5]
    if not places:
        raise UserError(f"survey {survey} has no joint around half of the circumference: give --length, --rings or --file")
    edges = [rows[0][0], *(place for place in places if rows[0][0] < place < rows[0][1]), rows[0][1]]
    return [Element(f"block {n}", low, high) for n, (low, high) in enumerate(pairwise(edges), start=1)]


def save_scheme(conn: psycopg.Connection[Any], scheme: Scheme) -> None:
    """Add a scheme.

    Raises
    ------
    UserError
        If there is this version of it, or a rule has a kind that the database lacks.
    """
    known = {code for (code,) in conn.execute("SELECT k.code FROM tunnel_api.finding_kind k")}
    for number, rule in enumerate(scheme.rules, start=1):
        for kind in (*rule.axis.kinds, *(rule.by.kinds if rule.by else ())):
            if kind not in known:
                raise UserError(f"rule {number}: there is no kind of finding {kind!r}: {', '.join(sorted(known))}")
    row = conn.execute(
        "INSERT INTO tunnel.rating_scheme (name, version, source, valid_from, results, min_inspected, totals, total_results,"
        " totals_inclusive) VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s) ON CONFLICT DO NOTHING RETURNING id",
        [
            scheme.name, scheme.version, scheme.source, scheme.valid_from, list(scheme.results), scheme.min_inspected,
            list(scheme.totals.limits) if scheme.totals else None, list(scheme.totals.results) if scheme.totals else None,
            scheme.totals.inclusive if scheme.totals else True,
        ],
    ).fetchone()  # fmt: skip
    if row is None:
        raise UserError(
            f"there is version {scheme.version} of {scheme.name}, and a version is never changed: give another version, or"
            f" tunneldb rating remove {scheme.name} {scheme.version}"
        )
    for number, rule in enumerate(scheme.rules, start=1):
        axis, by = rule.axis, rule.by
        conn.execute(
            "INSERT INTO tunnel.rating_rule (scheme_id, number, text, kinds, measure, inclusive, limits, results, points,"
            " by_measure, by_kinds, by_inclusive, by_limits) VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s)",
            [
                row[0], number, rule.text, list(axis.kinds), axis.measure, axis.inclusive, list(axis.limits),
                list(rule.results), None if rule.points is None else list(rule.points), by and by.measure,
                by and list(by.kinds), by and by.inclusive, by and list(by.limits),
            ],
        )  # fmt: skip


def list_schemes(conn: psycopg.Connection[Any]) -> list[dict[str, Any]]:
    """Return the schemes, the one added last first."""
    return conn.cursor(row_factory=dict_row).execute(
        "SELECT s.name, s.version, s.source, s.valid_from, s.results, s.min_inspected, s.totals, s.total_results,"
        " s.totals_inclusive, s.rules FROM tunnel_api.rating_scheme s"
        " ORDER BY s.added_at DESC, s.id DESC"
    ).fetchall()  # fmt: skip


def scheme_rules(conn: psycopg.Connection[Any], name: str, version: str | None) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return a scheme, without a version the one added last, and its rules; raise UserError if there is none."""
    scheme = next((s for s in list_schemes(conn) if s["name"] == name and version in (None, s["version"])), None)
    if scheme is None:
        raise UserError(f"there is no rating scheme {' '.join(filter(None, (name, version)))!r}: tunneldb rating list")
    rows = conn.cursor(row_factory=dict_row).execute(
        "SELECT r.number, r.text, r.kinds, r.measure, r.inclusive, r.limits, r.results, r.points, r.by_measure, r.by_kinds,"
        " r.by_inclusive, r.by_limits FROM tunnel_api.rating_rule r"
        " WHERE r.scheme = %s AND r.version = %s ORDER BY r.number",
        [scheme["name"], scheme["version"]],
    )
    return scheme, rows.fetchall()


def remove_scheme(conn: psycopg.Connection[Any], name: str, version: str) -> None:
    """Remove a version of a scheme; raise UserError if there is none."""
    done = conn.execute("DELETE FROM tunnel.rating_scheme WHERE name = %s AND version = %s", [name, version])
    if not done.rowcount:
        raise UserError(f"there is no rating scheme {name} {version}: tunneldb rating list")


def rate(
    conn: psycopg.Connection[Any], survey: str, element_set: str, scheme: str, version: str | None
) -> list[dict[str, Any]]:
    """Return the rating of the elements of a survey, as the function ``rating`` does.

    Raises
    ------
    UserError
        If there is no such division or scheme.
    """
    return _read(
        conn,
        "SELECT r.number, r.name, r.chainage_from, r.chainage_to, r.clock_from, r.clock_to, r.inspected_share, r.findings,"
        " r.result, r.level, r.complete, r.rule, r.measure, r.value, r.limit_reached, r.finding_id, r.why, r.remark"
        " FROM tunnel_api.rating(%s, %s, %s, %s) r",
        [survey, element_set, scheme, version],
    )


def compare_schemes(
    conn: psycopg.Connection[Any], survey: str, element_set: str, first: Sequence[str | None], second: Sequence[str | None]
) -> list[dict[str, Any]]:
    """Return the ratings by two schemes (name, version) side by side, as the function ``rating_comparison`` does."""
    return _read(
        conn,
        "SELECT r.number, r.name, r.result, r.complete, r.other_result, r.other_complete, r.difference, r.why, r.other_why"
        " FROM tunnel_api.rating_comparison(%s, %s, %s, %s, %s, %s) r",
        [survey, element_set, first[0], second[0], first[1], second[1]],
    )


def rating_change(
    conn: psycopg.Connection[Any], survey: str, element_set: str, scheme: str, version: str | None
) -> list[dict[str, Any]]:
    """Return the ratings now and in the last earlier inspection, as the function ``rating_change`` does."""
    return _read(
        conn,
        "SELECT r.number, r.name, r.earlier_survey, r.earlier_date, r.earlier_result, r.result, r.change, r.known,"
        " r.earlier_why, r.why FROM tunnel_api.rating_change(%s, %s, %s, %s) r",
        [survey, element_set, scheme, version],
    )


def _read(conn: psycopg.Connection[Any], query: LiteralString, values: Sequence[Any]) -> list[dict[str, Any]]:
    try:
        return conn.cursor(row_factory=dict_row).execute(query, values).fetchall()
    except psycopg.errors.NoDataFound as error:
        raise UserError(f"{error.diag.message_primary}; {error.diag.message_hint}") from None
