"""Later scan of the same tunnel: other noise, grown, dried and new leaks, deformed lining, and pose errors."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from shapely import affinity
from shapely.geometry import MultiPolygon, Polygon, box

from tunneldb.arrays import Float
from tunneldb.simulate.lining.leaks import FreeArea, Leak, place
from tunneldb.simulate.tunnel.tunnel import Tunnel

if TYPE_CHECKING:
    from tunneldb.simulate.parameters import Parameters

GROWTH_RATIO = 2.0
"""Ratio of the area of a grown leak to its former area."""

WALL = (0.55, 0.7), (0.35, 0.75)
"""Moved part of the wall: shares of the length, and of the arc from the crown to the floor on the right."""

RING = 0.3
"""Start of the squeezed ring, as a share of the length; it is as long as a ring, or 1.5 m."""

BULGE = 1.0
"""Side of a bulge, m."""

_RING = 1.5  # m
_FIXTURE_MARGIN = 0.5  # m between the lining and fixtures that move with it
_DEGREES = 2.0  # order of an ovalisation


@dataclass(frozen=True)
class Deformation:
    """Deformed lining: outline in the unrolled plane (m), kind (wall, ring, bulge), and greatest change, m inwards."""

    outline: Polygon
    kind: str
    change: float


@dataclass(frozen=True)
class Epoch:
    """State of a tunnel at a later scan."""

    parameters: Parameters
    tunnel: Tunnel
    deformations: list[Deformation]

    def moved(self, xyz: Float, chainage: Float, arc: Float, offset: Float) -> tuple[Float, Float]:
        """Return points (n, 3) at the later scan as they are and as placed by it, in the local frame, and their offset."""
        p, tunnel = self.parameters, self.tunnel
        change = np.where(np.abs(offset) < _FIXTURE_MARGIN, self.change(chainage, arc), 0.0)
        frame = tunnel.line.frame(chainage)
        normal = np.asarray(tunnel.section.point(arc)[1])  # right and up, into the tunnel
        xyz = xyz + change[:, None] * (normal[:, :1] * frame.u + normal[:, 1:] * frame.w)
        if p.pose_error or p.pose_turn:
            # A shift that varies around the true place, with limited rotation of the scan, and a rotation about the axis.
            turn = math.radians(p.pose_turn)
            phase = (chainage - tunnel.line.start) * (turn / p.pose_error if p.pose_error else 0.0)
            away = xyz - (frame.position - tunnel.line.origin)
            up = np.einsum("ij,ij->i", away, frame.w)
            right = np.einsum("ij,ij->i", away, frame.u)
            xyz = xyz + (p.pose_error * np.sin(phase + 1.0) + turn * up)[:, None] * frame.u
            xyz = xyz + (p.pose_error * np.cos(phase + 1.0) - turn * right)[:, None] * frame.w
        return xyz, offset + change

    def change(self, chainage: Float, arc: Float) -> Float:
        """Return the movement of the lining along its normal, m, positive inwards."""
        change = np.zeros(len(chainage))
        for one in self.deformations:
            west, south, east, north = one.outline.bounds
            inside = (chainage >= west) & (chainage < east) & (arc >= south) & (arc < north)
            if one.kind == "ring":
                # Both walls move inwards, and the crown rises, by half of the loss of width.
                angle = arc[inside] / self.parameters.section_radius
                change[inside] -= one.change * np.cos(_DEGREES * angle)
            else:
                change[inside] += one.change
        return change


def epoch(parameters: Parameters, tunnel: Tunnel) -> Epoch | None:
    """Return the changes of the lining; None for the first scan."""
    p, line, edge = parameters, tunnel.line, tunnel.section.floor_arc
    if not p.epoch:
        return None
    length, found = line.end - line.start, []
    if p.moved_wall:
        (west, east), (low, high) = WALL
        outline = box(line.start + west * length, low * edge, line.start + east * length, high * edge)
        found.append(Deformation(outline, "wall", p.moved_wall))
    if p.squeezed_ring:
        ring = p.ring_length() or _RING
        west = line.start + round(RING * length / ring) * ring
        found.append(Deformation(box(west, -edge, west + ring, edge), "ring", p.squeezed_ring / 2.0))
    for k in range(p.bulges):
        # Evenly along the tunnel, alternately left, above and right, away from the moved wall.
        west = line.start + (k + 0.5) * length / p.bulges - BULGE / 2.0
        arc = (-0.5, 0.0, 0.3)[k % 3] * edge
        found.append(Deformation(box(west, arc, west + BULGE, arc + BULGE), "bulge", p.bulge))
    return Epoch(p, tunnel, found)


def leaks_since(parameters: Parameters, tunnel: Tunnel, free_area: FreeArea, leaks: list[Leak]) -> list[Leak]:
    """Return the leaks of a later scan: the largest grow, the smallest dry up, and new ones get new numbers."""
    p = parameters
    by_size = [leak.id for leak in sorted(leaks, key=lambda leak: -leak.area)]
    grown, dried = by_size[: p.grown_leaks], by_size[len(by_size) - p.dried_leaks :]
    limit = tunnel.section.floor_arc - 0.05
    kept = [_grown(leak, limit) if leak.id in grown else leak for leak in leaks if leak.id not in dried]
    rng = np.random.default_rng(np.random.SeedSequence(p.seed, spawn_key=(1_000_000 + p.epoch,)))
    new = place(tunnel, free_area, p.new_leaks, p.leak_area, p.leak_drop, rng)
    return kept + [replace(leak, id=len(leaks) + leak.id) for leak in new]


def _grown(leak: Leak, limit: float) -> Leak:
    side = math.sqrt(GROWTH_RATIO)
    outline = affinity.scale(leak.polygon, side, side).intersection(
        box(leak.polygon.bounds[0] - 100.0, -limit, leak.polygon.bounds[2] + 100.0, limit)
    )
    if not isinstance(outline, (Polygon, MultiPolygon)):
        return leak
    return replace(leak, polygon=outline, area_surface=leak.area_surface * outline.area / leak.area)
