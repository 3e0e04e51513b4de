"""Segmental lining of shield tunnels: rings, joints, bolt pockets, grout holes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .canvas import Canvas
from .dirt import Dirt
from .texture import box
from .tunnel import Section


@dataclass
class Rings:
    """Layout of a segmental lining.

    Attributes
    ----------
    width, first : float
        Width of a ring, and chainage of the first joint.
    turns : sequence
        Angles in degrees from the crown by which rings are turned, in order, over and over.
    joints : sequence
        Angles of the joints between segments in a ring that is not turned.
    lean : float
        Metres by which these joints lean over the width of a ring (trapezoidal segments), alternating in sign.
    """

    width: float
    first: float
    turns: Sequence[float]
    joints: Sequence[float]
    lean: float = 0.0

    def joint_s(self, length: float) -> list[float]:
        """Chainages of ring joints."""
        return np.arange(self.first, length, self.width).tolist()

    def segment_joints(self, section: Section, ring: int) -> list[float]:
        """Girths of the joints between segments of a ring that lie on the lining."""
        turn = self.turns[ring % len(self.turns)]
        angles = [((a + turn + 180) % 360) - 180 for a in self.joints]
        girths = sorted(section.u_at_angle(a) for a in angles)
        return [u for u in girths if 0.05 < u < section.girth - 0.05]


def paint_rings(
    canvas: Canvas,
    section: Section,
    rings: Rings,
    tone: float = 0.5,
    joint_db: float = -4.5,
    joint_width: float = 0.014,
    lipping: float = 0.002,
    pockets: Sequence[float] = (),
    pocket_size: tuple[float, float] = (0.14, 0.20),
    pocket_db: float = -3.0,
    pocket_depth: float = 0.05,
    grout_holes: bool = True,
) -> None:
    """Tones of segments, joints, pockets of bolts beside ring joints (at ``pockets``, degrees) and grout holes."""
    dirt, rng, cell = Dirt(canvas), canvas.rng, canvas.grid.cell
    edges = [rings.first - rings.width, *rings.joint_s(canvas.grid.length), canvas.grid.length + rings.width]
    for ring, (s0, s1) in enumerate(itertools.pairwise(edges)):
        girths = rings.segment_joints(section, ring)
        bounds = [0.0, *girths, section.girth]
        rows = slice(max(round(s0 / cell), 0), max(round(min(s1, canvas.grid.length) / cell), 0))
        for u0, u1 in itertools.pairwise(bounds):
            columns = slice(round(u0 / cell), round(u1 / cell))
            canvas.dry[rows, columns] += np.float32(rng.normal(0, tone))
            canvas.relief[rows, columns] += np.float32(rng.normal(0, lipping))
            if grout_holes and u1 - u0 > 1.2:
                middle_s, middle_u = (max(s0, 0) + min(s1, canvas.grid.length)) / 2, (u0 + u1) / 2
                hole = box(canvas.grid, middle_s - 0.03, middle_s + 0.03, middle_u - 0.03, middle_u + 0.03, margin=0.06)
                canvas.paint(hole, -2.5, 0.03, None, relief=0.008)
        for number, u in enumerate(girths):
            half = rings.lean / 2 * (1 if number % 2 else -1)
            a, b = max(s0, -0.1), min(s1, canvas.grid.length + 0.1)
            dirt.seam([(a, u - half), (b, u + half)], joint_width, joint_db * float(rng.uniform(0.6, 1.2)), relief=0.006)
        _pockets(canvas, section, (s0, s1), pockets, pocket_size, pocket_db, pocket_depth)
    for s in edges[1:-1]:
        count = 6
        knots = np.linspace(0, section.girth, count + 1)
        for u0, u1 in itertools.pairwise(knots):
            dirt.seam([(s, float(u0)), (s, float(u1))], joint_width, joint_db * float(rng.uniform(0.75, 1.15)), relief=0.007)


def _pockets(
    canvas: Canvas,
    section: Section,
    ring: tuple[float, float],
    angles: Sequence[float],
    size: tuple[float, float],
    tone_db: float,
    depth: float,
) -> None:
    """Pockets of bolts on both sides of a ring."""
    for angle in angles:
        u = section.u_at_angle(angle)
        if not 0.2 < u < section.girth - 0.2:
            continue
        for s in (ring[0] + 0.10, ring[1] - 0.10 - size[0]):
            if 0 < s < canvas.grid.length - size[0]:
                filled = canvas.rng.random() < 0.12
                shape = box(canvas.grid, s, s + size[0], u - size[1] / 2, u + size[1] / 2, margin=0.05)
                canvas.paint(shape, 1.0 if filled else tone_db, 0.02, None, relief=0.0 if filled else depth)


def out_of_round(canvas: Canvas, section: Section, radius: float, squat: float, waves: float = 0.002) -> None:
    """A round tunnel that was squeezed (metres at the side), and shallow unevenness."""
    angle = (canvas.u / radius) - section.crown / radius
    canvas.relief += (-np.float32(squat) * np.cos(2 * angle)).astype(np.float32)
    canvas.relief += canvas.cloud(waves, 2.0, 1.5, 2)
