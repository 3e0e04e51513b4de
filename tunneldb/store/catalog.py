"""Adding and removing tunnels and surveys."""

from __future__ import annotations

import datetime as dt
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import psycopg
import pyproj
import shapely
from numpy.typing import NDArray
from psycopg import sql

from tunneldb.alignment.given import XYZ, GivenAxis
from tunneldb.arrays import Float
from tunneldb.csvfile import CsvTable, read_csv
from tunneldb.database.copy import PointZ, copy_binary, pack
from tunneldb.errors import UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.pointcloud.stations import read_stations
from tunneldb.store.alignment import save_design

FARTHEST_SCANNER = 50.0  # m from the axis; a scanner that was never nearer stood in another tunnel


@dataclass(frozen=True)
class Intensity:
    """Which dimension of the scan files holds the intensity, and what it is."""

    kind: str
    dimension: str | None


def add_tunnel(
    connection: psycopg.Connection[Any],
    name: str,
    srid: int,
    axis: GivenAxis,
    spacing: float,
) -> Alignment:
    """Add a tunnel with its given axis, and return the axis.

    Parameters
    ----------
    axis
        Axis as read by `tunneldb.alignment.given.read_given`, metres in the SRID.
    spacing
        Distance between the vertices of the averaged axis, m.

    Raises
    ------
    UserError
        For a name that is taken, an SRID that is unknown or not in metres, or an axis that is none.
    """
    _require_name(name)
    if not math.isfinite(axis.start) or not math.isfinite(spacing):
        raise UserError(f"start chainage {axis.start:g} m and spacing {spacing:g} m must be finite numbers")
    _require_metres(connection, srid)
    alignment = Alignment.from_polyline(axis.xyz, axis.start, spacing)
    line = shapely.set_srid(shapely.LineString(axis.xyz), srid)
    try:
        row = connection.execute(
            "INSERT INTO tunnel.tunnel (name, srid, start_chainage, spacing, alignment, design)"
            " VALUES (%s, %s, %s, %s, %s::geometry, %s) RETURNING id",
            [name, srid, axis.start, spacing, shapely.to_wkb(line, hex=True, include_srid=True), axis.source],
        ).fetchone()
    except psycopg.errors.UniqueViolation:
        raise UserError(f"there is a tunnel {name!r} already: tunneldb tunnel list") from None
    assert row is not None
    if axis.design is not None:
        save_design(connection, row[0], axis.design)
    return alignment


def _require_name(name: str) -> None:
    """Names stand in file names and on the command line."""
    if not re.fullmatch(r"[A-Za-z0-9][\w.-]*", name):
        raise UserError(f"the name {name!r} will not do: letters, digits, and inside also - _ .")


def _require_metres(connection: psycopg.Connection[Any], srid: int) -> None:
    row = connection.execute("SELECT srtext FROM spatial_ref_sys WHERE srid = %s", [srid]).fetchone()
    if row is None:
        raise UserError(f"PostGIS does not know SRID {srid}; use an EPSG number, such as 25830")
    crs = pyproj.CRS.from_wkt(row[0])
    if not crs.is_projected:
        raise UserError(f"SRID {srid} ({crs.name}) is not projected; lengths and chainage need one in metres")
    units = {axis.unit_name for axis in crs.axis_info}
    if units != {"metre"}:
        raise UserError(f"SRID {srid} ({crs.name}) is in {', '.join(sorted(units))}, not metres")


def add_survey(
    connection: psycopg.Connection[Any],
    name: str,
    tunnel: str,
    date: dt.date,
    poses: Sequence[Path],
    *,
    mobile: bool,
    backwards: bool,
    reference: Path | Literal["auto"] | None,
    intensity: Intensity,
) -> int:
    """Add a survey with its scanner positions and reference curve; return how many positions it has.

    Parameters
    ----------
    poses
        The one CSV of the trajectory (time,x,y,z) when `mobile`, else the files of the stations, see
        `tunneldb.pointcloud.stations.read_stations`.
    backwards
        Whether the trajectory was driven towards falling chainage.
    reference
        CSV with range_m,intensity_db; or auto, to find the curve on the lining of each kilometre.

    Raises
    ------
    UserError
        For a name that is taken, an unknown tunnel, files that do not fit it, or an intensity without a range curve to find.
    """
    _require_name(name)
    tunnel_id, srid, alignment = _alignment(connection, tunnel)
    keys: NDArray[Any]
    if mobile:
        table = _read_trajectory(poses[0])
        kind, key, keys, xyz = "pose", "time", table["time"], table.columns(XYZ)
    else:
        stations = read_stations(poses)
        kind, key, keys, xyz = "station", "scan_id", stations.scan_id, stations.xyz
    _require_near(poses, xyz, alignment, tunnel)
    if mobile:
        _require_direction(table, alignment, backwards=backwards)
    if reference == "auto":
        _require_range(intensity.kind)
    curve = _read_reference(reference) if isinstance(reference, Path) else None
    try:
        row = connection.execute(
            """
            INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform, reference)
            VALUES (%s, %s, %s, %s, %s, %s, %s) RETURNING id
            """,
            [
                tunnel_id,
                name,
                date,
                intensity.dimension,
                intensity.kind,
                "mobile" if mobile else "static",
                "measured" if curve is not None else reference or "none",
            ],
        ).fetchone()
    except psycopg.errors.UniqueViolation:
        raise UserError(f"there is a survey {name!r} already: tunneldb survey list") from None
    assert row is not None
    survey = np.full(len(xyz), row[0], dtype=np.int32)
    _insert(connection, kind, ["survey_id", key, "geom"], [survey, keys, PointZ(xyz, srid)])
    if curve is not None:
        survey = np.full(len(curve), row[0], dtype=np.int32)
        columns = [survey, curve["range_m"], curve["intensity_db"]]
        _insert(connection, "reference", ["survey_id", "range_m", "intensity_db"], columns)
    return len(xyz)


