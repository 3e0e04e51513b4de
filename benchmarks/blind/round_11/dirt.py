"""What is dark or bright in a tunnel though it is dry: dust, soot, repairs, old stains, joints, rust, writing."""

from __future__ import annotations

import itertools

import numpy as np

from .canvas import Canvas
from .texture import Shape, below_curve, box, chain, ellipse, fractal, union

# Rows of five by seven pixels, top first.
GLYPHS = {
    "0": "01110 10001 10011 10101 11001 10001 01110",
    "1": "00100 01100 00100 00100 00100 00100 01110",
    "2": "01110 10001 00001 00110 01000 10000 11111",
    "3": "11111 00010 00100 00010 00001 10001 01110",
    "4": "00010 00110 01010 10010 11111 00010 00010",
    "5": "11111 10000 11110 00001 00001 10001 01110",
    "6": "00110 01000 10000 11110 10001 10001 01110",
    "7": "11111 00001 00010 00100 01000 01000 01000",
    "8": "01110 10001 10001 01110 10001 10001 01110",
    "9": "01110 10001 10001 01111 00001 00010 01100",
    "K": "10001 10010 10100 11000 10100 10010 10001",
    "R": "11110 10001 10001 11110 10100 10010 10001",
    "+": "00000 00100 00100 11111 00100 00100 00000",
    "-": "00000 00000 00000 11111 00000 00000 00000",
}


