"""Leaks, joints and other dark spots as a table, CSV, GeoJSON or GeoPackage."""

from __future__ import annotations

import csv
import datetime as dt
import io
import json
import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
import psycopg
import pyogrio.raw
import shapely
from numpy.typing import NDArray
from psycopg import sql
from rich.cells import cell_len
from rich.table import Table
from shapely.geometry import Polygon, mapping

from tunneldb.store.coverage import Coverage, CoverageGap, read_coverage
from tunneldb.store.surface import survey_ends
from tunneldb.store.survey import Survey

Geometry = Literal["unrolled", "map", "3d"]
"""Unrolled plane (chainage, arc); map strip beside the axis; on the surface in space."""

Kind = Literal["leak", "joint", "dark", "all"]
"""What is listed: leaks, joints, what else is dark but dry, or all of it."""

UNDEFINED_CARTESIAN = {"SRID": "-1"}
"""Coordinate system of the unrolled plane in a GeoPackage, by its standard."""

DECIMALS = 4
"""Decimals of coordinates in text, m."""

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
    drop_mean, drop_max : float
        dB below dry lining.
    image_share : float
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
    drop_mean: float
    drop_max: float
    image_share: float
    review: str
    reviewed_by: str | None
    reviewed_at: dt.datetime | None
    detected: bool
    counted: bool
    geometry: Polygon


COLUMNS = tuple(f.name for f in fields(Anomaly) if f.name != "geometry")


@dataclass(frozen=True)
class Selection:
    """Which anomalies to read.

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
    """Leaks of a survey, or what else is dark on its lining.

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
    """

    kind: Kind
    rows: list[Anomaly]
    count: int
    area: float
    coverage: Coverage

    @property
    def total(self) -> str:
        """How many there are, how large together, and what else is listed; also where nothing was searched."""
        if not self.rows and not self.coverage.seen_area:
            return f"{_PLURAL[self.kind]} were not searched for"
        others = {
            "rejected": sum(row.review == "rejected" for row in self.rows),
            "not found again": sum(row.review != "rejected" and not row.detected for row in self.rows),
        }
        besides = " and ".join(f"{count} {name}" for name, count in others.items() if count)
        return f"{self.count} {_PLURAL[self.kind]}, {self.area:.2f} m²" + (f"; listed besides: {besides}" if besides else "")


_CHOSEN = sql.SQL(
    "FROM tunnel_api.anomaly WHERE survey_id = %(survey)s AND (detected OR review = 'confirmed') AND area >= %(min_area)s"
    " AND (%(min_confidence)s = 0 OR confidence >= %(min_confidence)s)"
    " AND %(kind)s IN (kind, 'all') AND chainage_to > %(low)s AND chainage_from < %(high)s"
    " AND (%(clock)s::float8[] IS NULL OR tunnel_api.clock_between(clock, (%(clock)s)[1], (%(clock)s)[2]))"
)


def read_leaks(
    conn: psycopg.Connection[Any], survey: Survey, geometry: Geometry = "unrolled", selection: Selection | None = None
) -> LeakList:
    """Read the leaks of a survey, or what else is dark on its lining.

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
    columns = sql.SQL(", ").join(map(sql.Identifier, COLUMNS))
    query = sql.SQL("SELECT {}, public.ST_AsBinary({}) {} ORDER BY chainage_from, arc_from, id")
    rows = conn.execute(query.format(columns, sql.Identifier(_COLUMN[geometry]), _CHOSEN), asked).fetchall()
    names = [*COLUMNS, "geometry"]
    sums = sql.SQL(
        "SELECT count(*), coalesce(sum(tunnel_api.area_between(unrolled, area, %(low)s, %(high)s)), 0) {} AND counted"
    )
    summed = conn.execute(sums.format(_CHOSEN), asked).fetchone()
    assert summed is not None
    return LeakList(
        chosen.kind,
        [Anomaly(**dict(zip(names, (*row[:-1], shapely.from_wkb(bytes(row[-1]))), strict=True))) for row in rows],
        count=summed[0],
        area=summed[1],
        coverage=read_coverage(conn, survey, chosen.low, chosen.high),
    )


