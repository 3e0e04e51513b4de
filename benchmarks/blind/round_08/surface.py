"""Lining, unrolled: reflectance, gloss and relief as rasters over chainage and girth, and what darkens or brightens them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse

from benchmarks.blind.round_08.tunnel import Section

Raster = NDArray[np.float32]
Mask = NDArray[np.bool_]


@dataclass
class Wet:
    """A wet place as it was made.

    Attributes
    ----------
    phenomenon : str
        What it is.
    mask : array of bool
        Where an inspector would see it, fittings left aside.
    limit : str, optional
        Why he could not tell it.
    """

    phenomenon: str
    mask: Mask
    limit: str | None = None


def smoothstep(x: Raster) -> Raster:
    """From 0 to 1, with level ends."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def _spline(count: int, size: float, step: float, rng: np.random.Generator) -> sparse.csr_matrix:
    """Weights of knots ``size`` apart, at a random phase, for ``count`` cells ``step`` apart (cubic B-spline)."""
    x = np.arange(count) * step / size + rng.uniform(0.0, 1.0)
    knot = np.floor(x).astype(int)
    t = x - knot
    weights = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], axis=1) / 6.0
    rows = np.repeat(np.arange(count), 4)
    columns = (knot[:, None] + np.arange(4)).ravel()
    return sparse.csr_matrix((weights.ravel(), (rows, columns)), shape=(count, int(knot.max()) + 4))


