"""Queries of the plugin to schema ``tunnel_api``.

QGIS's connections take no parameters: what is put into a text is a whole number, a name of a column written here, or a value as
hexadecimal digits, never the words of a person.
"""

from __future__ import annotations

from typing import Any, Dict, Mapping, Optional, Sequence

WRITTEN = ("review", "remark", "kind")
"""Columns of the view finding_unrolled that inspectors may update."""

KILOMETRE = 1000
"""Length of a kilometre of chainage, m."""

SURVEYS = (
    "SELECT s.id, s.name, s.tunnel, s.date::text FROM tunnel_api.survey s"
    " WHERE EXISTS (SELECT FROM tunnel_api.tunnel t WHERE t.id = s.tunnel_id AND NOT t.site) ORDER BY s.tunnel, s.date, s.name"
)
KINDS = "SELECT k.code, k.label FROM tunnel_api.finding_kind k WHERE k.active ORDER BY k.position, k.code"
PERSON = (
    "SELECT session_user::text, has_column_privilege('tunnel_api.finding_unrolled', 'review', 'UPDATE'),"
    " has_function_privilege('tunnel_api.finding_undo(bigint)', 'EXECUTE')"
)

_LISTED = (
    "id", "km", "chainage_from", "chainage_to", "arc_from", "arc_to", "kind", "kind_detected", "confidence", "area",
    "review", "counted", "other_contrast"
)  # fmt: skip
# dates and lists as text, so that what is read does not depend on how QGIS turns types into Python's
_FACTS = {
    **{name: f"f.{name}" for name in (*_LISTED, "label", "clock", "kind_label", "origin", "state", "remark", "reviewed_by")},
    **{name: f"f.{name}" for name in ("darkening_mean", "darkening_max", "contrast", "image_share", "photos")},
    "reviewed_at": "to_char(f.reviewed_at, 'YYYY-MM-DD HH24:MI')",
    "reasons": "array_to_string(f.reasons, ', ')",
    "evidence": "f.evidence", "other_images": "f.other_images",
    "outline": "public.ST_AsText(f.unrolled, 3)",
    "map_west": "public.ST_XMin(f.map)", "map_south": "public.ST_YMin(f.map)",
    "map_east": "public.ST_XMax(f.map)", "map_north": "public.ST_YMax(f.map)",
}  # fmt: skip


def findings(survey_id: int) -> str:
    """Return the query of the findings to review in a survey; columns as :func:`listed` names them."""
    columns = ", ".join(f"f.{name}" for name in _LISTED)
    return (
        f"SELECT {columns} FROM tunnel_api.finding f WHERE f.survey_id = {int(survey_id)}"
        " AND f.state IN ('open', 'confirmed', 'rejected', 'gone')"
    )


def coverage(survey_id: int, km_from: Optional[int] = None, km_to: Optional[int] = None) -> str:
    """Return the query of the statement on stretches in which leaks could be missed, NULL if there are none."""
    low = "-infinity" if km_from is None else str(KILOMETRE * int(km_from))
    high = "infinity" if km_to is None else str(KILOMETRE * (int(km_to) + 1))
    return f"SELECT tunnel_api.coverage_statement({int(survey_id)}, '{low}', '{high}')"


def facts(finding_id: int) -> str:
    """Return the query of all facts of a finding; columns as :func:`told` names them."""
    return f"SELECT {', '.join(_FACTS.values())} FROM tunnel_api.finding f WHERE f.id = {int(finding_id)}"


def review(finding_id: int, seen: Mapping[str, Any], values: Mapping[str, Any]) -> str:
    """Return the statement that writes columns of WRITTEN, if all of these are still as seen; it returns the id if it did.

    Who changes the finding in the same moment is found out by the view's trigger, which locks the row. Where that one
    writes the same, the trigger writes nothing and returns the row as it was, with its former time of review.
    """
    if not set(values) <= set(WRITTEN):
        raise ValueError(f"only {', '.join(WRITTEN)} are written")
    changes = ", ".join(f"{name} = {_text(value)}" for name, value in values.items())
    same = " AND ".join(f"f.{name} IS NOT DISTINCT FROM {_text(seen[name])}" for name in WRITTEN)
    return (
        f"WITH done AS (UPDATE tunnel_api.finding_unrolled f SET {changes} WHERE f.id = {int(finding_id)} AND {same}"
        " RETURNING f.id, f.reviewed_at) SELECT d.id FROM done d WHERE d.reviewed_at >= statement_timestamp()"
    )


def _text(value: Optional[str]) -> str:
    return "NULL" if value is None else f"convert_from(decode('{value.encode().hex()}', 'hex'), 'UTF8')"


def undo(finding_id: int) -> str:
    """Return the query that takes the last change of a finding back."""
    return f"SELECT tunnel_api.finding_undo({int(finding_id)})"


def listed(row: Sequence[Any]) -> Dict[str, Any]:
    """Return a row of :func:`findings` by its columns."""
    return dict(zip(_LISTED, row))


def told(row: Sequence[Any]) -> Dict[str, Any]:
    """Return a row of :func:`facts` by its columns."""
    return dict(zip(_FACTS, row))


_LOST = (
    "server closed the connection", "could not connect", "connection to server", "Connection failed:",
    "terminating connection", "no connection to the server", "is not currently accepting connections",
    "could not receive data", "could not send data",
)  # fmt: skip


def is_lost(message: str) -> bool:
    """Return True if the server or QGIS reports that there is no connection."""
    return any(mark in message for mark in _LOST)


def error_line(message: str) -> str:
    """Return the line of the server's or QGIS's message with the error."""
    lines = [line.strip() for line in str(message).splitlines() if line.strip()]
    for mark in ("ERROR:", "FATAL:"):
        for line in lines:
            if mark in line:
                return line.split(mark)[-1].strip()
    return lines[0] if lines else "the database returned no message"