def as_table(leaks: LeakList, title: str, width: int | None = None) -> Table:
    """Lay leaks or what else was read out for a terminal.

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
    """Width of a table with lines between its columns."""
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
    "drop dB": lambda leak: f"{leak.drop_mean:.1f}",
    "max dB": lambda leak: f"{leak.drop_max:.1f}",
    "image": lambda leak: f"{100 * leak.image_share:.0f} %",
    "review": lambda leak: leak.review if leak.detected else f"{leak.review}, not found again",
    "by": lambda leak: leak.reviewed_by or "",
}
_LEAST_FIRST = ("image", "max dB", "contrast", "length m", "by", "drop dB", "conf.", "arc m", "kind")


def clock_label(hours: float) -> str:
    """Clock position as hours and minutes: 12 is the crown, 0.5 is 12:30."""
    minutes = round(hours * 60) % 720
    return f"{minutes // 60 or 12}:{minutes % 60:02d}"


def as_csv(leaks: LeakList) -> str:
    """Write leaks as CSV with a header; the last column, ``geometry``, is WKT.

    First come the stretches for which they can't be vouched for: their ``kind`` is the state of the stretch, ``reasons`` says
    why, and ``counted`` is False.
    """
    out = io.StringIO()
    writer = csv.DictWriter(out, [*COLUMNS, "geometry"], lineterminator="\n")
    writer.writeheader()
    for gap in leaks.coverage.gaps:
        place = {"chainage_from": _plain(gap.chainage_from), "chainage_to": _plain(gap.chainage_to), "label": gap.label_from}
        writer.writerow({**place, "kind": gap.state, "reasons": gap.reason, "counted": False})
    for leak in leaks.rows:
        wkt = shapely.to_wkt(leak.geometry, rounding_precision=DECIMALS)
        writer.writerow({**{name: _plain(getattr(leak, name)) for name in COLUMNS}, "geometry": wkt})
    return out.getvalue()


def as_geojson(leaks: LeakList, geometry: Geometry, srid: int) -> str:
    """Write leaks as a GeoJSON FeatureCollection in the coordinates of the chosen geometry.

    Map and space carry the tunnel's coordinate system in a ``crs`` member, as GDAL and QGIS read it; the
    unrolled plane has none. Further members are what ``--json`` tells, too: ``statement`` and ``gaps`` say for which
    stretches the list can't be vouched for, ``count`` and ``area`` sum up.
    """
    collection: dict[str, Any] = {"type": "FeatureCollection", "name": layer_name(geometry, leaks.kind)}
    if geometry != "unrolled":
        collection["crs"] = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{srid}"}}
    collection["statement"] = leaks.coverage.statement
    collection["gaps"] = [asdict(gap) for gap in leaks.coverage.gaps]
    collection |= {"count": leaks.count, "area": round(leaks.area, DECIMALS)}
    collection["features"] = [
        {
            "type": "Feature",
            "id": leak.id,
            "geometry": _rounded(mapping(leak.geometry)),
            "properties": {name: _plain(getattr(leak, name)) for name in COLUMNS},
        }
        for leak in leaks.rows
    ]
    return json.dumps(collection, ensure_ascii=False, allow_nan=False) + "\n"


def write_gpkg(path: Path, leaks: LeakList, geometry: Geometry, srid: int) -> None:
    """Write leaks as a GeoPackage with one layer; the unrolled plane is an undefined Cartesian system there.

    Where the list can't be vouched for, is in a table ``coverage_gap`` beside it, if there is such a stretch, and in the
    description of the layer.
    """
    rows = leaks.rows
    data = [np.array([getattr(leak, name) for leak in rows], dtype=_GPKG_TYPE.get(name, object)) for name in COLUMNS]
    data[COLUMNS.index("reasons")] = np.array([_plain(leak.reasons) for leak in rows], dtype=object)
    moments = [leak.reviewed_at for leak in rows]
    data[COLUMNS.index("reviewed_at")] = np.array(
        [np.datetime64("NaT") if m is None else _utc(m) for m in moments], dtype="datetime64[ms]"
    )
    said = f"{leaks.coverage.statement}. {leaks.total}" if leaks.coverage.statement else leaks.total
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")  # the unrolled plane has none
        _write_layer(path, rows, data, geometry, srid, layer_name(geometry, leaks.kind), said)
    if leaks.coverage.gaps:
        _write_gaps(path, leaks.coverage)


def _write_gaps(path: Path, coverage: Coverage) -> None:
    names = [field.name for field in fields(CoverageGap)]
    columns = [[getattr(gap, name) for gap in coverage.gaps] for name in names]
    kinds = [bool if name == "searched" else object if isinstance(values[0], str) else float
             for name, values in zip(names, columns, strict=True)]  # fmt: skip
    data = [np.array(values, dtype=kind) for values, kind in zip(columns, kinds, strict=True)]
    pyogrio.raw.write(
        str(path), None, data, np.array(names), geometry_type=None, driver="GPKG", layer="coverage_gap",
        DESCRIPTION=coverage.statement,
    )  # fmt: skip


def _write_layer(
    path: Path, leaks: Sequence[Anomaly], data: list[NDArray[Any]], geometry: Geometry, srid: int, layer: str, said: str
) -> None:
    pyogrio.raw.write(
        str(path),
        shapely.to_wkb(np.array([leak.geometry for leak in leaks], dtype=object)),
        data,
        np.array(COLUMNS),
        geometry_type="Polygon Z" if geometry == "3d" else "Polygon",
        crs=None if geometry == "unrolled" else f"EPSG:{srid}",
        driver="GPKG",
        layer=layer,
        DESCRIPTION=said,
        **(UNDEFINED_CARTESIAN if geometry == "unrolled" else {}),
    )


_GPKG_TYPE: dict[str, Any] = {
    "id": np.int64,
    "km": np.int32,
    "detected": np.bool_,
    "counted": np.bool_,
    **dict.fromkeys(
        (
            "chainage_from",
            "chainage_to",
            "arc_from",
            "arc_to",
            "clock",
            "confidence",
            "contrast",
            "area",
            "drop_mean",
            "drop_max",
            "image_share",
        ),
        np.float64,
    ),
}


def layer_name(geometry: Geometry, kind: Kind) -> str:
    """Name of the layer in files."""
    return f"{'anomaly' if kind == 'all' else kind}_{geometry}"


def _utc(moment: dt.datetime) -> dt.datetime:
    """Drop the zone, which NumPy doesn't know, after turning to UTC."""
    return moment.astimezone(dt.UTC).replace(tzinfo=None)


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, DECIMALS)
    if isinstance(value, list):
        return ", ".join(value)
    return value.isoformat() if isinstance(value, dt.datetime) else value


def _rounded(shape: dict[str, Any]) -> dict[str, Any]:
    rings = [[[round(number, DECIMALS) for number in vertex] for vertex in ring] for ring in shape["coordinates"]]
    return {"type": shape["type"], "coordinates": rings}