class Surface:
    """Rasters of a lining and its floor.

    Parameters
    ----------
    section : Section
        Cross-section.
    length : float
        Length of tunnel, in metres.
    seed : int
        Of the generator of random numbers.
    step : float
        Size of a cell, in metres.
    """

    def __init__(self, section: Section, length: float, seed: int, step: float = 0.015) -> None:
        self.section, self.length, self.step = section, length, step
        self.rng = np.random.default_rng(seed)
        self.shape = (int(np.ceil(length / step)), int(np.ceil(section.girth / step)))
        self.s = ((np.arange(self.shape[0]) + 0.5) * step).astype(np.float32)[:, None]
        self.u = ((np.arange(self.shape[1]) + 0.5) * step).astype(np.float32)[None, :]
        self.height = section.at(self.u[0])[1].astype(np.float32)[None, :]
        self.db = np.zeros(self.shape, np.float32)
        self.gloss = np.zeros(self.shape, np.float32)
        self.film = np.zeros(self.shape, np.float32)
        self.relief = np.zeros(self.shape, np.float32)
        self.wets: list[Wet] = []
        self.others: list[tuple[str, Mask]] = []
        self.lining = np.broadcast_to(self.u < section.lined, self.shape)
        self.fine = self.noise(0.09, octaves=3)
        self.coarse = self.noise(0.5, octaves=3)
        self.trickle = self.noise(0.06, 0.9, octaves=2)

    def noise(self, along: float, around: float | None = None, octaves: int = 3) -> Raster:
        """Random field of unit variance; its largest features are ``along`` by ``around`` metres."""
        total = np.zeros(self.shape, np.float32)
        for octave in range(octaves):
            scale = 0.5**octave
            a = _spline(self.shape[0], max(along * scale, self.step), self.step, self.rng)
            b = _spline(self.shape[1], max((around or along) * scale, self.step), self.step, self.rng)
            knots = self.rng.standard_normal((a.shape[1], b.shape[1]))
            total += (scale * (b @ (a @ knots).T).T).astype(np.float32)
        return (total - total.mean()) / total.std()

    def wave(self, size: float) -> Raster:
        """Random line over chainage, of unit variance, as a column."""
        weights = _spline(self.shape[0], size, self.step, self.rng)
        line = weights @ self.rng.standard_normal(weights.shape[1])
        return (line / line.std()).astype(np.float32)[:, None]

    def index(self, s: NDArray[np.float64], u: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Cells in which points lie."""
        i = np.clip((s / self.step).astype(np.intp), 0, self.shape[0] - 1)
        j = np.clip((u / self.step).astype(np.intp), 0, self.shape[1] - 1)
        return i, j

    # Shapes: by how many metres a cell lies inside of them, negative outside.

    def blob(self, s: float, u: float, half_s: float, half_u: float) -> Raster:
        """An ellipse."""
        return (1.0 - np.hypot((self.s - s) / half_s, (self.u - u) / half_u)) * np.float32(min(half_s, half_u))

    def panel(self, s0: float, s1: float, u0: float, u1: float) -> Raster:
        """A rectangle."""
        return np.minimum(np.minimum(self.s - s0, s1 - self.s), np.minimum(self.u - u0, u1 - self.u))

    def run(self, s: float, u: float, fall: float, top: float, bottom: float, wander: float = 0.05) -> Raster:
        """What runs down the wall from a place: half-widths at its top and at its bottom, ``fall`` metres farther down."""
        sign = 1.0 if u > self.section.crown else -1.0
        x = (self.u - u) * np.float32(sign)
        knots = np.linspace(-0.5, fall + 0.5, max(4, int(fall / 0.35)))
        centre = s + np.interp(x, knots, wander * np.cumsum(self.rng.normal(0.0, 0.5, knots.size))).astype(np.float32)
        half = np.interp(x, [0.0, fall], [top, bottom]).astype(np.float32)
        # Rounded at its top, running out in fingers at its bottom.
        head, tail = np.clip(-x / top, 0.0, 1.0), np.clip((x - 0.7 * fall) / (0.3 * fall), 0.0, 1.0)
        half = half * np.sqrt(1.0 - head**2) * np.sqrt(1.0 - tail**2)
        fingers = half * (0.16 + 0.3 * tail) * np.clip(self.trickle, -2.0, 2.0)
        return np.where((x > -top) & (x < fall), half + fingers - np.abs(self.s - centre), -1.0).astype(np.float32)

    def seam(self, line: Sequence[tuple[float, float]], half: float, vary: float = 0.4) -> Raster:
        """Along a joint or a crack given by its corners, of varying half-width."""
        distance = np.full(self.shape, np.float32(1e3))
        for (s0, u0), (s1, u1) in pairwise(line):
            ds, du = s1 - s0, u1 - u0
            t = np.clip(((self.s - s0) * ds + (self.u - u0) * du) / (ds * ds + du * du), 0.0, 1.0)
            np.minimum(distance, np.hypot(self.s - s0 - t * ds, self.u - u0 - t * du), out=distance)
        return half * (1.0 + vary * np.clip(self.coarse, -1.5, 2.0)) - distance

    def crack(self, start: tuple[float, float], end: tuple[float, float], jag: float = 0.06) -> list[tuple[float, float]]:
        """Corners of a crack between two points."""
        count = max(3, int(np.hypot(end[0] - start[0], end[1] - start[1]) / 0.25))
        t = np.linspace(0.0, 1.0, count)
        off = self.rng.normal(0.0, jag, (2, count))
        off[:, [0, -1]] = 0.0
        return list(zip(start[0] + t * (end[0] - start[0]) + off[0], start[1] + t * (end[1] - start[1]) + off[1], strict=True))

    # What is on the lining.

    def wet(
        self,
        phenomenon: str,
        inside: Raster,
        drop: float,
        soft: float = 0.05,
        ragged: float = 0.02,
        mottle: float = 0.3,
        film: float = 0.0,
        salt: float = 0.0,
        limit: str | None = None,
    ) -> None:
        """Make a place wet.

        Parameters
        ----------
        phenomenon : str
            What it is.
        inside : array
            Its shape.
        drop : float
            By how much it is darker in its middle, in dB.
        soft : float
            Width of its rim, in metres; its outline is where the rim is half as dark as its middle.
        ragged : float
            By how much its outline wanders, in metres.
        mottle : float
            How unlike its parts are, relative to the drop.
        film : float
            Gloss of the film of water on it.
        salt : float
            By how much the dried rim outside is brighter, in dB.
        limit : str, optional
            Why an inspector could not tell it.
        """
        whole = np.zeros(self.shape, bool)
        cut = tuple(
            slice(int(where[0]), int(where[-1]) + 1) for where in (np.flatnonzero((inside > -0.5).any(axis=k)) for k in (1, 0))
        )
        fine, coarse, trickle = self.fine[cut], self.coarse[cut], self.trickle[cut]
        inside = inside[cut] + ragged * (0.6 * fine + 0.8 * coarse + 0.3 * trickle)
        inside = np.where(self.lining[cut], inside, -1.0).astype(np.float32)
        wetness = smoothstep(inside / soft + 0.5)
        self.db[cut] -= drop * wetness * np.clip(1.0 + mottle * (0.7 * coarse + 0.4 * fine + 0.6 * trickle), 0.25, 1.8)
        self.film[cut] = np.maximum(self.film[cut], film * wetness)
        if salt:
            fringe = smoothstep((inside + 0.14) / 0.08) * (1.0 - smoothstep((inside + 0.02) / 0.04))
            self.db[cut] += salt * fringe * smoothstep(coarse * 0.7 + 0.5 * fine + 0.6)
            bright = whole.copy()
            bright[cut] = self.lining[cut] & (fringe > 0.5) & (coarse > -0.3)
            self.others.append(("salt", bright))
        whole[cut] = inside > 0.0
        self.wets.append(Wet(phenomenon, whole, limit))

    def stain(
        self, kind: str | None, inside: Raster, change: float, soft: float = 0.03, ragged: float = 0.0, mottle: float = 0.15
    ) -> None:
        """Make a dry place darker or brighter by ``change`` dB; with a kind it is told among what is not a leak."""
        inside = (inside + ragged * (0.6 * self.fine + 0.8 * self.coarse)).astype(np.float32)
        self.db += change * smoothstep(inside / soft + 0.5) * np.clip(1.0 + mottle * self.coarse, 0.2, 1.8)
        if kind is not None:
            self.others.append((kind, self.lining & (inside > 0.0)))

    def blur(self, sigma: float) -> None:
        """Let the beam's footprint smear the reflectance."""
        self.db = ndimage.gaussian_filter(self.db, sigma / self.step)
