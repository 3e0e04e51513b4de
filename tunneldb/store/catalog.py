"""Adding and removing tunnels and surveys."""

from __future__ import annotations

import datetime as dt
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import psycopg
import pyproj
import shapely

from tunneldb.alignment.given import GivenAxis
from tunneldb.errors import UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.crs import mirroring_axes
from tunneldb.geometry.local import LOCAL, LOCAL_NAME
from tunneldb.geometry.units import IN_METRES, Units
from tunneldb.store.alignment import save_design
from tunneldb.store.scanner import (
    Positions,
    read_positions,
    read_reference,
    replace_positions,
    require_no_range,
    require_range,
    save_positions,
    save_reference,
)
from tunneldb.store.survey import get_survey
from tunneldb.store.time_offset import set_time_offset
from tunneldb.store.unknown import unknown_survey, unknown_tunnel

MAX_NAME = 63
"""Maximum characters of the name of a tunnel, a survey or a profile, as of names in PostgreSQL."""


@dataclass(frozen=True)
class Intensity:
    """Intensity dimension of the scan files, and its kind."""

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
        If a name exists, an SRID is unknown or not in metres, or an axis is invalid.
    """
    require_new_tunnel(connection, name, srid)
    if not math.isfinite(axis.start) or not math.isfinite(spacing):
        raise UserError(f"start chainage {axis.start:g} m and spacing {spacing:g} m must be finite numbers")
    alignment = Alignment.from_polyline(axis.xyz, axis.start, spacing)
    line = shapely.set_srid(shapely.LineString(axis.xyz), srid)
    try:
        row = connection.execute(
            "INSERT INTO tunnel.tunnel (name, srid, start_chainage, spacing, alignment, design)"
            " VALUES (%s, %s, %s, %s, %s::geometry, %s) RETURNING id",
            [name, srid, axis.start, spacing, shapely.to_wkb(line, hex=True, include_srid=True), axis.source],
        ).fetchone()
    except psycopg.errors.UniqueViolation:
        raise _taken(name) from None
    assert row is not None
    if axis.design is not None:
        save_design(connection, row[0], axis.design)
    make_layers(connection)
    return alignment


def add_site(connection: psycopg.Connection[Any], name: str, srid: int) -> None:
    """Add a site: a structure without an axis.

    Raises
    ------
    UserError
        If a name exists, or an SRID is unknown or not in metres.
    """
    require_new_tunnel(connection, name, srid)
    try:
        connection.execute("INSERT INTO tunnel.tunnel (name, srid) VALUES (%s, %s)", [name, srid])
    except psycopg.errors.UniqueViolation:
        raise _taken(name) from None
    make_layers(connection)


def require_new_tunnel(connection: psycopg.Connection[Any], name: str, srid: int) -> None:
    """Raise UserError for a tunnel's name that is taken or won't do, or an SRID that is unknown or not in metres."""
    _require_name(name)
    _require_metres(connection, srid)
    if connection.execute("SELECT FROM tunnel.tunnel WHERE name = %s", [name]).fetchone() is not None:
        raise _taken(name)


def _taken(name: str) -> UserError:
    return UserError(f"there is a tunnel {name!r} already: tunneldb tunnel list")


def _require_name(name: str) -> None:
    """Refuse names that are unsuitable for file names and the command line."""
    if len(name) > MAX_NAME:
        raise UserError(f"the name {name[:20]!r}… has {len(name)} characters: use at most {MAX_NAME}")
    if not re.fullmatch(r"[A-Za-z0-9][\w.-]*", name):
        raise UserError(f"invalid name {name!r}: begin with a letter or a digit (A-Z, 0-9); then - _ . may follow, too")


def _require_metres(connection: psycopg.Connection[Any], srid: int) -> None:
    if srid == LOCAL:
        return
    row = connection.execute("SELECT srtext FROM spatial_ref_sys WHERE srid = %s", [srid]).fetchone()
    if row is None:
        raise UserError(f"PostGIS does not know SRID {srid}; use an EPSG number, such as 25830, or local")
    crs = pyproj.CRS.from_wkt(row[0])
    if not crs.is_projected:
        raise UserError(f"SRID {srid} ({crs.name}) is not projected; lengths and chainage need one in metres")
    units = {axis.unit_name for axis in crs.axis_info}
    if units != {"metre"}:
        raise UserError(f"SRID {srid} ({crs.name}) is in {', '.join(sorted(units))}, not metres")
    axes = mirroring_axes(srid)
    if axes is not None:
        raise UserError(
            f"SRID {srid} ({crs.name}) counts x and y to the {axes[0]} and {axes[1]}, which exchanges left and right; transform"
            " the files to a system that counts to the east and north"
        )


def survey_exists(name: str) -> UserError:
    """Return the error for an existing survey's name."""
    return UserError(f"there is a survey {name!r} already: tunneldb survey list")


