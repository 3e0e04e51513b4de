"""Design profiles of a tunnel, to and from the database."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.raster.geotiff import DEVIATION_KINDS, OVERVIEW
from tunneldb.shape.outline import Outline
from tunneldb.shape.profile import Profile, Stretch, stretches
from tunneldb.store.surface import alignment_of


@dataclass(frozen=True)
class DesignTunnel:
    """Tunnel with the data for placing profiles.

    Attributes
    ----------
    tunnel_id, tunnel
        Its key and name.
    start, end
        Chainage of its given axis' ends, m.
    """

    tunnel_id: int
    tunnel: str
    start: float
    end: float


def get_design_tunnel(conn: psycopg.Connection[Any], tunnel_id: int, name: str) -> DesignTunnel:
    """Return a tunnel with the ends of its axis.

    Raises
    ------
    UserError
        If it is a site.
    """
    line = alignment_of(conn, tunnel_id)
    if line is None:
        raise UserError(f"{name} is a site: profiles need an axis")
    return DesignTunnel(tunnel_id, name, line.start, line.end)


def save_profile(conn: psycopg.Connection[Any], tunnel: DesignTunnel, profile: Profile, layer: str, source: str) -> None:
    """Add a profile to a layer of a tunnel.

    Raises
    ------
    UserError
        If its name is taken, it overlaps another of the layer, or can't go over into the one before or after.
    """
    there = load_profiles(conn, tunnel.tunnel_id, layer)
    if profile.name in (other.name for other in there):
        raise UserError(
            f"tunnel {tunnel.tunnel} has a profile {profile.name!r} of layer {layer}: "
            f"tunneldb profile remove {tunnel.tunnel} {profile.name} --layer {layer}"
        )
    _stretches(tunnel.tunnel, layer, [*there, profile])
    conn.execute(
        "INSERT INTO tunnel.design_profile (tunnel_id, name, layer, chainage_from, chainage_to, outline, source)"
        " VALUES (%s, %s, %s, %s, %s, %s, %s)",
        [
            tunnel.tunnel_id, profile.name, layer, profile.chainage_from, profile.chainage_to,
            _vertices(profile.outline).ravel().tolist(), source,
        ],
    )  # fmt: skip


def remove_profile(conn: psycopg.Connection[Any], tunnel_id: int, tunnel: str, name: str, layer: str) -> None:
    """Remove a profile, and the images of deviation where it or its transitions apply; results from it become stale."""
    there = load_profiles(conn, tunnel_id, layer)
    place = next((k for k, profile in enumerate(there) if profile.name == name), None)
    if place is None:
        raise UserError(f"tunnel {tunnel} has no profile {name!r} of layer {layer}: tunneldb profile list {tunnel}")
    low = there[place - 1].chainage_to if place > 0 else -np.inf
    high = there[place + 1].chainage_from if place + 1 < len(there) else np.inf
    conn.execute(
        "DELETE FROM tunnel.image i USING tunnel.survey s WHERE s.tunnel_id = %s AND i.survey_id = s.id AND i.kind = ANY(%s)"
        " AND (i.km + 1) * %s::float8 > %s AND i.km * %s::float8 < %s",
        [tunnel_id, [DEVIATION_KINDS[layer], OVERVIEW + DEVIATION_KINDS[layer]], KILOMETRE, low, KILOMETRE, high],
    )
    conn.execute(
        "DELETE FROM tunnel.design_profile WHERE tunnel_id = %s AND name = %s AND layer = %s", [tunnel_id, name, layer]
    )


def load_profiles(conn: psycopg.Connection[Any], tunnel_id: int, layer: str) -> list[Profile]:
    """Return the profiles of a layer, in order of chainage."""
    rows = conn.execute(
        "SELECT name, chainage_from, chainage_to, outline FROM tunnel_api.design_profile"
        " WHERE tunnel_id = %s AND layer = %s ORDER BY chainage_from",
        [tunnel_id, layer],
    ).fetchall()
    return [Profile(name, low, high, outline_of(numbers)) for name, low, high, numbers in rows]


def load_design(conn: psycopg.Connection[Any], tunnel_id: int, tunnel: str, layer: str) -> list[Stretch]:
    """Return the profiles of a layer and the transitions between them, in order of chainage.

    Raises
    ------
    UserError
        If the layer has none.
    """
    profiles = load_profiles(conn, tunnel_id, layer)
    if not profiles:
        rows = conn.execute("SELECT DISTINCT layer FROM tunnel.design_profile WHERE tunnel_id = %s ORDER BY 1", [tunnel_id])
        others = ", ".join(row[0] for row in rows)
        raise UserError(
            f"tunnel {tunnel} has no design profile of layer {layer}{f', but of {others}' if others else ''}: "
            f"tunneldb profile add {tunnel} profile.csv --layer {layer}"
        )
    return _stretches(tunnel, layer, profiles)


def _stretches(tunnel: str, layer: str, profiles: Sequence[Profile]) -> list[Stretch]:
    try:
        return stretches(profiles)
    except ValueError as error:
        raise UserError(
            f"profiles of layer {layer} of tunnel {tunnel}: {error}; give another range by --from and --to, or remove one of"
            f" them: tunneldb profile remove {tunnel} NAME --layer {layer}"
        ) from None


def _vertices(outline: Outline) -> Float:
    """Return rows of right, up and bulge; the last one's bulge is 0."""
    elements = outline.elements
    return np.vstack([elements[:, [0, 1, 4]], [[*elements[-1, 2:4], 0.0]]])


def outline_of(numbers: Sequence[float]) -> Outline:
    """Return the outline of a stored one: right, up and bulge of each vertex, one after the other."""
    rows = np.reshape(numbers, (-1, 3))
    return Outline(np.column_stack([rows[:-1, :2], rows[1:, :2], rows[:-1, 2]]))
