"""Darker or brighter rectangles on the lining: repairs, painted numbers and stripes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from shapely import STRtree
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.simulate.lining.rings import CHAMFER, Rings
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.tunnel import Tunnel

TRIES = 600
MIN_CLEARANCE = 0.15  # between marks, and between a mark and a leak, m
DIGIT = (0.18, 0.30)  # width and height, m
# Strokes of the digits as on a seven-segment display: ends in shares of the width and the height.
_STROKES = {
    "a": (0, 1, 1, 1), "b": (1, 1, 1, 0.5), "c": (1, 0.5, 1, 0), "d": (1, 0, 0, 0),
    "e": (0, 0, 0, 0.5), "f": (0, 0.5, 0, 1), "g": (0, 0.5, 1, 0.5),
}  # fmt: skip
_DIGITS = ("abcdef", "bc", "abged", "abgcd", "fgbc", "afgcd", "afgedc", "abc", "abcdefg", "abcdfg")


@dataclass(frozen=True)
class Mark:
    """Rectangle around the line from ``one`` to ``other`` (chainage, arc), ``width`` m wide, with square ends.

    ``kind`` is patch, paint (a stroke of a number), stripe or chamfer, ``level`` is added to the reflectance, dB.
    """

    kind: str
    one: tuple[float, float]
    other: tuple[float, float]
    width: float
    level: float

    def polygon(self) -> Polygon:
        """Return the outline in the unrolled plane."""
        return LineString([self.one, self.other]).buffer(0.5 * self.width, cap_style="flat")


def mark_table(marks: list[Mark]) -> Float:
    """Return rows for the kernel: chainage from, to; centre (2), unit direction (2), half length, half width, level."""
    rows = np.empty((len(marks), 9))
    for row, mark in zip(rows, marks, strict=True):
        one, other = np.array(mark.one), np.array(mark.other)
        length = float(np.linalg.norm(other - one))
        left, _, right, _ = mark.polygon().bounds
        row[:] = left, right, *(0.5 * (one + other)), *((other - one) / length), 0.5 * length, 0.5 * mark.width, mark.level
    return rows


def _patch(p: Parameters, s: float, arc: float, rng: np.random.Generator) -> list[Mark]:
    """Return a repaired rectangle, turned by up to the requested angle."""
    (low, high), turn = p.patch_level, math.radians(p.patch_turn)
    length, width, level = rng.uniform((0.5, 0.5, low), (2.0, 2.0, high)).tolist()
    if turn and rng.random() < 0.5:
        turn = -turn
    along, across = 0.5 * length * math.cos(turn), 0.5 * length * math.sin(turn)
    return [Mark("patch", (s - along, arc - across), (s + along, arc + across), width, level)]


def _stripe(p: Parameters, s: float, arc: float, rng: np.random.Generator) -> list[Mark]:
    """Return a painted line along the tunnel."""
    length, level = rng.uniform((2.0, -4.0), (10.0, 4.0)).tolist()
    low, high = p.stripe_width
    width = float(rng.uniform(low, high)) if high > low else low
    return [Mark("stripe", (s - 0.5 * length, arc), (s + 0.5 * length, arc), width, level)]


def _number(p: Parameters, s: float, arc: float, rng: np.random.Generator) -> list[Mark]:
    """Return two to four painted digits, upright on the wall, readable from inside the tunnel."""
    width, level = rng.uniform((0.03, -4.0), (0.05, 4.0)).tolist()
    up = -math.copysign(1.0, arc)
    ahead = -up  # on the right wall, text reads against the chainage
    strokes = []
    for i, digit in enumerate(rng.integers(0, 10, int(rng.integers(2, 5))).tolist()):
        for stroke in _DIGITS[digit]:
            x1, y1, x2, y2 = _STROKES[stroke]
            ends = [(s - ahead * DIGIT[0] * (x + 1.6 * i), arc + up * DIGIT[1] * (y - 0.5)) for x, y in ((x1, y1), (x2, y2))]
            strokes.append(Mark("paint", ends[0], ends[1], width, level))
    return strokes


def place_marks(parameters: Parameters, tunnel: Tunnel, taken: list[BaseGeometry], seed: np.random.SeedSequence) -> list[Mark]:
    """Place patches, and numbers and stripes in turn, on the lining, away from ``taken`` and from each other.

    Raises
    ------
    UserError
        If there is no space for all.
    """
    p, line = parameters, tunnel.line
    patches, paints = (np.random.default_rng(s) for s in seed.spawn(2))
    requested = [(_patch, patches)] * p.patches + [((_number, _stripe)[i % 2], paints) for i in range(p.paint)]
    lowest = tunnel.section.floor_arc - 0.1
    shapes = [t.buffer(MIN_CLEARANCE) for t in taken]
    marks: list[Mark] = []
    for number, (make, rng) in enumerate(requested):
        tree = STRtree(shapes)
        for _ in range(TRIES):
            s = float(rng.uniform(line.start + 1.0, line.end - 1.0))
            arc = float(rng.uniform(-lowest, lowest))
            if make is _number:  # at a readable height
                arc = math.copysign(float(rng.uniform(0.55, 0.9)) * lowest, arc)
            made = make(p, s, arc, rng)
            outline = unary_union([m.polygon() for m in made])
            left, low, right, high = outline.bounds
            inside = left > line.start + 0.5 and right < line.end - 0.5 and low > -lowest and high < lowest
            if inside and not len(tree.query(outline, predicate="intersects")):
                break
        else:
            raise UserError(f"no room on the lining for mark {number + 1} of {len(requested)}; use fewer patches or less paint")
        shapes.append(outline.buffer(MIN_CLEARANCE))
        marks += made
    return marks


def chamfers(parameters: Parameters, tunnel: Tunnel, rings: Rings) -> list[Mark]:
    """Return the chamfered edges of ring joints: dark, slightly oblique bands across the whole lining."""
    line, lowest = tunnel.line, tunnel.section.floor_arc
    joints = rings.first + np.arange(rings.askew.size) * rings.length
    return [
        Mark("chamfer", (s - askew * lowest, -lowest), (s + askew * lowest, lowest), CHAMFER, -parameters.chamfers)
        for s, askew in zip(joints.tolist(), rings.askew.tolist(), strict=True)
        if line.start < s < line.end
    ]