def require_new_survey(connection: psycopg.Connection[Any], name: str) -> None:
    """Raise UserError for a survey's name that is taken or won't do."""
    _require_name(name)
    if connection.execute("SELECT FROM tunnel.survey WHERE name = %s", [name]).fetchone() is not None:
        raise survey_exists(name)


def add_survey(
    connection: psycopg.Connection[Any],
    name: str,
    tunnel: str,
    date: dt.date,
    poses: Sequence[Path] | None,
    *,
    mobile: bool,
    backwards: bool,
    reference: Path | Literal["auto"] | None,
    intensity: Intensity,
    time_offset: float = 0.0,
    units: Units = IN_METRES,
) -> Positions:
    """Add a survey with its scanner positions and reference curve; return the positions.

    Parameters
    ----------
    poses
        The one CSV of the trajectory (time,x,y,z) when `mobile`, else the files of the stations, see
        `tunneldb.pointcloud.stations.read_stations`; None where nobody knows where the scanner was.
    backwards
        True if the trajectory runs towards decreasing chainage.
    reference
        CSV with range_m,intensity_db; or auto, to find the curve on the lining of each kilometre.
    time_offset
        Seconds to add to the times of the trajectory.
    units
        Units of the coordinates in the files of `poses`.

    Raises
    ------
    UserError
        If a name exists, a tunnel is unknown, files do not fit it, or an intensity is unsuitable for estimating a range curve.
    """
    _require_name(name)
    tunnel_id, srid, alignment = _alignment(connection, tunnel)
    positions = read_positions(
        poses, alignment, tunnel, srid, mobile=mobile, backwards=backwards, time_offset=time_offset, units=units
    )
    if poses is None:
        require_no_range(intensity.kind)
    if reference == "auto":
        require_range(intensity.kind)
    if alignment is None and poses is None:
        raise UserError("structures are judged by range and incidence, from scanner positions: --no-poses is not for a site")
    curve = read_reference(reference) if isinstance(reference, Path) else None
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
                "unknown" if poses is None else "mobile" if mobile else "static",
                "measured" if curve is not None else reference or "none",
            ],
        ).fetchone()
    except psycopg.errors.UniqueViolation:
        raise survey_exists(name) from None
    assert row is not None
    save_positions(connection, row[0], positions, srid)
    if curve is not None:
        save_reference(connection, row[0], curve)
    return positions


@dataclass(frozen=True)
class SurveyChange:
    """New settings of a survey; None keeps the old one.

    Attributes
    ----------
    date : date or None
    poses : sequence of Path
        Files of the scanner's positions, see `add_survey`; empty leaves them.
    mobile, backwards : bool
        Kind of the positions.
    time_offset : float or None
        Seconds to add to the times of the trajectory as they are in its file.
    reference : Path, 'auto' or None
    kind, dimension : str or None
        Dimension and kind of the intensity.
    units : Units
        Units of the coordinates in the files of `poses`.
    accept_poses : bool
        True if files are to be loaded although their points do not fit the positions.
    """

    date: dt.date | None = None
    poses: Sequence[Path] = ()
    mobile: bool = False
    backwards: bool = False
    time_offset: float | None = None
    reference: Path | Literal["auto"] | None = None
    kind: str | None = None
    dimension: str | None = None
    units: Units = IN_METRES
    accept_poses: bool = False


