"""A tunnel that is being put together: lining, things before it, leaks, stains."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from shapely.geometry import box as rectangle
from shapely.geometry.base import BaseGeometry

from .canvas import Canvas, rim
from .geometry import Array, Axis, Section
from .objects import Thing
from .shapes import warp


@dataclass(frozen=True)
class Leak:
    """What is wet.

    Attributes
    ----------
    shape : shapely geometry
        Outline in (chainage, arc), where half of the drop is reached.
    drop : float
        In dB, of its inside.
    phenomenon : str
        A short word.
    limit : str
        Why an inspector could not tell it, if so.
    """

    shape: BaseGeometry
    drop: float
    phenomenon: str
    limit: str = ""


@dataclass
class Tunnel:
    """Lining and fittings, with the truth about them."""

    axis: Axis
    section: Section
    canvas: Canvas
    rng: np.random.Generator
    things: list[Thing] = field(default_factory=list)
    leaks: list[Leak] = field(default_factory=list)
    others: list[tuple[BaseGeometry, str]] = field(default_factory=list)
    roughness: bool = False

    @classmethod
    def new(cls, seed: int, axis: Axis, section: Section, base_db: float, cell: float = 0.01) -> Tunnel:
        """A bare tunnel with evenly reflecting lining."""
        rng = np.random.default_rng(seed)
        return cls(axis, section, Canvas(section, axis.length, cell, base_db, rng), rng)

    @property
    def lining(self) -> BaseGeometry:
        """Where lining is, without the floor, in (chainage, arc)."""
        foot = self.section.foot - 0.01
        return rectangle(0.02, -foot, self.axis.length - 0.02, foot)

    def leak(
        self,
        shape: BaseGeometry,
        drop: float,
        phenomenon: str,
        *,
        soft: float = 0.025,
        uneven: float = 0.16,
        fade: float = 0.0,
        film: float = 0.0,
        salt: float = 0.0,
        limit: str = "",
    ) -> None:
        """Wet the lining.

        Parameters
        ----------
        shape : shapely geometry
            Outline in (chainage, arc).
        drop : float
            In dB.
        phenomenon : str
            A short word.
        soft : float
            Standard width of its rim in m; a fifth of the drop fades three times as widely.
        uneven : float
            Deviation of the drop inside, as a share.
        fade : float
            By which share the drop falls from the top to the bottom.
        film : float
            Share of the inside on which water stands as a film.
        salt : float
            Brightness of a fringe of lime about it, in dB.
        limit : str
            Why an inspector could not tell it.
        """
        shape = warp(self.rng, shape).intersection(self.lining)
        canvas = self.canvas
        window, signed = canvas.distance(shape, 9 * soft + 0.2)
        inner = 1 + uneven * canvas.noise(0.18, 0.3, window).clip(-2, 2)
        if fade:
            depth = np.abs(canvas.s[window[0]])
            inner = inner * (1 - fade * ((depth - depth.min()) / max(float(np.ptp(depth)), 0.1)))[:, None].astype(np.float32)
        level = 0.78 * rim(signed, soft) + 0.22 * rim(signed, 3 * soft)
        canvas.drop[window] = np.maximum(canvas.drop[window], drop * level * inner)
        canvas.film[window] = np.maximum(canvas.film[window], film * np.clip(2 * level - 1, 0, 1))
        if salt:
            width = 0.045
            fringe = np.exp(-(((signed + 1.3 * width) / width) ** 2)) * np.clip(
                0.8 + 0.5 * canvas.noise(0.12, 0.12, window), 0, 2
            )
            canvas.dry[window] += (salt * fringe).astype(np.float32)
            edge = shape.buffer(2.4 * width).difference(shape.buffer(0.01)).intersection(self.lining)
            self.others.append((edge, "efflorescence"))
        self.leaks.append(Leak(shape, drop, phenomenon, limit))

    def mark(self, shape: BaseGeometry, amount: float, kind: str, soft: float = 0.02, grain: float = 0.2) -> None:
        """Stain the lining with something that is dry, and note it as such."""
        shape = shape.intersection(self.lining)
        if shape.is_empty:
            return
        self.canvas.stain(shape, amount, soft, grain)
        self.others.append((shape, kind))

    def mottle(self, *layers: tuple[float, float, float]) -> None:
        """Add textures, each with deviation in dB, length along the tunnel and length around it in m."""
        for deviation, along, around in layers:
            self.canvas.dry += deviation * self.canvas.noise(along, around)

    def floor(self, db: float, deviation: float = 0.8) -> None:
        """Give the floor its own reflectance."""
        for rows in (self.canvas.rows(-9e9, -self.section.foot), self.canvas.rows(self.section.foot, 9e9)):
            window = (rows, slice(0, len(self.canvas.c)))
            self.canvas.dry[rows] = db + deviation * self.canvas.noise(0.25, 0.12, window)

    def dust(self, amount: float, height: float, kind: str | None = None, ragged: float = 0.15) -> None:
        """Darken (or brighten) the foot of both walls up to a height above the floor, fading upwards."""
        canvas = self.canvas
        for side in (-1, 1):
            top = self.section.height_at(self.section.floor + height, side)
            inner = canvas.rows(
                min(top - side * 0.6, side * self.section.foot), max(top - side * 0.6, side * self.section.foot)
            )
            window = (inner, slice(0, len(canvas.c)))
            depth = (side * (canvas.s[inner] - top))[:, None] + ragged * canvas.noise(0.8, 0.8, window)
            canvas.dry[inner] += (amount * np.clip(0.5 + depth / 0.5, 0, 1)).astype(np.float32)
            if kind:
                low, high = sorted((top, side * (self.section.foot - 0.01)))
                self.others.append((rectangle(0.02, low, self.axis.length - 0.02, high), kind))

    def on_wall(self, s: float, stand: float) -> tuple[float, float, tuple[float, float]]:
        """Offset and height of a point before the lining, and the direction along the lining there."""
        u, w = self.section.at(s)
        nu, nw = self.section.inward(s)
        return float(u + nu * stand), float(w + nw * stand), (float(-nw), float(nu))

    def surface(self, c: Array, s: Array) -> Array:
        """Points of the lining in the frame of chainage 0, with their relief."""
        u, w = self.section.at(s)
        nu, nw = self.section.inward(s)
        relief = self.canvas.sample(self.canvas.relief, c, s) if self.roughness else np.zeros_like(c)
        return self.axis.to_frame(c, u + nu * relief, w + nw * relief)
