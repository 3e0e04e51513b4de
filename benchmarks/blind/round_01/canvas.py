"""Layers over the unrolled lining: what the wall reflects, its relief, its water, and the outlines of all that."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label, map_coordinates

from .frames import Array, Tunnel

Layer = NDArray[np.float32]
STEP = 0.01
PIXELS = 512
CYCLES = 6.0
NOTHING = -1.0


class Noise:
    """Random fields without a preferred scale below an outer one, of zero mean and unit deviation."""

    def __init__(self, rng: np.random.Generator) -> None:
        row = np.fft.fftfreq(PIXELS, 1 / PIXELS)[:, None]
        column = np.fft.rfftfreq(PIXELS, 1 / PIXELS)[None, :]
        size = (row**2 + column**2 + CYCLES**2) ** -1.0
        size[0, 0] = 0.0
        phase = rng.normal(size=size.shape) + 1j * rng.normal(size=size.shape)
        tile = np.fft.irfft2(size * phase, s=(PIXELS, PIXELS))
        self.tile = (tile / tile.std()).astype(np.float32)
        self.rng = rng

    def field(self, scale: float, stretch: float = 1.0) -> Callable[[Array, Array], Array]:
        """A field of (u, v) of its own with features of about ``scale`` metres, ``stretch`` times longer along v."""
        shift = self.rng.uniform(0, PIXELS, 2)
        turn = self.rng.uniform(0.25, 0.55)
        per_metre = PIXELS / CYCLES / (2 * scale)

        def at(u: Array, v: Array) -> Array:
            x, y = u * per_metre, v * (per_metre / stretch)
            if stretch == 1.0:
                x, y = x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)
            place = np.stack(np.broadcast_arrays(x + shift[0], y + shift[1]))
            return map_coordinates(self.tile, place, order=1, mode="grid-wrap", output=np.float64)

        return at


class Shape(Protocol):
    """An area on the lining."""

    def bounds(self) -> tuple[float, float, float, float]:
        """Chainages and girths (u0, u1, v0, v1) that hold it, with its surroundings."""

    def field(self, u: Array, v: Array, canvas: Canvas) -> Array:
        """About the distance to its outline, m, positive inside."""


@dataclass(frozen=True)
class Water:
    """How wet an area is.

    Attributes
    ----------
    drop : float
        Loss of reflectance well inside, dB.
    phenomenon : str
        What it is.
    rim : float
        Width over which the loss sets in, m.
    core : float
        What the middle loses more than the rim, as a part of ``drop``.
    film : float
        Share of the surface under a film of water, which mirrors the beam back where it strikes squarely.
    fringe : float
        Rise of a crust of lime or salt around it, dB.
    fringe_width : float
        Width of that crust, m.
    tide, tide_at : float
        Darkness, dB, of the line at which it stood when it was larger, and how far outside that is, m.
    limit : str
        Why an inspector could not tell it on an orthophoto; empty where he could.
    """

    drop: float
    phenomenon: str
    rim: float = 0.05
    core: float = 0.2
    film: float = 0.0
    fringe: float = 0.0
    fringe_width: float = 0.1
    tide: float = 0.0
    tide_at: float = 0.15
    limit: str = ""


@dataclass(frozen=True)
class Mark:
    """Something dark but dry, or bright: the field of its outline and where that lies."""

    kind: str
    field: Layer
    first: tuple[int, int]


def ramp(value: Array) -> Array:
    """From 0 to 1 over values from -0.5 to 0.5, smoothly."""
    part = np.clip(value + 0.5, 0.0, 1.0)
    return part * part * (3 - 2 * part)


def without_specks(field: Array, smallest: float) -> Array:
    """A field without the islands and holes that are smaller than an area, m²."""
    for sign in (1.0, -1.0):
        parts, count = label(sign * field > 0)
        small = np.bincount(parts.ravel(), minlength=count + 1) * STEP**2 < smallest
        small[0] = False
        field = np.where(small[parts], -sign * 0.004, field)
    return field


def distance(field: Array) -> Array:
    """Distance to the line on which a field is zero, m, positive where the field is."""
    inside = field > 0
    if not inside.any() or inside.all():
        return field
    signed: Array = np.where(inside, distance_transform_edt(inside) - 0.5, 0.5 - distance_transform_edt(~inside)) * STEP
    return signed


class Canvas:
    """Layers over chainage and girth, with a spacing of 1 cm.

    Attributes
    ----------
    shade : Layer
        What dry reflectance differs by from the lining's mean, dB.
    relief : Layer
        Depth outside the smooth lining, m.
    wet, film : Layer
        Loss by water, dB, and share of the surface under a film.
    water : Layer
        About the distance to the outline of the nearest leak, positive inside.
    owner : NDArray
        Entry of ``waters`` that is nearest.
    """

    def __init__(self, tunnel: Tunnel, rng: np.random.Generator) -> None:
        self.tunnel = tunnel
        self.rng = rng
        self.noise = Noise(rng)
        half = tunnel.section.half
        self.u = np.arange(0.0, tunnel.axis.length + STEP, STEP)
        self.v = np.arange(-half, half + STEP, STEP)
        shape = (len(self.u), len(self.v))
        self.shade = np.zeros(shape, np.float32)
        self.relief = np.zeros(shape, np.float32)
        self.wet = np.zeros(shape, np.float32)
        self.film = np.zeros(shape, np.float32)
        self.water = np.full(shape, NOTHING, np.float32)
        self.owner = np.zeros(shape, np.int16)
        self.waters: list[Water] = []
        self.marks: list[Mark] = []

    def window(self, bounds: tuple[float, float, float, float]) -> tuple[tuple[slice, slice], Array, Array]:
        """Slices of the layers that hold the bounds, and chainages and girths there."""
        u0, u1, v0, v1 = bounds
        rows = slice(max(0, int(u0 / STEP)), min(len(self.u), int(u1 / STEP) + 2))
        offset = -self.v[0]
        columns = slice(max(0, int((v0 + offset) / STEP)), min(len(self.v), int((v1 + offset) / STEP) + 2))
        u, v = np.meshgrid(self.u[rows], self.v[columns], indexing="ij")
        return (rows, columns), u, v

    def sample(self, layer: Layer, u: Array, v: Array) -> Array:
        """A layer between its nodes."""
        place = np.stack([u / STEP, (v - self.v[0]) / STEP])
        return map_coordinates(layer, place, order=1, mode="nearest", output=np.float64)

    def texture(self, layer: Layer, size: float, scale: float, stretch: float = 1.0) -> None:
        """Add a random field to a layer."""
        at = self.noise.field(scale, stretch)
        for first in range(0, len(self.u), 500):
            rows = slice(first, first + 500)
            layer[rows] += (size * at(self.u[rows, None], self.v[None, :])).astype(np.float32)

    def gradient(self, size: float, profile: Callable[[Array], Array], scale: float) -> None:
        """Shade the lining by a function of the girth, unevenly along the tunnel."""
        at = self.noise.field(scale)
        base = profile(self.v)[None, :]
        for first in range(0, len(self.u), 500):
            rows = slice(first, first + 500)
            uneven = 1 + 0.3 * at(self.u[rows, None], self.v[None, :])
            self.shade[rows] += (size * base * uneven).astype(np.float32)

    def leak(self, shape: Shape, water: Water) -> None:
        """Wet an area; where two areas touch, the wetter one counts."""
        window, u, v = self.window(shape.bounds())
        foot = self.tunnel.section.foot
        field = without_specks(shape.field(u, v, self), 0.015 + water.rim**2)
        signed = distance(field)
        uneven = 1 + 0.1 * self.noise.field(0.25)(u, v) + 0.07 * self.noise.field(0.06)(u, v)
        deep = np.clip(signed / (0.15 + 2 * water.rim), 0.0, 1.0)
        share = ramp(signed / water.rim) * (np.abs(v) < foot)
        loss = water.drop * (1 + water.core * (deep - 0.5)) * np.clip(uneven, 0.6, 1.4) * share
        self.wet[window] = np.maximum(self.wet[window], loss)
        self.film[window] = np.maximum(self.film[window], water.film * share * deep)
        if water.fringe > 0.0:
            self._crust(window, u, v, np.minimum(signed, foot - np.abs(v)), water)
        if water.tide > 0.0:
            self._tide(window, u, v, np.minimum(signed, foot - np.abs(v)), water)
        field = np.minimum(field, foot - np.abs(v))
        nearer = field > self.water[window]
        self.waters.append(water)
        self.owner[window][nearer] = len(self.waters) - 1
        self.water[window][nearer] = field[nearer]

    def _crust(self, window: tuple[slice, slice], u: Array, v: Array, field: Array, water: Water) -> None:
        """Lime or salt just outside a wet area, in places only."""
        patchy = self.noise.field(0.35)(u, v) + 0.5 * self.noise.field(0.05)(u, v)
        width = water.fringe_width * np.clip(0.7 + 0.5 * patchy, 0.0, 1.6)
        outside = -field - water.rim / 2
        band = ramp(outside / 0.02 - 0.5) * ramp((width - outside) / 0.04 - 0.5)
        rise = water.fringe * band * (0.8 + 0.2 * self.noise.field(0.04)(u, v))
        self.shade[window] += rise.astype(np.float32)
        self._mark("salt fringe", np.minimum(outside, width - outside - 0.02), window)

    def _tide(self, window: tuple[slice, slice], u: Array, v: Array, field: Array, water: Water) -> None:
        """A line where a damp area once ended, broken in places; what lies between has dried."""
        away = np.abs(field + water.tide_at + 0.02 * self.noise.field(0.3)(u, v))
        broken = np.clip(0.8 + 0.5 * self.noise.field(0.4)(u, v), 0.0, 1.3)
        self.shade[window] -= (water.tide * ramp((0.02 - away) / 0.02) * broken).astype(np.float32)
        self._mark("tide mark", 0.02 - away, window)

    def stain(self, shape: Shape, shade: float, kind: str, rim: float = 0.03, patchy: float = 0.15, lift: float = 0.0) -> None:
        """Darken (negative) or brighten an area that is dry; ``lift`` sets it off from the lining, outwards, m."""
        window, u, v = self.window(shape.bounds())
        field = np.minimum(shape.field(u, v, self), self.tunnel.section.foot - np.abs(v))
        share = ramp(field / rim)
        uneven = 1 + patchy * self.noise.field(0.2)(u, v)
        self.shade[window] += (shade * share * uneven).astype(np.float32)
        if lift:
            self.relief[window] += (lift * share).astype(np.float32)
        if kind:
            self._mark(kind, field, window)

    def _mark(self, kind: str, field: Array, window: tuple[slice, slice]) -> None:
        """Keep what goes into ``other.geojson``."""
        first = (window[0].start, window[1].start)
        self.marks.append(Mark(kind, field.astype(np.float32), first))

    def carve(self, shape: Shape, depth: float, rim: float) -> None:
        """Hollow an area out, with sloping sides."""
        window, u, v = self.window(shape.bounds())
        share = np.clip(shape.field(u, v, self) / rim, 0.0, 1.0)
        self.relief[window] = np.maximum(self.relief[window], depth * share)
