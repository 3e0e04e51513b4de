"""Anomalies of a face: rust, stains, cracks and bright flakes, as outlines on the unrolled face."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from shapely.geometry import LineString, Polygon, box
from shapely.geometry.base import BaseGeometry

from tunneldb.arrays import Float
from tunneldb.simulate.structure.materials import MATERIALS, RUST
from tunneldb.simulate.structure.shapes import Face

# Cosine of the incidence at which the nominal level of rust relative to its face is defined; rust has its own law.
RUST_COSINE = math.cos(math.radians(30.0))
AREA_SHARES = (0.02, 0.60)  # of the face
MAX_AREA = 1.0  # m²
MIN_WIDTH = 0.02  # m; least visible width of a face


@dataclass
class Anomaly:
    """Anomaly of a face.

    Attributes
    ----------
    id : int
        Number, from 1.
    face : Face
    kind : str
        rust, stain, crack or flake.
    outline : shapely geometry
        On the unrolled face, m.
    shift : float
        Nominal change of level, dB; negative: darker. For rust, at 30° of incidence.
    width : float
        Width of a crack, m; 0 for others.
    line : shapely geometry or None
        Centre line of a crack.
    """

    id: int
    face: Face
    kind: str
    outline: BaseGeometry
    shift: float
    width: float = 0.0
    line: LineString | None = None

    def level(self, cosine: Float) -> Float:
        """Return the change of level (n,) in dB at the cosines of incidence (n,)."""
        if self.kind != "rust":
            return np.full(len(cosine), self.shift)
        own = MATERIALS[self.face.material]
        at = np.array([RUST_COSINE])
        return np.asarray(self.shift + (RUST.level(cosine) - RUST.level(at)) - (own.level(cosine) - own.level(at)))


def blob(area: float, longer: float, turn: float, rng: np.random.Generator) -> Polygon:
    """Return a star-shaped outline around 0 of about an area, ``longer`` times as long as wide, m."""
    angle = np.linspace(0.0, 2.0 * math.pi, 72, endpoint=False)
    radius = np.ones(72)
    for k in range(2, 6):
        radius += rng.normal(0.0, 0.22 / k) * np.cos(k * angle + rng.uniform(0.0, 2.0 * math.pi))
    radius = np.maximum(radius, 0.3)
    p, q = radius * np.cos(angle) * math.sqrt(longer), radius * np.sin(angle) / math.sqrt(longer)
    outline = np.column_stack([p * math.cos(turn) - q * math.sin(turn), p * math.sin(turn) + q * math.cos(turn)])
    shape = Polygon(outline)
    return Polygon(outline * math.sqrt(area / shape.area))


def crack(length: float, turn: float, rng: np.random.Generator) -> LineString:
    """Return an irregular line around 0, m."""
    many = max(4, round(length / 0.05))
    heading = turn + np.cumsum(rng.normal(0.0, 0.25, many))
    at = np.cumsum(length / many * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
    return LineString(at - at.mean(axis=0))


def face_outline(face: Face, seen: Float) -> BaseGeometry:
    """Return the area for anomalies of a face: the box of its visible places (n, 2), m."""
    low, high = np.percentile(seen, [0.5, 99.5], axis=0)
    u, v = face.size()
    if face.kind == "plane":
        low, high = np.maximum(low, [-0.5 * u, -0.5 * v]), np.minimum(high, [0.5 * u, 0.5 * v])
    return box(*low, *high)


def place(number: int, face: Face, seen: Float, contrast: tuple[float, float], rng: np.random.Generator) -> Anomaly | None:
    """Place an anomaly around one of the visible places (n, 2) of a face; None: it would be too small."""
    inside = face_outline(face, seen)
    mineral = face.material in ("concrete", "brick")
    kind = str(rng.choice(["crack", "stain", "stain", "flake"] if mineral else ["rust", "rust", "rust", "flake", "stain"]))
    if kind == "rust" and face.material == "rusty steel":
        kind = "flake"
    middle = seen[int(rng.integers(len(seen)))]
    drop = float(rng.uniform(*contrast))
    turn = float(rng.uniform(0.0, math.pi))
    if kind == "crack":
        width = float(np.exp(rng.uniform(math.log(0.002), math.log(0.02))))
        line = crack(float(rng.uniform(0.4, 1.8)), turn, rng)
        line = LineString(np.asarray(line.coords) + middle).intersection(inside)
        if not isinstance(line, LineString) or line.length < 0.2:
            return None
        return Anomaly(number, face, kind, line.buffer(0.5 * width, cap_style="flat"), -drop, width, line)
    share = math.exp(rng.uniform(math.log(AREA_SHARES[0]), math.log(AREA_SHARES[1])))
    area = min(share * inside.area, MAX_AREA * float(rng.uniform(0.05, 1.0)))
    if kind == "flake":
        area = min(area, 0.1)
    # An anomaly crosses a narrow face instead of extending along it as a thread.
    low, high = np.array(inside.bounds[:2]), np.array(inside.bounds[2:])
    narrow = float((high - low).min())
    if narrow < MIN_WIDTH:
        return None
    longer = max(float(rng.uniform(1.0, 2.5)), area / narrow**2)
    if area > 0.3 * narrow**2:
        turn = 0.0 if (high - low)[0] > (high - low)[1] else 0.5 * math.pi
    shape = blob(area, longer, turn, rng)
    outline = Polygon(np.asarray(shape.exterior.coords) + middle).buffer(0.0).intersection(inside)
    if not isinstance(outline, Polygon) or outline.area < 0.3 * area or outline.area < 1e-4:
        return None
    return Anomaly(number, face, kind, outline, drop if kind == "flake" else -drop)
