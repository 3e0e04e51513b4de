"""Leaks, joints and other dark spots as a table, CSV, GeoJSON or GeoPackage."""

from __future__ import annotations

import csv
import datetime as dt
import io
import json
import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
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
    geometry: Polygon


COLUMNS = tuple(f.name for f in fields(Anomaly) if f.name != "geometry")


def read_leaks(
    conn: psycopg.Connection[Any],
    survey: Survey,
    geometry: Geometry = "unrolled",
    kilometres: Sequence[int] | None = None,
    min_area: float = 0.0,
    kind: Kind = "leak",
    low: float = -math.inf,
    high: float = math.inf,
    clock: tuple[float, float] | None = None,
) -> list[Anomaly]:
    """Read the leaks of a survey, or what else is dark on its lining, in order of chainage.

    Those that the last detection found, and those that an inspector confirmed although it did not.

    Parameters
    ----------
    conn, survey
        Where from.
    geometry : {'unrolled', 'map', '3d'}
        Which coordinates.
    kilometres : sequence of int, optional
        Only these.
    min_area : float
        Smaller ones are left out, m².
    kind : {'leak', 'joint', 'dark', 'all'}
        What to read.
    low, high : float
        Only those that reach between these chainages, m.
    clock : (float, float), optional
        Only those whose middle lies between these hours, clockwise.
    """
    query = sql.SQL(
        "SELECT {columns}, public.ST_AsBinary({geometry}) FROM tunnel_api.anomaly"
        " WHERE survey_id = %(survey)s AND (detected OR review = 'confirmed')"
        " AND (%(km)s::int[] IS NULL OR km = ANY (%(km)s)) AND area >= %(min_area)s"
        " AND %(kind)s IN (kind, 'all') AND chainage_to >= %(low)s AND chainage_from <= %(high)s"
        " AND (%(clock)s::float8[] IS NULL OR tunnel_api.clock_between(clock, (%(clock)s)[1], (%(clock)s)[2]))"
        " ORDER BY chainage_from, arc_from, id"
    ).format(columns=sql.SQL(", ").join(map(sql.Identifier, COLUMNS)), geometry=sql.Identifier(_COLUMN[geometry]))
    asked = {
        "survey": survey.id,
        "km": None if kilometres is None else list(kilometres),
        "min_area": min_area,
        "kind": kind,
        "low": low,
        "high": high,
        "clock": None if clock is None else list(clock),
    }
    rows = conn.execute(query, asked).fetchall()
    names = [*COLUMNS, "geometry"]
    return [Anomaly(**dict(zip(names, (*row[:-1], shapely.from_wkb(bytes(row[-1]))), strict=True))) for row in rows]


def as_table(leaks: Sequence[Anomaly], title: str, kind: Kind, width: int | None = None) -> Table:
    """Lay leaks or what else was read out for a terminal.

    Parameters
    ----------
    leaks, title, kind
        What was read, and from where.
    width : int, optional
        Columns of the terminal. Where there is no room for all, the least important are left out and named below.
    """
    cells = {heading: [cell(leak) for leak in leaks] for heading, cell in _CELLS.items()}
    hidden = []
    for heading in _LEAST_FIRST if kind == "all" else ("kind", *_LEAST_FIRST):
        if width is None or _width(cells) <= width:
            break
        if cells.pop(heading, None) is not None:
            hidden.append(heading)
    lack = f"; a wider window or --format csv shows: {', '.join(h for h in _CELLS if h in hidden)}" if hidden else ""
    table = Table(title=title, caption=f"{total(leaks, kind)}{lack}")
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


def total(leaks: Sequence[Anomaly], kind: Kind) -> str:
    """Say how many there are and how large they are together."""
    return f"{len(leaks)} {_PLURAL[kind]}, {sum(leak.area for leak in leaks):.2f} m²"


def as_csv(leaks: Sequence[Anomaly]) -> str:
    """Write leaks as CSV with a header; the last column, ``geometry``, is WKT."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*COLUMNS, "geometry"])
    for leak in leaks:
        wkt = shapely.to_wkt(leak.geometry, rounding_precision=DECIMALS)
        writer.writerow([*(_plain(getattr(leak, name)) for name in COLUMNS), wkt])
    return out.getvalue()


def as_geojson(leaks: Sequence[Anomaly], geometry: Geometry, srid: int, kind: Kind) -> str:
    """Write leaks as a GeoJSON FeatureCollection in the coordinates of the chosen geometry.

    Map and space carry the tunnel's coordinate system in a ``crs`` member, as GDAL and QGIS read it; the
    unrolled plane has none.
    """
    collection: dict[str, Any] = {"type": "FeatureCollection", "name": layer_name(geometry, kind)}
    if geometry != "unrolled":
        collection["crs"] = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{srid}"}}
    collection["features"] = [
        {
            "type": "Feature",
            "id": leak.id,
            "geometry": _rounded(mapping(leak.geometry)),
            "properties": {name: _plain(getattr(leak, name)) for name in COLUMNS},
        }
        for leak in leaks
    ]
    return json.dumps(collection, ensure_ascii=False, allow_nan=False) + "\n"


def write_gpkg(path: Path, leaks: Sequence[Anomaly], geometry: Geometry, srid: int, kind: Kind) -> None:
    """Write leaks as a GeoPackage with one layer; the unrolled plane is an undefined Cartesian system there."""
    data = [np.array([getattr(leak, name) for leak in leaks], dtype=_GPKG_TYPE.get(name, object)) for name in COLUMNS]
    data[COLUMNS.index("reasons")] = np.array([_plain(leak.reasons) for leak in leaks], dtype=object)
    moments = [leak.reviewed_at for leak in leaks]
    data[COLUMNS.index("reviewed_at")] = np.array(
        [np.datetime64("NaT") if m is None else _utc(m) for m in moments], dtype="datetime64[ms]"
    )
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")  # the unrolled plane has none
        _write_layer(path, leaks, data, geometry, srid, layer_name(geometry, kind))


def _write_layer(
    path: Path, leaks: Sequence[Anomaly], data: list[NDArray[Any]], geometry: Geometry, srid: int, layer: str
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
        **(UNDEFINED_CARTESIAN if geometry == "unrolled" else {}),
    )


_GPKG_TYPE: dict[str, Any] = {
    "id": np.int64,
    "km": np.int32,
    "detected": np.bool_,
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