def set_survey(connection: psycopg.Connection[Any], name: str, change: SurveyChange) -> tuple[list[str], int]:
    """Set a survey's date, positions, reference or intensity; results that depend on them become stale.

    Returns
    -------
    notes : list of str
        Remarks on the positions.
    reload : int
        Number of its files that must be loaded again: another dimension is read now, or points were left out for lack of a
        position.

    Raises
    ------
    UserError
        As for `add_survey`; nothing is changed then.
    """
    row = connection.execute(
        "SELECT s.id, t.name, s.intensity_kind, s.intensity_dimension, s.reference, s.platform FROM tunnel.survey s"
        " JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE s.name = %s FOR UPDATE OF s",
        [name],
    ).fetchone()
    if row is None:
        raise unknown_survey(connection, name)
    key, tunnel, old_kind, old_dimension, reference, platform = row
    kind = change.kind or old_kind
    dimension = None if kind == "none" else change.dimension or old_dimension
    if kind != "none" and dimension is None:
        raise UserError(f"--intensity must name the dimension that holds the {kind}")
    if platform == "unknown" and not change.poses:
        require_no_range(kind)
        if change.accept_poses:
            raise UserError(f"--accept-poses is about scanner positions; survey {name} has none; omit it")
    notes: list[str] = []
    if change.poses:
        _, srid, alignment = _alignment(connection, tunnel)
        positions = read_positions(
            change.poses, alignment, tunnel, srid, mobile=change.mobile, backwards=change.backwards,
            time_offset=change.time_offset or 0.0, units=change.units,
        )  # fmt: skip
        notes += positions.notes
        replace_positions(connection, key, positions, srid)
        connection.execute(
            "UPDATE tunnel.survey SET platform = %s WHERE id = %s", ["mobile" if change.mobile else "static", key]
        )
    elif change.time_offset is not None:
        notes += set_time_offset(connection, get_survey(connection, name, site=True), change.time_offset)
    moved = bool(change.poses) or change.time_offset is not None
    if change.reference is not None:
        curve = read_reference(change.reference) if isinstance(change.reference, Path) else None
        connection.execute("DELETE FROM tunnel.reference WHERE survey_id = %s", [key])
        if curve is not None:
            save_reference(connection, key, curve)
        reference = "auto" if curve is None else "measured"
    if reference == "auto" and (change.reference is not None or change.kind is not None):
        require_range(kind)
    connection.execute(
        "UPDATE tunnel.survey SET poses_accepted = %s OR poses_accepted AND NOT %s,"
        " date = coalesce(%s, date), intensity_kind = %s, intensity_dimension = %s, reference = %s,"
        " settings_at = CASE WHEN %s THEN clock_timestamp() ELSE settings_at END WHERE id = %s",
        [
            change.accept_poses,
            moved,
            change.date,
            kind,
            dimension,
            reference,
            moved or change.reference is not None or (kind, dimension) != (old_kind, old_dimension),
            key,
        ],
    )
    # Known by no checksum, so that detection asks for them and loading does not take them for unchanged.
    reload = connection.execute(
        "UPDATE tunnel.scan_file SET checksum = '' WHERE survey_id = %s AND (%s OR %s AND unposed > 0)",
        [key, dimension is not None and dimension != old_dimension, moved],
    ).rowcount
    return notes, reload


def _alignment(connection: psycopg.Connection[Any], tunnel: str) -> tuple[int, int, Alignment | None]:
    """Return a tunnel's key, SRID and given axis; a site has none."""
    row = connection.execute(
        "SELECT id, srid, start_chainage, spacing, ST_AsBinary(alignment) FROM tunnel.tunnel WHERE name = %s", [tunnel]
    ).fetchone()
    if row is None:
        raise unknown_tunnel(connection, tunnel)
    key, srid, start, spacing, wkb = row
    if wkb is None:
        return key, srid, None
    xyz = shapely.get_coordinates(shapely.from_wkb(wkb), include_z=True)
    return key, srid, Alignment.from_polyline(xyz, start, spacing)


def remove_survey(connection: psycopg.Connection[Any], name: str) -> None:
    """Remove a survey with all that was made of it."""
    if connection.execute("DELETE FROM tunnel.survey WHERE name = %s", [name]).rowcount == 0:
        raise unknown_survey(connection, name)


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
        raise unknown_tunnel(connection, name)
    make_layers(connection)


def make_layers(connection: psycopg.Connection[Any]) -> None:
    """Create the schema of typed layers of each coordinate system in use; drop the others."""
    connection.execute("CALL tunnel_api.make_layers()")


def crs_text(conn: psycopg.Connection[Any], srid: int) -> str:
    """Return a coordinate system of the database in a form for other programs: AUTHORITY:CODE, its definition, or local.

    Raises
    ------
    UserError
        The SRID isn't in ``spatial_ref_sys``.
    """
    if srid == LOCAL:
        return LOCAL_NAME
    row = conn.execute("SELECT auth_name, auth_srid, srtext FROM spatial_ref_sys WHERE srid = %s", [srid]).fetchone()
    if row is None:
        raise UserError(f"SRID {srid} is not in the database's spatial_ref_sys; add its definition there")
    return f"{row[0]}:{row[1]}" if row[0] in ("EPSG", "ESRI") else str(row[2])
