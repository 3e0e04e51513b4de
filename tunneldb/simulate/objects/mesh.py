"""Wire mesh in front of the lining, for retaining loose rock: rays pass through it, or hit a wire.

The mesh is on a surface parallel to the nominal section, so that its wires are lines of constant chainage and of constant
arc. Wires are thin compared with their distance from the wall, so they hide only the surface directly behind them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.tunnel import Tunnel

# Limits of the thickness of wires, of their distance from the lining, m, and of their darkening, dB.
WIRE, GAP, DROP = (0.002, 0.008), (0.02, 0.10), (-3.0, 5.0)
# Height of the mesh over rough lining, as a share of the greatest relief: it spans between high points.
MESH_HEIGHT_SHARE = 0.6
# Newton steps from the lining to the mesh, and the least cosine of incidence in them.
STEPS, MIN_COSINE = 4, 0.05


class Mesh(NamedTuple):
    """Mesh: distance between wires, their thickness, offset from the nominal section, m, and their darkening, dB."""

    spacing: float
    wire: float
    offset: float
    drop: float


def make_mesh(parameters: Parameters, highest: float, seed: np.random.SeedSequence) -> Mesh | None:
    """Return the requested mesh, if any, in front of a lining whose relief reaches ``highest`` m."""
    if parameters.mesh == 0.0:
        return None
    rng = np.random.default_rng(seed)
    wire, gap, drop = rng.uniform(*np.array([WIRE, GAP, DROP]).T).tolist()
    return Mesh(parameters.mesh, wire, gap + MESH_HEIGHT_SHARE * highest, drop)


def intersect_mesh(
    mesh: Mesh, tunnel: Tunnel, origin: Float, direction: Float, rays: Int64, found: Float, r: Float
) -> tuple[Int64, Float]:
    """Return the ``rays`` (m,) that hit a wire before anything else at ranges ``r`` (n,), and their ranges there.

    ``found`` (6, n) are the hits on the lining, rows as of :func:`intersect_lining`; the cosine of hit wires is replaced.
    """
    start, way, t, s = origin[rays], direction[rays], found[0, rays], found[1, rays]
    place = tunnel.unroll_near(start + t[:, None] * way, s, 1e-4)
    for _ in range(STEPS):
        slant = np.maximum(-np.sum(place.normal * way, axis=1), MIN_COSINE)
        t = t + (place.offset - mesh.offset) / slant
        place = tunnel.unroll_near(start + t[:, None] * way, place.chainage, 1e-4)
    from_wire = [np.abs(np.mod(x, mesh.spacing) - 0.5 * mesh.spacing) for x in (place.chainage, place.arc)]
    hit = (np.minimum(*from_wire) < 0.5 * mesh.wire) & (t > 0.0) & (t < r[rays])
    hit &= (np.abs(place.arc) < tunnel.section.floor_arc) & (np.abs(place.offset - mesh.offset) < mesh.wire)
    found[3, rays[hit]] = slant[hit]
    return rays[hit], t[hit]
