"""Surfaces with closed formulas for rays, and the faces and members made of them.

Coordinates are local: x across the view, y away from the stations, z up, m.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tunneldb.arrays import Float, Int64

RECTANGLE, TUBE, RING, BEND = 0.0, 1.0, 2.0, 3.0
# Columns of a surface: kind, origin (1:4), unit axes (4:7, 7:10, 10:13), four sizes (13:17):
#   rectangle  origin in the middle, half sizes along the first and second axis; the third is the normal
#   tube       origin at one end, the third axis along it; radius, length
#   ring       origin in the middle, the third axis is the normal; inner and outer radius
#   bend       part of a torus: origin in its middle, the third axis is its axis; it runs from the first axis towards the
#              second; radius of its centreline, of the tube, angle (rad)
COLUMNS = 17


def surface(kind: float, origin: Float, axes: Float, *sizes: float) -> Float:
    """Return the row of a surface; ``axes`` (3, 3) has a unit axis in each row."""
    row = np.zeros(COLUMNS)
    row[0], row[1:4], row[4:13] = kind, origin, np.ravel(axes)
    row[13 : 13 + len(sizes)] = sizes
    return row


def axes_about(direction: Float) -> Float:
    """Return right-handed unit axes (3, 3), the third along a direction, the first towards the stations (-y) if possible.

    So the seam of an unrolled pipe is at the back.
    """
    third = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    towards = np.array([0.0, -1.0, 0.0]) if abs(third[1]) < 0.9 else np.array([1.0, 0.0, 0.0])
    first = towards - (towards @ third) * third
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(third, first), third])


@dataclass
class Face:
    """Surface of one material: a plane, a cylinder or a bend.

    Attributes
    ----------
    id, member : int
        Numbers, from 1.
    kind : str
        plane, cylinder or bend.
    material : str
        Name in :data:`tunneldb.simulate.structure.materials.MATERIALS`.
    row : (17,) array
        Surface whose frame is that of the face: u, v are along its first two axes (plane), or along the axis and around it
        (cylinder).
    surfaces : int
        Number of surfaces in the face; the end of a profile has several in one plane.
    """

    id: int
    member: int
    kind: str
    material: str
    row: Float
    surfaces: int = 1

    def unroll(self, xyz: Float) -> Float:
        """Return coordinates (n, 2) on the face of points (n, 3), m."""
        local = (xyz - self.row[1:4]) @ self.row[4:13].reshape(3, 3).T
        if self.kind == "plane":
            return np.asarray(local[:, :2])
        return np.column_stack([local[:, 2], self.row[13] * np.arctan2(local[:, 1], local[:, 0])])

    def to_space(self, uv: Float) -> Float:
        """Return points (n, 3) of coordinates (n, 2) on the face, m."""
        axes = self.row[4:13].reshape(3, 3)
        if self.kind == "plane":
            return np.asarray(self.row[1:4] + uv @ axes[:2])
        angle, radius = uv[:, 1] / self.row[13], self.row[13]
        round_ = radius * (np.cos(angle)[:, None] * axes[0] + np.sin(angle)[:, None] * axes[1])
        return np.asarray(self.row[1:4] + uv[:, :1] * axes[2] + round_)

    def size(self) -> tuple[float, float]:
        """Return lengths along u and v, m."""
        if self.row[0] == RING:
            return 2.0 * float(self.row[14]), 2.0 * float(self.row[14])
        if self.kind == "plane":
            return 2.0 * float(self.row[13]), 2.0 * float(self.row[14])
        return float(self.row[14]), 2.0 * math.pi * float(self.row[13])


@dataclass
class Member:
    """Structural member: number, kind, ids of its faces."""

    id: int
    kind: str
    faces: list[int] = field(default_factory=list)


@dataclass
class Structure:
    """Members, faces, and all surfaces; ``owner`` has the face of each surface, 0 for wires and cables, which have no faces.

    ``wire`` has the material of each surface that belongs to no face.
    """

    members: list[Member] = field(default_factory=list)
    faces: list[Face] = field(default_factory=list)
    rows: list[Float] = field(default_factory=list)
    owner: list[int] = field(default_factory=list)
    material: list[str] = field(default_factory=list)

    def member(self, kind: str) -> Member:
        """Add a member without faces."""
        self.members.append(Member(len(self.members) + 1, kind))
        return self.members[-1]

    def face(self, member: Member, kind: str, material: str, rows: Sequence[Float]) -> Face:
        """Add a face, made of one or more surfaces in one plane, or of one cylinder or bend."""
        face = Face(len(self.faces) + 1, member.id, kind, material, rows[0], len(rows))
        self.faces.append(face)
        member.faces.append(face.id)
        self._add(rows, face.id, material)
        return face

    def wires(self, material: str, rows: Sequence[Float]) -> None:
        """Add surfaces without faces: wires, cables, bars."""
        self._add(rows, 0, material)

    def _add(self, rows: Sequence[Float], owner: int, material: str) -> None:
        self.rows += rows
        self.owner += [owner] * len(rows)
        self.material += [material] * len(rows)

    def table(self) -> tuple[Float, Int64]:
        """Return surfaces (n, 17) and the face of each (n,)."""
        return np.array(self.rows), np.array(self.owner, dtype=np.int64)


def normals(rows: Float, xyz: Float) -> Float:
    """Return unit normals (n, 3), outward, at points (n, 3) on surfaces, one row of ``rows`` (n, 17) each."""
    local = xyz - rows[:, 1:4]
    axis = rows[:, 10:13]
    kind = rows[:, 0]
    out = axis.copy()
    across = local - np.einsum("ij,ij->i", local, axis)[:, None] * axis
    is_tube = kind == TUBE
    out[is_tube] = across[is_tube]
    is_bend = kind == BEND
    ring = across[is_bend] / np.linalg.norm(across[is_bend], axis=1)[:, None] * rows[is_bend, 13:14]
    out[is_bend] = local[is_bend] - ring
    return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])


def hulls(row: Float) -> Float:
    """Return balls (n, 4: centre, radius) that cover a surface, small if it is long and thin."""
    kind, origin = row[0], row[1:4]
    first, second, third = row[4:13].reshape(3, 3)
    a, b, c = row[13:16]
    if kind == RECTANGLE:
        step = max(0.25, min(a, b))
        count = [max(1, math.ceil(2.0 * half / (2.0 * step))) for half in (a, b)]
        u, v = (((np.arange(k) + 0.5) / k * 2.0 - 1.0) * half for k, half in zip(count, (a, b), strict=True))
        middle = origin + (u[:, None, None] * first + v[None, :, None] * second).reshape(-1, 3)
        return np.column_stack([middle, np.full(len(middle), math.hypot(a / count[0], b / count[1]))])
    if kind == TUBE:
        many = max(1, math.ceil(b / max(2.0 * a, 0.2)))
        along = (np.arange(many) + 0.5) / many * b
        return np.column_stack([origin + along[:, None] * third, np.full(many, math.hypot(a, 0.5 * b / many))])
    if kind == RING:
        return np.array([[*origin, b]])
    angle = (np.arange(4) + 0.5) / 4 * c
    middle = origin + a * (np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second)
    return np.column_stack([middle, np.full(4, 2.0 * a * math.sin(c / 16.0) + b)])
