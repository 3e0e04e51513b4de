"""How water comes through a lining: patches, runs, wet joints and cracks, damp feet of walls."""

from __future__ import annotations

import numpy as np

from .canvas import Canvas
from .texture import Shape, below_curve, chain, ellipse, fractal, union


class Water:
    """Painter of leaks on a canvas. Lengths are in metres, ``drop`` in dB."""

    def __init__(self, canvas: Canvas):
        """``canvas`` is painted in place."""
        self.canvas = canvas
        self.grid = canvas.grid
        self.rng = canvas.rng

    # ------------------------------------------------------------------ parts

    def _tongue(self, s: float, u: float, length: float, width0: float, width1: float, wander: float = 0.025) -> Shape:
        """A run down the lining; narrow or wide at its end as told."""
        down = self.canvas.down(u)
        steps = max(int(length / 0.2), 2)
        drift = np.cumsum(self.rng.normal(0, wander, steps + 1))
        drift -= drift[0]
        points = [(s + float(drift[k]), u + down * length * k / steps) for k in range(steps + 1)]
        widths = [
            max((width0 + (width1 - width0) * k / steps) / 2 * float(self.rng.uniform(0.75, 1.25)), 0.012)
            for k in range(steps + 1)
        ]
        return chain(self.grid, points, widths)

    def _tongues(
        self, points: list[tuple[float, float]], every: float, length: tuple[float, float], width: tuple[float, float]
    ) -> list[Shape]:
        """Runs that start along a line, here and there."""
        knots = np.asarray(points)
        along = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(knots, axis=0).T))])
        shapes: list[Shape] = []
        at = float(self.rng.uniform(0, every))
        while at < along[-1]:
            s, u = float(np.interp(at, along, knots[:, 0])), float(np.interp(at, along, knots[:, 1]))
            reach = float(self.rng.uniform(*length)) * float(self.rng.choice([0.5, 0.8, 1.0]))
            first = float(self.rng.uniform(*width))
            shapes.append(self._tongue(s, u, reach, first, first * float(self.rng.uniform(0.3, 0.9))))
            at += every * float(self.rng.uniform(0.4, 1.6))
        return shapes

    def _soak(
        self, shapes: list[Shape], drop: float, edge: float, torn: float, name: str, halo: float = 0.0, **more: object
    ) -> None:
        """Join, tear and paint; ``halo`` is the width of a damp rim of about half the darkening."""
        shape = union(self.grid, shapes).ragged(self.grid, self.rng, torn, 0.22, 0.5)
        self.canvas.soak(shape, drop, edge, name, **({} if halo else more))
        if halo:
            rim = Shape(shape.window, shape.distance + np.float32(halo)).ragged(self.grid, self.rng, 0.5 * halo, 0.4, 0.5)
            self.canvas.soak(rim, 0.5 * drop, max(0.6 * halo, 0.03), name, **more)

    # ------------------------------------------------------------------ leaks

    def patch(
        self,
        s: float,
        u: float,
        half_s: float,
        half_u: float,
        drop: float,
        edge: float = 0.06,
        torn: float = 0.05,
        **more: object,
    ) -> None:
        """A damp patch round a hole, a pore or a nest of gravel, a little longer below than above."""
        down = self.canvas.down(u)
        shapes = [
            ellipse(self.grid, s, u, half_s, half_u),
            ellipse(
                self.grid, s + float(self.rng.normal(0, 0.15)) * half_s, u + down * half_u * 0.6, half_s * 0.7, half_u * 0.8
            ),
        ]
        self._soak(shapes, drop, edge, torn, more.pop("name", "patch"), **more)

    def run(
        self,
        s: float,
        u: float,
        length: float,
        width0: float,
        width1: float,
        drop: float,
        edge: float = 0.03,
        fan: int = 0,
        torn: float = 0.02,
        **more: object,
    ) -> None:
        """Water that runs down from a point, perhaps spreading into several tongues."""
        shapes = [self._tongue(s, u, length, width0, width1)]
        for _ in range(fan):
            start = float(self.rng.uniform(0.0, 0.35)) * length
            side = float(self.rng.uniform(-1.0, 1.0)) * max(width0, width1)
            reach = length * float(self.rng.uniform(0.4, 1.0)) - start * 0.5
            width = float(self.rng.uniform(0.04, 0.10))
            shapes.append(self._tongue(s + side, u + self.canvas.down(u) * start, reach, width, width * 0.7, wander=0.03))
        self._soak(shapes, drop, edge, torn, more.pop("name", "run"), **more)

    def line(
        self,
        points: list[tuple[float, float]],
        width: float,
        drop: float,
        edge: float = 0.03,
        torn: float = 0.02,
        every: float = 0.0,
        length: tuple[float, float] = (0.2, 0.8),
        tongue: tuple[float, float] = (0.04, 0.12),
        swell: float = 0.4,
        **more: object,
    ) -> None:
        """A wet joint or crack of changing width, with tongues below it about ``every`` metres (0: none)."""
        knots = np.asarray(points, float)
        along = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(knots, axis=0).T))])
        at = np.linspace(0, along[-1], max(int(along[-1] / 0.3), 3) + 1)
        path = [(float(np.interp(a, along, knots[:, 0])), float(np.interp(a, along, knots[:, 1]))) for a in at]
        wave = fractal((len(path), 1), (6, 1), self.rng, 3)[:, 0]
        radii = [max(width / 2 * (1 + swell * float(w)), 0.018) for w in np.clip(wave, -1.6, 2.0)]
        shapes = [chain(self.grid, path, radii)]
        if every:
            shapes += self._tongues(path, every, length, tongue)
        self._soak(shapes, drop, edge, torn, more.pop("name", "wet joint"), **more)

    def ring(
        self,
        s: float,
        u0: float,
        u1: float,
        width_top: float,
        width_foot: float,
        drop: float,
        edge: float = 0.04,
        **more: object,
    ) -> None:
        """A wet ring joint between two girths; it widens downwards, as water gathers."""
        torn = float(more.pop("torn", 0.05))
        count = max(int(abs(u1 - u0) / 0.25), 3)
        u = np.linspace(u0, u1, count + 1)
        wave = np.clip(fractal((count + 1, 1), (5, 1), self.rng, 3)[:, 0], -1.5, 2.0)
        depth = np.abs(u - self.canvas.crown) / max(self.canvas.crown, self.grid.girth - self.canvas.crown)
        radii = (width_top + (width_foot - width_top) * depth**1.5) / 2 * (1 + 0.3 * wave)
        shift = 0.15 * radii * np.clip(fractal((count + 1, 1), (7, 1), self.rng, 2)[:, 0], -1.5, 1.5)
        points = list(zip((s + shift).tolist(), u.tolist(), strict=True))
        shapes = [chain(self.grid, points, np.maximum(radii, 0.02).tolist())]
        for place in self.rng.integers(1, count, max(count // 4, 1)):
            at_s, at_u = points[int(place)]
            aside = float(self.rng.choice([-1.0, 1.0]) * radii[int(place)] * self.rng.uniform(0.5, 1.1))
            shapes.append(self._tongue(at_s + aside, at_u, float(self.rng.uniform(0.25, 0.9)), 0.09, 0.05, wander=0.03))
        self._soak(shapes, drop, edge, torn, more.pop("name", "wet ring joint"), **more)

    def foot(
        self,
        s0: float,
        s1: float,
        foot_u: float,
        height: float,
        drop: float,
        edge: float = 0.12,
        torn: float = 0.05,
        **more: object,
    ) -> None:
        """A damp foot of a wall: rising damp with a wavy upper edge that sinks to both ends."""
        upward = -self.canvas.down(foot_u)
        s = np.arange(s0, s1 + 0.05, 0.08)
        waves = fractal((len(s), 1), (28, 1), self.rng, 4)[:, 0]
        ends = np.clip(np.minimum(s - s0, s1 - s) / min(1.2, (s1 - s0) / 3), 0, 1) ** 0.6
        level = height * (1 + 0.38 * np.clip(waves, -1.7, 2.0)) * ends
        shape = below_curve(self.grid, s, level, foot_u, upward).ragged(self.grid, self.rng, torn, 0.3, 0.35)
        self.canvas.soak(shape, drop, edge, more.pop("name", "damp foot"), **more)

    def crack(
        self,
        start: tuple[float, float],
        stop: tuple[float, float],
        width: float,
        drop: float,
        wander: float = 0.05,
        **more: object,
    ) -> None:
        """A wet crack that wanders from one point to another."""
        count = max(int(np.hypot(stop[0] - start[0], stop[1] - start[1]) / 0.2), 3)
        share = np.linspace(0, 1, count + 1)
        drift = np.cumsum(self.rng.normal(0, wander, (count + 1, 2)), axis=0)
        drift -= drift[0] + (drift[-1] - drift[0]) * share[:, None]
        line = np.asarray(start) + (np.asarray(stop) - np.asarray(start)) * share[:, None] + drift
        more.setdefault("name", "wet crack")
        self.line([tuple(x) for x in line.tolist()], width, drop, **more)
