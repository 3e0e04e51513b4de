"""Sections and fittings of steel and concrete, made of faces and tubes."""

from __future__ import annotations

import numpy as np

from .cast import Body, Face, Mark, Material, Plane, Tube, _frame


def point(*xyz: float) -> np.ndarray:
    """Give a point as an array."""
    return np.array(xyz, dtype=float)


def plate(
    centre: np.ndarray, along: np.ndarray, over: np.ndarray, half: tuple[float, float], stuff: Material, **rest: object
) -> Face:
    """Give a rectangle. Its front looks along the cross product of `along` and `over`."""
    along, over = np.asarray(along, float), np.asarray(over, float)
    return Face(stuff, centre=centre, along=along / np.linalg.norm(along), over=over / np.linalg.norm(over), half=half, **rest)


def angle(
    a: np.ndarray, b: np.ndarray, first: np.ndarray, second: np.ndarray, leg: float, stuff: Material, thick: float = 0.008
) -> list[Body]:
    """Give an angle section whose heel runs from `a` to `b`: two legs, each with two faces, and their edges.

    The outer face of the first leg is the first body, that of the second leg the third.
    """
    w = (b - a) / np.linalg.norm(b - a)
    first = first - (first @ w) * w
    first /= np.linalg.norm(first)
    second = second - (second @ w) * w - (second @ first) * first
    second /= np.linalg.norm(second)
    mid, half = (a + b) / 2, float(np.linalg.norm(b - a)) / 2
    out: list[Body] = []
    for p, q in ((first, second), (second, first)):
        # The outer face looks away from the other leg.
        for depth, sign in ((0.0, -1.0), (thick, 1.0)):
            along = w if np.cross(w, p) @ (sign * q) > 0 else -w
            out.append(plate(mid + p * leg / 2 + q * depth, along, p, (half, leg / 2), stuff))
        out.append(plate(mid + p * leg + q * thick / 2, w, q, (half, thick / 2), stuff))
    return [out[0], out[1], out[3], out[4], out[2], out[5]]


def block(low: np.ndarray, high: np.ndarray, stuff: Material, turn: np.ndarray | None = None) -> list[Face]:
    """Give a box with faces -x, +x, -y, +y, -z, +z. Fronts look outwards; `turn` rotates it about its middle.

    On upright faces the second coordinate is the height above the middle.
    """
    mid, h = (low + high) / 2, (high - low) / 2
    r = np.eye(3) if turn is None else turn
    x, y, z = r[:, 0], r[:, 1], r[:, 2]
    return [
        plate(mid - x * h[0], -y, z, (h[1], h[2]), stuff),
        plate(mid + x * h[0], y, z, (h[1], h[2]), stuff),
        plate(mid - y * h[1], x, z, (h[0], h[2]), stuff),
        plate(mid + y * h[1], -x, z, (h[0], h[2]), stuff),
        plate(mid - z * h[2], -x, y, (h[0], h[1]), stuff),
        plate(mid + z * h[2], x, y, (h[0], h[1]), stuff),
    ]


def beam(
    a: np.ndarray, b: np.ndarray, up: np.ndarray, size: tuple[float, float, float, float], stuff: Material
) -> list[list[Face]]:
    """Give an I-section of height, width, web and flange thickness: web, upper flange, lower flange, each as a box."""
    w = (b - a) / np.linalg.norm(b - a)
    up = up - (up @ w) * w
    up /= np.linalg.norm(up)
    turn = np.stack([w, np.cross(up, w), up], axis=1)
    height, width, web, flange = size
    mid, half = (a + b) / 2, float(np.linalg.norm(b - a)) / 2
    out = []
    for rise, across, tall in (
        (0.0, web, height - 2 * flange),
        ((height - flange) / 2, width, flange),
        ((flange - height) / 2, width, flange),
    ):
        c, h = mid + up * rise, np.array([half, across / 2, tall / 2])
        out.append(block(c - h, c + h, stuff, turn))
    return out


def bolts(
    face: Face, spots: list[tuple[float, float]], radius: float, tall: float, stuff: Material, side: int = 1
) -> list[Body]:
    """Give round heads on a face."""
    n = np.cross(face.along, face.over) * side
    out: list[Body] = []
    for u, v in spots:
        foot = face.centre + face.along * u + face.over * v
        out.append(Tube(stuff, a=foot, b=foot + n * tall, radius=radius))
        out.append(disc(foot + n * tall, n, radius, stuff))
    return out


def disc(centre: np.ndarray, normal: np.ndarray, radius: float, stuff: Material) -> Face:
    """Give a round plate whose front looks along `normal`."""
    a, b = _frame(normal / np.linalg.norm(normal))
    return Face(stuff, centre=centre, along=a, over=b, half=(radius, radius), mask=lambda u, v: np.hypot(u, v) < radius)


def grating(pitch_u: float, pitch_v: float, bar: float) -> Plane:
    """Give the mask of bars both ways."""
    return lambda u, v: (np.mod(u, pitch_u) < bar) | (np.mod(v, pitch_v) < bar)


def wire(a: np.ndarray, b: np.ndarray, radius: float, stuff: Material) -> Tube:
    """Give a wire, cable or rope, which has no surface number."""
    return Tube(stuff, smooth=False, a=a, b=b, radius=radius)


def sag(a: np.ndarray, b: np.ndarray, drop: float, radius: float, stuff: Material, count: int = 10) -> list[Body]:
    """Give a wire that hangs through, in pieces."""
    s = np.linspace(0.0, 1.0, count + 1)
    p = a + s[:, None] * (b - a) - np.outer(4 * s * (1 - s) * drop, point(0, 0, 1))
    return [wire(x, y, radius, stuff) for x, y in zip(p[:-1], p[1:], strict=True)]


def plants(centre: np.ndarray, spread: np.ndarray, count: int, stuff: Material, rng: np.random.Generator) -> list[Body]:
    """Give leaves as small plates at any angle."""
    out: list[Body] = []
    for _ in range(count):
        a = rng.normal(size=3)
        b = np.cross(a, rng.normal(size=3))
        size = rng.uniform(0.02, 0.06)
        out.append(plate(centre + rng.normal(size=3) * spread, a, b, (size, size * 0.5), stuff, smooth=False))
    return out


def stripe(low: float, high: float, db: float, axis: int = 1) -> Plane:
    """Give a painted stripe or a joint between two values of one coordinate."""
    return lambda u, v: db * (((u, v)[axis] > low) & ((u, v)[axis] < high))


def add(body: Body, kind: str, db: float, weight: Plane, lobe: float = 0.0, side: int = 1, limit: str = "") -> None:
    """Put an anomaly on a body."""
    body.marks.append(Mark(kind, db, weight, side, lobe, limit))
