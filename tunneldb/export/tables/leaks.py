"""Leaks, joints and dry dark areas of a survey, read into a table; as files: leak_files."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, Literal

import psycopg
import shapely
from psycopg import sql
from rich.cells import cell_len
from rich.table import Table
from shapely.geometry import Polygon

from tunneldb.store.coverage import Coverage, read_coverage
from tunneldb.store.remarks import Remark, read_remarks
from tunneldb.store.surface import survey_ends
from tunneldb.store.survey import Survey

Geometry = Literal["unrolled", "map", "3d"]
"""Geometries: unrolled plane (chainage, arc); map strip beside the axis; on the surface in space."""

Kind = Literal["leak", "joint", "dark", "all"]
"""Kinds to list: leaks, joints, dry dark areas, or all."""

_PLURAL = {"leak": "leaks", "joint": "joints", "dark": "dark spots", "all": "anomalies"}
_COLUMN = {"unrolled": "unrolled", "map": "map", "3d": "surface"}


@dataclass(frozen=True)
class Anomaly:
    """A leak, a joint or another dark spot as it is listed.

    Attributes
    ----------
    id, km : int
        Key and kilometre.
    chainage_from, chainage_to : float
        m.
    label : str
        Chainage of the middle, km + m.
    arc_from, arc_to : float
        m from the crown, positive to the right looking up-chainage.
    clock : float
        Hours.
    kind : str
        leak, joint or dark: as an inspector judged it, else as found.
    confidence : float or None
        That it is what detection takes it for, 0 to 1.
    reasons : list of str
        Why detection takes it for that.
    contrast : float or None
        Mean drop in standard deviations of the dry lining about it.
    area : float
        On the surface, m².
    drop_mean, drop_max : float or None
        dB below dry lining.
    image_share : float or None
        0 to 1.
    review : str
        open, confirmed or rejected.
    reviewed_by : str or None
    reviewed_at : datetime or None
    detected : bool
        False when the last detection found it no more.
    counted : bool
        Whether sums count it: found last, and not rejected.
    geometry : Polygon
        In the coordinates asked for.
    """

    id: int
    km: int
    chainage_from: float
    chainage_to: float
    label: str
    arc_from: float
    arc_to: float
    clock: float
    kind: str
    confidence: float | None
    reasons: list[str]
    contrast: float | None
    area: float
    drop_mean: float | None
    drop_max: float | None
    image_share: float | None
    review: str
    reviewed_by: str | None
    reviewed_at: dt.datetime | None
    detected: bool
    counted: bool
    geometry: Polygon


COLUMNS = tuple(f.name for f in fields(Anomaly) if f.name != "geometry")


@dataclass(frozen=True)
class Selection:
    """Selection of anomalies.

    Attributes
    ----------
    kind : {'leak', 'joint', 'dark', 'all'}
        Of which kind.
    low, high : float
        Only those that reach between these chainages, m.
    clock : (float, float) or None
        Only those whose middle lies between these hours, clockwise.
    min_area : float
        Smaller ones are left out, m².
    min_confidence : float
        Less certain ones are left out, 0 to 1; above 0 also those without a confidence.
    """

    kind: Kind = "leak"
    low: float = -math.inf
    high: float = math.inf
    clock: tuple[float, float] | None = None
    min_area: float = 0.0
    min_confidence: float = 0.0


@dataclass(frozen=True)
class LeakList:
    """Leaks, or other anomalies, of a survey.

    Attributes
    ----------
    kind : {'leak', 'joint', 'dark', 'all'}
        What they are.
    rows : list of Anomaly
        In order of chainage: those that the last detection found, and those that an inspector confirmed although it did not.
    count : int
        How many of them sums count: found last, and not rejected.
    area : float
        Area of these within the stretch, m².
    coverage : Coverage
        What can be said of the stretch.
    remarks : list of Remark
        What else is to be known of the results there.
    """

    kind: Kind
    rows: list[Anomaly]
    count: int
    area: float
    coverage: Coverage
    remarks: list[Remark]

    @property
    def total(self) -> str:
        """Return number and total area, and other listed items; also if nothing was searched."""
        if not self.rows and not self.coverage.seen_area:
            return f"{_PLURAL[self.kind]} were not searched for"
        others = {
            "rejected": sum(row.review == "rejected" for row in self.rows),
            "not found again": sum(row.review != "rejected" and not row.detected for row in self.rows),
        }
        besides = " and ".join(f"{count} {name}" for name, count in others.items() if count)
        return f"{self.count} {_PLURAL[self.kind]}, {self.area:.2f} m²" + (f"; also listed: {besides}" if besides else "")


_CHOSEN = sql.SQL(
    "FROM tunnel_api.anomaly WHERE survey_id = %(survey)s AND (detected OR review = 'confirmed') AND area >= %(min_area)s"
    " AND (%(min_confidence)s = 0 OR kind = found AND confidence >= %(min_confidence)s)"
    " AND CASE %(kind)s WHEN 'all' THEN true WHEN 'leak' THEN wet ELSE kind = %(kind)s END"
    " AND chainage_to > %(low)s AND chainage_from < %(high)s"
    " AND (%(clock)s::float8[] IS NULL OR tunnel_api.clock_between(clock, (%(clock)s)[1], (%(clock)s)[2]))"
)


def listed_column(name: str) -> sql.Composable:
    """Return a column of the views of leaks for lists: no confidence if an inspector changed the kind."""
    return sql.SQL("CASE WHEN kind = found THEN confidence END AS confidence") if name == "confidence" else sql.Identifier(name)


def read_leaks(
    conn: psycopg.Connection[Any], survey: Survey, geometry: Geometry = "unrolled", selection: Selection | None = None
) -> LeakList:
    """Read the leaks, or other anomalies, of a survey.

    Parameters
    ----------
    conn, survey
        Where from.
    geometry : {'unrolled', 'map', '3d'}
        Which coordinates.
    selection : Selection, optional
        Which; else all leaks.
    """
    chosen = Selection() if selection is None else selection
    ends = survey_ends(conn, survey) or (-math.inf, math.inf)
    asked = {
        "survey": survey.id,
        "kind": chosen.kind,
        "min_area": chosen.min_area,
        "min_confidence": chosen.min_confidence,
        "low": max(chosen.low, ends[0]),
        "high": min(chosen.high, ends[1]),
        "clock": None if chosen.clock is None else list(chosen.clock),
    }
    columns = sql.SQL(", ").join(map(listed_column, COLUMNS))
    query = sql.SQL("SELECT {}, public.ST_AsBinary({}) {} ORDER BY chainage_from + chainage_to, arc_from, id")
    rows = conn.execute(query.format(columns, sql.Identifier(_COLUMN[geometry]), _CHOSEN), asked).fetchall()
    names = [*COLUMNS, "geometry"]
    sums = sql.SQL(
        "SELECT count(*), coalesce(sum(tunnel_internal.area_between(unrolled, area, %(low)s, %(high)s)), 0) {} AND counted"
    )
    summed = conn.execute(sums.format(_CHOSEN), asked).fetchone()
    assert summed is not None
    return LeakList(
        chosen.kind,
        [Anomaly(**dict(zip(names, (*row[:-1], shapely.from_wkb(bytes(row[-1]))), strict=True))) for row in rows],
        count=summed[0],
        area=summed[1],
        coverage=read_coverage(conn, survey, chosen.low, chosen.high),
        remarks=read_remarks(conn, survey, chosen.low, chosen.high),
    )


def as_table(leaks: LeakList, title: str, width: int | None = None) -> Table:
    """Format leaks or other anomalies for a terminal.

    Parameters
    ----------
    leaks, title
        What was read, and from where.
    width : int, optional
        Columns of the terminal. Where there is no room for all, the least important are left out and named below.
    """
    cells = {heading: [cell(leak) for leak in leaks.rows] for heading, cell in _CELLS.items()}
    hidden = []
    for heading in _LEAST_FIRST if leaks.kind == "all" else ("kind", *_LEAST_FIRST):
        if width is None or _width(cells) <= width:
            break
        if cells.pop(heading, None) is not None:
            hidden.append(heading)
    lack = f"; a wider window or --format csv shows: {', '.join(h for h in _CELLS if h in hidden)}" if hidden else ""
    table = Table(title=title, caption=f"{leaks.total}{lack}")
    for heading in cells:
        table.add_column(heading, justify="left" if heading in ("kind", "review", "by") else "right", no_wrap=True)
    for row in zip(*cells.values(), strict=True):
        table.add_row(*row)
    return table


def _width(cells: dict[str, list[str]]) -> int:
    """Return the width of a table with lines between its columns."""
    return 1 + sum(3 + max(map(cell_len, (heading, *column))) for heading, column in cells.items())


_CELLS: dict[str, Callable[[Anomaly], str]] = {
    "id": lambda leak: str(leak.id),
    "chainage": lambda leak: leak.label,
    "length m": lambda leak: f"{leak.chainage_to - leak.chainage_from:.2f}",
    "arc m": lambda leak: f"{leak.arc_from:+.2f} to {leak.arc_to:+.2f}",
    "clock": lambda leak: clock_label(leak.clock),
    "kind": lambda leak: leak.kind,
    "conf.": lambda leak: "" if leak.confidence is None else f"{leak.confidence:.2f}",
    "contrast": lambda leak: "" if leak.contrast is None else f"{leak.contrast:.1f}",
    "area m²": lambda leak: f"{leak.area:.2f}",
    "drop dB": lambda leak: "" if leak.drop_mean is None else f"{leak.drop_mean:.1f}",
    "max dB": lambda leak: "" if leak.drop_max is None else f"{leak.drop_max:.1f}",
    "image": lambda leak: "" if leak.image_share is None else f"{100 * leak.image_share:.0f} %",
    "review": lambda leak: leak.review if leak.detected else f"{leak.review}, not found again",
    "by": lambda leak: leak.reviewed_by or "",
}
_LEAST_FIRST = ("image", "max dB", "contrast", "length m", "by", "drop dB", "conf.", "arc m", "kind")


def clock_label(hours: float) -> str:
    """Return a clock position as hours and minutes: 12 is the crown, 0.5 is 12:30."""
    minutes = round(hours * 60) % 720
    return f"{minutes // 60 or 12}:{minutes % 60:02d}"