def _insert(connection: psycopg.Connection[Any], table: str, names: list[str], columns: list[Any]) -> None:
    copy_binary(connection, sql.Identifier("tunnel", table), names, [pack(columns)])


def _alignment(connection: psycopg.Connection[Any], tunnel: str) -> tuple[int, int, Alignment]:
    """Return a tunnel's key, SRID and given axis."""
    row = connection.execute(
        "SELECT id, srid, start_chainage, spacing, ST_AsBinary(alignment) FROM tunnel.tunnel WHERE name = %s", [tunnel]
    ).fetchone()
    if row is None:
        raise _unknown(connection, tunnel)
    key, srid, start, spacing, wkb = row
    xyz = shapely.get_coordinates(shapely.from_wkb(wkb), include_z=True)
    return key, srid, Alignment.from_polyline(xyz, start, spacing)


def get_tunnel(connection: psycopg.Connection[Any], name: str) -> int:
    """Return the key of the tunnel of that name.

    Raises
    ------
    UserError
        When there is none; the message lists those that exist.
    """
    row = connection.execute("SELECT id FROM tunnel.tunnel WHERE name = %s", [name]).fetchone()
    if row is None:
        raise _unknown(connection, name)
    return int(row[0])


def _unknown(connection: psycopg.Connection[Any], tunnel: str) -> UserError:
    known = ", ".join(row[0] for row in connection.execute("SELECT name FROM tunnel.tunnel ORDER BY name"))
    return UserError(f"there is no tunnel {tunnel!r}; the database has {known or 'none: tunneldb tunnel add'}")


def _read_trajectory(path: Path) -> CsvTable:
    table = read_csv(path, ("time", *XYZ))
    if len(table) < 2:
        raise UserError(f"{path}: a trajectory needs at least 2 rows, this one has {len(table)}")
    table.require_growing("time")
    return table


def _read_reference(path: Path) -> CsvTable:
    table = read_csv(path, ("range_m", "intensity_db"))
    if len(table) < 2:
        raise UserError(f"{path}: a reference curve needs at least 2 rows, this one has {len(table)}")
    if table["range_m"][0] <= 0:
        raise table.error(0, f"range_m {table['range_m'][0]:g} is not positive")
    table.require_growing("range_m")
    return table


def _require_range(kind: str) -> None:
    """A range curve can be found only in intensity that falls with range."""
    if kind == "none":
        raise UserError("--reference auto finds the range curve in the intensity, and intensity of kind none is not read")
    if kind == "reflectance":
        raise UserError("--reference auto has nothing to find: from intensity of kind reflectance the maker removed the range")


def _require_near(paths: Sequence[Path], xyz: Float, alignment: Alignment, tunnel: str) -> None:
    """The scanner must have been near the axis at least once."""
    distance = alignment.distance(xyz)
    if np.isnan(distance).all() or np.nanmin(distance) > FARTHEST_SCANNER:
        nearest = "beyond its ends" if np.isnan(distance).all() else f"{np.nanmin(distance):.0f} m at the nearest"
        raise UserError(
            f"{', '.join(map(str, paths))}: the scanner was never within {FARTHEST_SCANNER:g} m of the axis of {tunnel!r} "
            f"({nearest}); is it of another tunnel or in another SRID?"
        )


def _require_direction(table: CsvTable, alignment: Alignment, *, backwards: bool) -> None:
    """The trajectory must run up the axis, or down it when that was said."""
    chainage = alignment.chainage(table.columns(XYZ))
    within = chainage[np.isfinite(chainage)]
    run = within[-1] - within[0]
    if run < 0 and not backwards:
        raise UserError(
            f"{table.path}: the trajectory runs {-run:.0f} m down the axis; reverse the axis's points, or say --backwards "
            "if the scanner did go towards falling chainage"
        )
    if run > 0 and backwards:
        raise UserError(f"{table.path}: the trajectory runs {run:.0f} m up the axis, so --backwards is wrong")


def remove_survey(connection: psycopg.Connection[Any], name: str) -> None:
    """Remove a survey with all that was made of it."""
    if connection.execute("DELETE FROM tunnel.survey WHERE name = %s", [name]).rowcount == 0:
        raise UserError(f"there is no survey {name!r}: tunneldb survey list")


def remove_tunnel(connection: psycopg.Connection[Any], name: str) -> None:
    """Remove a tunnel; its surveys must have been removed before."""
    surveys = connection.execute(
        "SELECT s.name FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE t.name = %s ORDER BY s.name",
        [name],
    ).fetchall()
    if surveys:
        names = ", ".join(row[0] for row in surveys)
        raise UserError(f"the tunnel {name!r} has surveys: {names}; remove them first (tunneldb survey remove)")
    if connection.execute("DELETE FROM tunnel.tunnel WHERE name = %s", [name]).rowcount == 0:
        raise UserError(f"there is no tunnel {name!r}: tunneldb tunnel list")


def crs_text(conn: psycopg.Connection[Any], srid: int) -> str:
    """A coordinate system of the database as other programs know it: AUTHORITY:CODE, or its definition.

    Raises
    ------
    UserError
        The SRID isn't in ``spatial_ref_sys``.
    """
    row = conn.execute("SELECT auth_name, auth_srid, srtext FROM spatial_ref_sys WHERE srid = %s", [srid]).fetchone()
    if row is None:
        raise UserError(f"SRID {srid} is not in the database's spatial_ref_sys; add its definition there")
    return f"{row[0]}:{row[1]}" if row[0] in ("EPSG", "ESRI") else str(row[2])
