"""Findings of all kinds, detected and drawn: read for people and programs, and written as CSV, GeoJSON or GeoPackage."""

from __future__ import annotations

import datetime as dt
import json
import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
import psycopg
import pyogrio.raw
import shapely
from psycopg import sql
from shapely.geometry import mapping
from shapely.geometry.base import BaseGeometry

from tunneldb.csvfile import write_csv
from tunneldb.export.tables.cell import DECIMALS, plain
from tunneldb.export.tables.geopackage import UNDEFINED_CARTESIAN
from tunneldb.export.tables.leaks import Geometry
from tunneldb.geometry.crs import LOCAL
from tunneldb.store.survey import Survey

State = Literal["open", "confirmed", "rejected", "gone", "dry", "same", "merged"]
COUNTED: tuple[State, ...] = ("open", "confirmed")


@dataclass(frozen=True)
class Finding:
    """A finding, as tunnel_api.lining_finding has it; names are those of its columns.

    Lengths are in m, areas in m², drops in dB, clock positions in hours. ``share`` is that of it which lies in the stretch that
    was asked for, 0 to 1: sums count it by that part.
    """

    id: int
    km: int
    label: str
    chainage_from: float
    chainage_to: float
    arc_from: float
    arc_to: float
    clock: float
    kind: str
    kind_label: str
    origin: str
    severity: int | None
    severity_label: str | None
    area: float
    length: float | None
    width: float | None
    drop_mean: float | None
    confidence: float | None
    review: str
    state: str
    counted: bool
    also_detected: bool
    merged_into: int | None
    same_as: int | None
    parent_id: int | None
    dry_region_id: int | None
    drawn_by: str | None
    drawn_at: dt.datetime | None
    reviewed_by: str | None
    reviewed_at: dt.datetime | None
    remark: str | None
    photos: int
    share: float
    geometry: BaseGeometry

    @property
    def middle(self) -> float:
        """Chainage of its middle, m."""
        return (self.chainage_from + self.chainage_to) / 2


COLUMNS = tuple(field.name for field in fields(Finding) if field.name not in ("share", "geometry"))
_PLACE = {"unrolled": "unrolled", "map": "map", "3d": "surface"}


@dataclass(frozen=True)
class Chosen:
    """Selection of findings.

    Attributes
    ----------
    kinds, origins : sequence of str
        Of these kinds and origins; all if there are none.
    states : sequence of str
        In these states; all if there are none.
    low, high : float
        That reach between these chainages, m.
    clock : (float, float) or None
        Whose middles lie between these hours, clockwise.
    min_area : float
        Of at least so many m².
    min_severity : int
        Of at least this severity; 0 for those without one, too.
    """

    kinds: Sequence[str] = ()
    origins: Sequence[str] = ()
    states: Sequence[str] = COUNTED
    low: float = -math.inf
    high: float = math.inf
    clock: tuple[float, float] | None = None
    min_area: float = 0.0
    min_severity: int = 0


# Of a polygon by its area, as sums of leaks have it; of a line by its length; a point lies in it or not.
_SHARE = sql.SQL(
    "CASE WHEN chainage_from >= %(low)s AND chainage_to <= %(high)s THEN 1"
    " WHEN public.ST_Dimension(unrolled) = 2 THEN tunnel_internal.area_between(unrolled, 1, %(low)s, %(high)s)"
    " WHEN public.ST_Dimension(unrolled) = 1 THEN public.ST_Length(public.ST_ClipByBox2D(unrolled, public.ST_MakeBox2D("
    "public.ST_MakePoint(greatest(%(low)s, -1e9), -1e4), public.ST_MakePoint(least(%(high)s, 1e9), 1e4))))"
    " / nullif(public.ST_Length(unrolled), 0) ELSE 1 END"
)


BLOCK = 20_000
"""Number of findings read at a time."""


def read_findings(
    conn: psycopg.Connection[Any], survey: Survey, geometry: Geometry = "unrolled", chosen: Chosen | None = None
) -> list[Finding]:
    """Read findings of a survey, in order of chainage."""
    return list(stream_findings(conn, survey, geometry, chosen))