class Dirt:
    """Painter of dry things on a canvas."""

    def __init__(self, canvas: Canvas):
        """``canvas`` is painted in place."""
        self.canvas = canvas
        self.grid = canvas.grid
        self.rng = canvas.rng

    def writing(self, text: str, s: float, u: float, pixel: float, tone_db: float) -> None:
        """Painted figures, upright, that start at a chainage; ``u`` is their upper edge."""
        down = self.canvas.down(u)
        forward = -down
        shapes: list[Shape] = []
        for place, letter in enumerate(text):
            for row, bits in enumerate(GLYPHS[letter].split()):
                for column, bit in enumerate(bits):
                    if bit == "1":
                        a = s + forward * (place * 6 + column) * pixel
                        b = u + down * row * pixel
                        shapes.append(
                            box(self.grid, *sorted((a, a + forward * pixel)), *sorted((b, b + down * pixel)), margin=0.02)
                        )
        self.canvas.paint(union(self.grid, shapes), tone_db, 0.012, "writing")

    def repair(
        self, s0: float, s1: float, u0: float, u1: float, tone_db: float, kind: str = "repair", rough: float = 0.008
    ) -> None:
        """A trowelled patch of other mortar, nearly rectangular."""
        shape = box(self.grid, s0, s1, min(u0, u1), max(u0, u1)).ragged(self.grid, self.rng, rough, 0.3, 0.3)
        self.canvas.paint(shape, tone_db, 0.02, kind, uneven=0.2, relief=-0.002)

    def old_stain(
        self, s: float, u: float, length: float, width: float, tone_db: float, rim_db: float = 0.8, kind: str = "dry stain"
    ) -> None:
        """A run that dried up: weak, washed out, with a bright rim where salts stayed behind."""
        down = self.canvas.down(u)
        steps = max(int(length / 0.25), 2)
        drift = np.cumsum(self.rng.normal(0, 0.02, steps + 1))
        points = [(s + float(drift[k]), u + down * length * k / steps) for k in range(steps + 1)]
        radii = [width / 2 * (0.6 + 0.7 * k / steps) * float(self.rng.uniform(0.8, 1.2)) for k in range(steps + 1)]
        shape = chain(self.grid, points, radii).ragged(self.grid, self.rng, 0.03, 0.12, 0.6)
        self.canvas.paint(shape, tone_db, 0.10, kind, uneven=0.45)
        rim = Shape(shape.window, 0.018 - np.abs(shape.distance + 0.01))
        self.canvas.paint(rim, rim_db, 0.03, None, uneven=0.8)

    def smudge(self, s: float, u: float, half_s: float, half_u: float, tone_db: float, kind: str, edge: float = 0.4) -> None:
        """A soft cloud of soot, dust or grease."""
        shape = ellipse(self.grid, s, u, half_s, half_u).ragged(self.grid, self.rng, min(half_s, half_u) * 0.25, 0.9, 0.6)
        self.canvas.paint(shape, tone_db, edge, kind, uneven=0.3)

    def rust(self, s: float, u: float, length: float, tone_db: float = -2.0) -> None:
        """A thin brown run under a bolt or bracket."""
        down = self.canvas.down(u)
        half = float(self.rng.uniform(0.012, 0.03))
        lean = float(self.rng.normal(0, 0.015))
        shape = chain(self.grid, [(s, u), (s + lean, u + down * length)], [half, half * 0.4], margin=0.1)
        self.canvas.paint(shape.ragged(self.grid, self.rng, 0.006, 0.05, 0.3), tone_db, 0.02, "rust", uneven=0.4)

    def seam(
        self, points: list[tuple[float, float]], width: float, tone_db: float, relief: float = 0.0, kind: str | None = None
    ) -> None:
        """A joint, crack or line of mortar of constant width."""
        shape = chain(self.grid, points, [width / 2] * len(points), margin=0.06)
        self.canvas.paint(
            shape.ragged(self.grid, self.rng, width * 0.1, 0.2, 0.2), tone_db, 0.012, kind, uneven=0.25, relief=relief
        )

    def crack(self, start: tuple[float, float], stop: tuple[float, float], tone_db: float = -2.5, wander: float = 0.05) -> None:
        """A dry crack, wandering from one point to another."""
        count = max(int(np.hypot(stop[0] - start[0], stop[1] - start[1]) / 0.15), 3)
        share = np.linspace(0, 1, count + 1)
        drift = np.cumsum(self.rng.normal(0, wander, (count + 1, 2)), axis=0)
        drift -= drift[0] + (drift[-1] - drift[0]) * share[:, None]
        points = [
            (start[0] + (stop[0] - start[0]) * t + d[0], start[1] + (stop[1] - start[1]) * t + d[1])
            for t, d in zip(share.tolist(), drift.tolist(), strict=True)
        ]
        self.seam(points, 0.012, tone_db, kind="crack")

    def honeycomb(self, s: float, u: float, half_s: float, half_u: float, tone_db: float = -1.6) -> None:
        """A nest of gravel: rough, pitted, a little dark."""
        shape = ellipse(self.grid, s, u, half_s, half_u).ragged(self.grid, self.rng, 0.06, 0.25, 0.2)
        self.canvas.paint(shape, tone_db, 0.05, "honeycomb", uneven=0.6)
        pits = np.clip(fractal(shape.distance.shape, (4, 4), self.rng, 2), 0, 2) * (shape.distance > 0)
        self.canvas.relief[shape.window] += np.float32(0.004) * pits
        self.canvas.dry[shape.window] -= np.float32(0.9) * pits

    def band(
        self, s0: float, s1: float, u0: float, u1: float, tone_db: float, edge: float, kind: str | None, wave: float = 0.03
    ) -> None:
        """A stripe along the tunnel (washed, splashed, brushed, painted) with a wavy edge."""
        shape = box(self.grid, s0, s1, min(u0, u1), max(u0, u1), margin=0.5).ragged(self.grid, self.rng, wave, 2.0, 0.3)
        self.canvas.paint(shape, tone_db, edge, kind, uneven=0.2)

    def splash(self, s0: float, s1: float, foot_u: float, height: float, tone_db: float, kind: str = "splash band") -> None:
        """Grime thrown up from the track or road: fuzzy upper edge of an even height all along."""
        upward = -self.canvas.down(foot_u)
        s = np.arange(s0, s1 + 0.05, 0.1)
        noise = fractal((len(s), 1), (25, 1), self.rng, 4)[:, 0]
        shape = below_curve(self.grid, s, height * (1 + 0.07 * noise), foot_u, upward)
        self.canvas.paint(shape, tone_db, 0.5 * height, kind, uneven=0.25)

    def panel_tones(self, s_edges: list[float], u_edges: list[float], deviation: float) -> None:
        """Another tone for each panel, segment or block between edges."""
        cell = self.grid.cell
        for s0, s1 in itertools.pairwise(s_edges):
            for u0, u1 in itertools.pairwise(u_edges):
                rows = slice(max(round(s0 / cell), 0), max(round(s1 / cell), 0))
                columns = slice(max(round(u0 / cell), 0), max(round(u1 / cell), 0))
                self.canvas.dry[rows, columns] += np.float32(self.rng.normal(0, deviation))
