"""Content of a report, read from the database in one snapshot; chainages and lengths in m, areas in m²."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, LiteralString

import numpy as np
import psycopg
import shapely
from psycopg import sql
from psycopg.rows import class_row, dict_row
from shapely.geometry import Polygon

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.finding_kind import DETECTED
from tunneldb.stages.registry import STAGE_NAMES
from tunneldb.stages.run import nothing_yet
from tunneldb.store.surface import survey_ends
from tunneldb.store.survey import Survey

Row = dict[str, Any]


@dataclass(frozen=True)
class Leak:
    """A leak as it is reported.

    Attributes
    ----------
    id : int
        Key; the same in QGIS and on the command line.
    chainage_from, chainage_to, arc_from, arc_to : float
        Extents in the unrolled plane, m.
    label : str
        Chainage of its middle, in the tunnel's stationing.
    clock : float
        Hours, 12 is the crown.
    area, inside : float
        Its area, and that of its part in the stretch reported, m².
    darkening_mean, darkening_max : float or None
        dB below dry lining.
    contrast, confidence : float or None
        Darkening in standard deviations of dry lining; 0 to 1.
    image_share : float or None
        Share of it with measurements in the image, 0 to 1.
    review : str
        open, confirmed or rejected.
    reviewed_by, reviewed_at, remark
        Reviewer, time and note.
    detected : bool
        False where the last detection found it no more.
    outline : Polygon
        In the unrolled plane.
    """

    id: int
    chainage_from: float
    chainage_to: float
    label: str
    arc_from: float
    arc_to: float
    clock: float
    area: float
    inside: float
    darkening_mean: float | None
    darkening_max: float | None
    contrast: float | None
    confidence: float | None
    image_share: float | None
    review: str
    reviewed_by: str | None
    reviewed_at: dt.datetime | None
    remark: str | None
    detected: bool
    outline: Polygon

    @property
    def counts(self) -> bool:
        """True if it is included in the totals: detected last, and not rejected."""
        return self.detected and self.review != "rejected"

    @property
    def middle(self) -> float:
        """Chainage of its middle, m."""
        return (self.chainage_from + self.chainage_to) / 2


@dataclass(frozen=True)
class CoverageBins:
    """Lining by bins along the tunnel.

    Attributes
    ----------
    edges : (n + 1,) array
        Chainage, m.
    lining, seen : (n,) arrays
        m²; no lining where nothing was detected.
    """

    edges: Float
    lining: Float
    seen: Float

    @property
    def share(self) -> Float:
        """Share of the lining inspected, 0 to 1; NaN if detection did not run."""
        return np.divide(self.seen, self.lining, out=np.full(len(self.seen), np.nan), where=self.lining > 1e-6)

    def merged(self, count: int) -> CoverageBins:
        """Combine so many bins."""
        starts = np.arange(0, len(self.lining), count)
        return CoverageBins(
            np.append(self.edges[starts], self.edges[-1]),
            np.add.reduceat(self.lining, starts),
            np.add.reduceat(self.seen, starts),
        )


@dataclass(frozen=True)
class DetectabilityShares:
    """Shares of the inspected lining of a stretch, 0 to 1, by whether leaks of the demanded size would be found.

    Attributes
    ----------
    demand_area, demand_drop : float
        Demand: area, m², and darkening, dB.
    met_share, not_met_share, unknown_share : float
        Found with at least 90 % probability, with less, or unknown.
    """

    demand_area: float
    demand_drop: float
    met_share: float
    not_met_share: float
    unknown_share: float


def read_detectability(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> list[DetectabilityShares]:
    """Read the shares of a stretch, m, one for each demand with which it was searched."""
    with conn.cursor(row_factory=class_row(DetectabilityShares)) as cursor:
        return cursor.execute(
            "SELECT demand_area, demand_drop, met_share, not_met_share, unknown_share"
            " FROM tunnel_api.detectability_shares(%s, %s, %s)",
            [survey.name, low, high],
        ).fetchall()


def read_detectability_bins(
    conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, length: float
) -> list[tuple[float, float, float, float]]:
    """Read bins along a stretch, m: ends within it, and the shares of inspected lining where the demand is met and not met."""
    rows = conn.execute(
        """
        SELECT greatest(min(d.chainage_from), %(low)s), least(max(d.chainage_to), %(high)s),
               coalesce(sum(d.lining_area) FILTER (WHERE d.demand = 'met'), 0) / sum(d.lining_area),
               coalesce(sum(d.lining_area) FILTER (WHERE d.demand = 'not met'), 0) / sum(d.lining_area)
          FROM tunnel_api.detectability d
         WHERE d.survey_id = %(survey)s AND d.chainage_from < %(high)s AND d.chainage_to > %(low)s
         GROUP BY floor((d.chainage_from + d.chainage_to) / 2 / %(length)s)
         ORDER BY 1
        """,
        {"survey": survey.id, "low": low, "high": high, "length": length},
    ).fetchall()
    return [(float(a), float(b), float(met), float(missed)) for a, b, met, missed in rows]


def find_stretch(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> tuple[float, float]:
    """Return the stretch to report, m: the requested one, limited to the survey.

    Raises
    ------
    UserError
        If the survey has no segments, or none of them is in the stretch.
    """
    ends = survey_ends(conn, survey)
    if ends is None:
        raise nothing_yet(conn, survey, "has nothing to report")
    start, end = max(ends[0], low), min(ends[1], high)
    if start >= end:
        asked = f"from chainage {max(low, -1e9):.3f} to {min(high, 1e9):.3f} m"
        raise UserError(f"survey {survey.name} extends from chainage {ends[0]:.3f} to {ends[1]:.3f} m: it has nothing {asked}")
    return start, end


def _listed_column(name: str) -> sql.Composable:
    """Return a column of the views of leaks for lists: no confidence if an inspector changed the kind."""
    return (
        sql.SQL("CASE WHEN kind = kind_detected THEN confidence END AS confidence")
        if name == "confidence"
        else sql.Identifier(name)
    )


REPORTED = sql.SQL(
    "FROM tunnel_api.leak WHERE survey_id = %(survey)s AND (detected OR review = 'confirmed') AND chainage_to > %(low)s"
    " AND chainage_from < %(high)s"
)
"""Condition for leaks in a report: found last, or confirmed although not found again; also rejected ones."""

_LEAK = sql.SQL(
    "SELECT {columns}, tunnel_internal.area_between(unrolled, area, %(low)s, %(high)s) AS inside,"
    " public.ST_AsBinary(unrolled) AS outline FROM tunnel_api.leak WHERE id IN ("
    "SELECT id {reported} ORDER BY review = 'rejected', detected, area DESC, id LIMIT %(most)s)"
    " ORDER BY chainage_from + chainage_to, arc_from, id"
).format(
    columns=sql.SQL(", ").join(_listed_column(f.name) for f in fields(Leak) if f.name not in ("inside", "outline")),
    reported=REPORTED,
)


def read_leaks(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, most: int) -> list[Leak]:
    """Read leaks of a stretch, REPORTED, in order of chainage.

    Parameters
    ----------
    most : int
        Maximum number: those not found again first, then the largest, rejected ones last.
    """
    rows = _rows(conn, _LEAK, {"survey": survey.id, "low": low, "high": high, "most": most})
    return [Leak(**{**row, "outline": shapely.from_wkb(bytes(row["outline"]))}) for row in rows]


def read_bins(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> CoverageBins:
    """Read lining and lining seen of a stretch by bins of 1 m."""
    edges = np.unique(np.concatenate([[low], np.arange(np.ceil(low), np.floor(high) + 1), [high]]))
    edges = edges[(edges >= low) & (edges <= high)]
    rows = conn.execute(
        "SELECT c.lining, c.seen FROM tunnel_internal.coverage_at(%s, %s) c ORDER BY c.n", (survey.id, edges.tolist())
    ).fetchall()
    lining, seen = np.diff(np.array(rows, float), axis=0).T
    return CoverageBins(edges, lining, seen)


def read_statistics(conn: psycopg.Connection[Any], survey: Survey, starts: Sequence[float], ends: Sequence[float]) -> list[Row]:
    """Read statistics of leaks over stretches one after another, m (``tunnel_internal.stretch_statistics``)."""
    return _rows(
        conn,
        "SELECT * FROM tunnel_internal.stretch_statistics(%s, %s::float8[], %s::float8[])",
        [survey.id, list(starts), list(ends)],
    )


def read_axis(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> Float:
    """Read the vertices of the measured axis in a stretch and the next beyond its ends: easting and northing (n, 2), m."""
    rows = conn.execute(
        "SELECT ST_X(geom), ST_Y(geom) FROM tunnel.axis_vertex"
        " WHERE survey_id = %s AND n BETWEEN floor(%s / %s) AND ceil(%s / %s) ORDER BY n",
        [survey.id, low, survey.spacing, high, survey.spacing],
    ).fetchall()
    return np.array(rows, float).reshape(-1, 2)


def read_classes(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> list[Row]:
    """Read which classes of GB 50108-2008 a stretch meets, and which limits it exceeds."""
    return _rows(
        conn,
        "SELECT w.class, w.holds, w.breaks, w.leaks, l.wet_ratio, l.patch_area, l.patches_per_100, l.description"
        " FROM tunnel_api.waterproof_class(%s, %s, %s) w JOIN tunnel_api.waterproof_limit l ON l.id = w.class"
        " ORDER BY w.class",
        [survey.name, low, high],
    )


def read_files(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> list[Row]:
    """Read the scan files that reach into a stretch."""
    return _rows(
        conn,
        "SELECT name, checksum, bytes, points, noise, outside, invalid, unposed, thinned, kept, chainage_from, chainage_to,"
        " loaded_at"
        " FROM tunnel_api.file WHERE survey_id = %s AND chainage_to >= %s AND chainage_from <= %s"
        " ORDER BY chainage_from, name",
        [survey.id, low, high],
    )


def read_files_of_site(conn: psycopg.Connection[Any], survey: Survey) -> list[Row]:
    """Read the scan files of a survey of a site."""
    return _rows(
        conn,
        "SELECT name, checksum, bytes, points, loaded_at FROM tunnel_api.file WHERE survey_id = %s ORDER BY name",
        [survey.id],
    )


def read_member_runs(conn: psycopg.Connection[Any], survey: Survey) -> list[Row]:
    """Read how members were last found: time, versions, and counts."""
    return _rows(
        conn,
        "SELECT r.finished_at, r.versions, r.counts FROM tunnel.run r"
        " WHERE r.survey_id = %s AND r.stage = 'members' AND r.outcome = 'done' ORDER BY r.id DESC LIMIT 1",
        [survey.id],
    )


def read_runs(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> list[Row]:
    """Read how each stage last succeeded, grouped by parameters and versions, with the kilometres of each group."""
    return _rows(
        conn,
        """
        SELECT d.stage, d.parameters, d.versions, array_agg(d.km ORDER BY d.km) AS kilometres,
               min(d.finished_at) AS first, max(d.finished_at) AS last
          FROM (SELECT DISTINCT ON (r.km, r.stage) r.km, r.stage, r.parameters, r.versions, r.finished_at
                  FROM tunnel.run r
                 WHERE r.survey_id = %s AND r.outcome = 'done' AND r.km BETWEEN %s AND %s AND r.stage = ANY (%s)
                 ORDER BY r.km, r.stage, r.started_at DESC, r.id DESC) d
         GROUP BY d.stage, d.parameters, d.versions
         ORDER BY array_position(%s, d.stage), min(d.km)
        """,
        [survey.id, *kilometres_between(low, high), list(STAGE_NAMES), list(STAGE_NAMES)],
    )


def read_stale(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> list[Row]:
    """Read stages that are out of date or have not succeeded, by kilometre, with the reason."""
    return _rows(
        conn,
        "SELECT stage, coalesce(reason, 'not done: ' || outcome) AS reason, reason IS NOT NULL AND NOT outdated AS inherited,"
        " array_agg(km ORDER BY km) AS kilometres"
        " FROM tunnel_internal.stage_state(%s) WHERE km BETWEEN %s AND %s AND (reason IS NOT NULL OR done_at IS NULL)"
        " GROUP BY stage, step, 2, 3 ORDER BY step, 2",
        [survey.id, *kilometres_between(low, high)],
    )


def read_radiometry(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> list[Row]:
    """Read how the intensity of each kilometre was corrected."""
    return _rows(
        conn,
        "SELECT km, roughness, dry_mean, dry_sigma, threshold, sigma_raw, sigma_lambert, sigma_oren_nayar"
        " FROM tunnel_api.radiometry WHERE survey_id = %s AND km BETWEEN %s AND %s ORDER BY km",
        [survey.id, *kilometres_between(low, high)],
    )


def read_others(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> dict[str, int]:
    """Count dark areas that are no leak: joints and dry dark areas."""
    rows = conn.execute(
        "SELECT kind, count(*) FROM tunnel_api.finding WHERE survey_id = %s AND detected AND NOT wet AND NOT superseded"
        " AND coalesce(kind_detected, kind) = ANY (%s) AND chainage_to > %s AND chainage_from < %s GROUP BY kind",
        [survey.id, list(map(str, DETECTED)), low, high],
    ).fetchall()
    return dict(rows)


@dataclass(frozen=True)
class Edit:
    """Manual edit: person and time, object, old and new value."""

    at: dt.datetime
    who: str
    view: str
    row_id: int
    action: str
    before: Row | None
    after: Row | None


EDITS = 500
"""Maximum number of listed edits, the latest ones."""

# the audit knows a survey by its name, and outlives it: it may hold edits of one of that name that was removed
_AUDIT = sql.SQL(
    "SELECT {} FROM tunnel_api.audit"
    " WHERE survey = %(name)s AND at >= (SELECT created_at FROM tunnel_api.survey WHERE id = %(id)s) AND at <= %(to)s"
)


def read_edits(conn: psycopg.Connection[Any], survey: Survey, at: dt.datetime) -> tuple[int, list[Edit]]:
    """Count the manual edits in a survey from its addition to a moment, and read the latest EDITS of them, latest first."""
    which = {"name": survey.name, "id": survey.id, "most": EDITS, "to": at}
    row = conn.execute(_AUDIT.format(sql.SQL("count(*)")), which).fetchone()
    assert row is not None
    columns = sql.SQL(", ").join(sql.Identifier(f.name) for f in fields(Edit))
    with conn.cursor(row_factory=class_row(Edit)) as cursor:
        latest = _AUDIT.format(columns) + sql.SQL(" ORDER BY at DESC, id DESC LIMIT %(most)s")
        return row[0], cursor.execute(latest, which).fetchall()


def label_chainages(conn: psycopg.Connection[Any], survey: Survey, chainages: Sequence[float]) -> list[str]:
    """Return chainages, m, as they are written in the tunnel."""
    rows = conn.execute(
        "SELECT tunnel_api.station_label(%s, c) FROM unnest(%s::float8[]) WITH ORDINALITY AS q (c, n) ORDER BY n",
        [survey.tunnel_id, list(chainages)],
    ).fetchall()
    return [str(label) for (label,) in rows]


def place_name(conn: psycopg.Connection[Any], survey: Survey) -> str:
    """Return the label of a place: its chainage, or its station if the tunnel has a stationing of its own."""
    own = conn.execute("SELECT FROM tunnel.station_equation WHERE tunnel_id = %s LIMIT 1", [survey.tunnel_id]).fetchone()
    return "Chainage" if own is None else "Station"


def _rows(conn: psycopg.Connection[Any], query: sql.Composed | LiteralString, values: list[Any] | dict[str, Any]) -> list[Row]:
    """Return the rows of a query as mappings."""
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(query, values).fetchall()


def kilometres_between(low: float, high: float) -> tuple[int, int]:
    """Return the first and last kilometre of a stretch."""
    return int(np.floor(low / 1000)), int(np.ceil(high / 1000)) - 1