def stream_findings(
    conn: psycopg.Connection[Any], survey: Survey, geometry: Geometry = "unrolled", chosen: Chosen | None = None
) -> Iterator[Finding]:
    """Yield findings of a survey in order of chainage, with only BLOCK in memory; until the transaction ends."""
    wanted = Chosen() if chosen is None else chosen
    query = sql.SQL(
        "SELECT {}, coalesce({}, 1), public.ST_AsBinary({}) FROM tunnel_api.lining_finding WHERE survey_id = %(survey)s"
        " AND (%(kinds)s::text[] = '{{}}' OR kind = ANY (%(kinds)s))"
        " AND (%(origins)s::text[] = '{{}}' OR origin = ANY (%(origins)s))"
        " AND (%(states)s::text[] = '{{}}' OR state = ANY (%(states)s)) AND area >= %(min_area)s"
        " AND coalesce(severity, 0) >= %(min_severity)s AND chainage_to > %(low)s AND chainage_from < %(high)s"
        " AND (%(clock)s::float8[] IS NULL OR tunnel_api.clock_between(clock, (%(clock)s)[1], (%(clock)s)[2]))"
        " ORDER BY chainage_from + chainage_to, arc_from, id"
    ).format(sql.SQL(", ").join(map(sql.Identifier, COLUMNS)), _SHARE, sql.Identifier(_PLACE[geometry]))
    values = {
        "survey": survey.id,
        "kinds": list(wanted.kinds),
        "origins": list(wanted.origins),
        "states": list(wanted.states),
        "low": wanted.low,
        "high": wanted.high,
        "clock": None if wanted.clock is None else list(wanted.clock),
        "min_area": wanted.min_area,
        "min_severity": wanted.min_severity,
    }
    names = (*COLUMNS, "share", "geometry")
    with conn.transaction(), conn.cursor(name="findings") as cursor:
        cursor.execute(query, values)
        while rows := cursor.fetchmany(BLOCK):
            for row in rows:
                yield Finding(**dict(zip(names, (*row[:-1], shapely.from_wkb(bytes(row[-1]))), strict=True)))


def as_csv(findings: Sequence[Finding]) -> str:
    """Write findings as CSV with a header; the last column, ``geometry``, is WKT."""
    return write_csv(
        [*COLUMNS, "geometry"],
        (
            [*(plain(getattr(one, name)) for name in COLUMNS), shapely.to_wkt(one.geometry, rounding_precision=DECIMALS)]
            for one in findings
        ),
    )


def as_geojson(findings: Sequence[Finding], geometry: Geometry, srid: int) -> str:
    """Write findings as a GeoJSON FeatureCollection; on the map and in space it names the tunnel's coordinate system."""
    collection: dict[str, Any] = {"type": "FeatureCollection", "name": f"finding_{geometry}"}
    if geometry != "unrolled" and srid != LOCAL:
        collection["crs"] = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{srid}"}}
    collection["features"] = [
        {
            "type": "Feature",
            "id": finding.id,
            "geometry": mapping(shapely.set_precision(finding.geometry, 10.0**-DECIMALS, mode="pointwise")),
            "properties": {name: plain(getattr(finding, name)) for name in COLUMNS},
        }
        for finding in findings
    ]
    return json.dumps(collection, ensure_ascii=False, allow_nan=False) + "\n"


def write_gpkg(path: Path, findings: Sequence[Finding], geometry: Geometry, srid: int) -> None:
    """Write findings as a GeoPackage with one layer of polygons, lines and points; numbers that are not known are empty."""
    bare = geometry == "unrolled" or srid == LOCAL
    columns, masks = [], []
    for name in COLUMNS:
        values = [getattr(finding, name) for finding in findings]
        unknown = np.array([value is None for value in values], np.bool_)
        kind = _TYPE.get(name, object)
        if kind == "datetime64[ms]":
            values = [np.datetime64("NaT") if v is None else v.astimezone(dt.UTC).replace(tzinfo=None) for v in values]
        elif kind is not object:
            values = [kind(0) if value is None else value for value in values]
        columns.append(np.array(values, dtype=kind))
        masks.append(unknown if unknown.any() and kind not in (object, "datetime64[ms]") else None)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")
        pyogrio.raw.write(
            str(path),
            shapely.to_wkb(np.array([finding.geometry for finding in findings], dtype=object)),
            columns,
            np.array(COLUMNS),
            field_mask=masks,
            geometry_type="Unknown",
            crs=None if bare else f"EPSG:{srid}",
            driver="GPKG",
            layer=f"finding_{geometry}",
            **(UNDEFINED_CARTESIAN if bare else {}),
        )


_TYPE: dict[str, Any] = {
    **dict.fromkeys(("id", "merged_into", "same_as", "parent_id", "dry_region_id"), np.int64),
    **dict.fromkeys(("km", "severity", "photos"), np.int32),
    **dict.fromkeys(("counted", "also_detected"), np.bool_),
    **dict.fromkeys(("drawn_at", "reviewed_at"), "datetime64[ms]"),
    **dict.fromkeys(
        ("chainage_from", "chainage_to", "arc_from", "arc_to", "clock", "area", "length", "width", "drop_mean", "confidence"),
        np.float64,
    ),
}
