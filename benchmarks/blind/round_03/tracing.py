"""Where rays meet the lining."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .alignment import Alignment
from .arrays import Floats, Ints
from .canvas import Canvas
from .equipment import Beams, Fixture
from .instrument import Instrument
from .linings import relief_slopes
from .profile import Profile

_SECANTS = 5


@dataclass(frozen=True)
class Tunnel:
    """Alignment, section, lining and equipment."""

    alignment: Alignment
    canvas: Canvas
    fixtures: tuple[Fixture, ...]

    @property
    def profile(self) -> Profile:
        """Its section."""
        return self.canvas.profile

    def on_lining(self, s: Floats, a: Floats) -> tuple[Floats, Floats]:
        """Offset and height of places on the lining, relief included."""
        phi = self.profile.phi_at(a)
        radius = self.profile.radius_at(phi) + self.canvas.sample(self.canvas.relief, s, a)
        return radius * np.sin(phi), self.profile.centre + radius * np.cos(phi)


@dataclass(frozen=True)
class Rays:
    """Rays in the site frame, and a guess of their range.

    Attributes
    ----------
    origin, direction : ndarray
        n × 3.
    guess : ndarray
        Range to the plain section.
    slant : ndarray
        Cosine of the incidence there.
    slack : float
        How far the lining may lie beside the plain section of the guess, m.
    time, share : ndarray
        Seconds, and share of the scan.
    source, facet : ndarray
        Number of the station, of the facet.
    """

    origin: Floats
    direction: Floats
    guess: Floats
    slant: Floats
    slack: float
    time: Floats
    share: Floats
    source: Ints
    facet: Ints


class Tracer:
    """Finds the first meeting of rays and lining; keeps the slopes of the relief."""

    def __init__(self, tunnel: Tunnel, instrument: Instrument) -> None:
        self.tunnel = tunnel
        self.instrument = instrument
        self.slopes = relief_slopes(tunnel.canvas)
        self.depth = float(np.abs(tunnel.canvas.relief).max())
        self.rough = float(tunnel.canvas.relief.std()) > 0.015

    def _excess(self, rays: Rays, t: Floats) -> Floats:
        """How far a point of the ray lies outside of the lining."""
        tunnel = self.tunnel
        s, u, v = tunnel.alignment.to_local(rays.origin + t[:, None] * rays.direction)
        v = v - tunnel.profile.centre
        phi = np.arctan2(u, v)
        relief = tunnel.canvas.sample(tunnel.canvas.relief, s, tunnel.profile.arc_at(phi))
        return np.hypot(u, v) - tunnel.profile.radius_at(phi) - relief

    def ranges(self, rays: Rays) -> Floats:
        """Range of the first meeting, NaN where there is none within reach."""
        bend = 0.5 * abs(self.tunnel.alignment.curvature) * rays.guess**2
        room = (self.depth + rays.slack + bend + 0.01) / np.maximum(rays.slant, 0.12)
        low, high = np.maximum(rays.guess - room, 0.3), rays.guess + room
        below = self._excess(rays, low)
        above = self._excess(rays, high)
        if self.rough:
            done = np.zeros(low.size, dtype=bool)
            first, last = low, high
            for part in np.linspace(0.0, 1.0, 10)[1:-1]:
                probe = first + part * (last - first)
                value = self._excess(rays, probe)
                closing = ~done & (value > 0)
                opening = ~done & (value <= 0)
                high, above = np.where(closing, probe, high), np.where(closing, value, above)
                low, below = np.where(opening, probe, low), np.where(opening, value, below)
                done |= closing
        valid = (below < 0) & (above > 0)
        for _ in range(_SECANTS):
            t = np.where(valid, low - below * (high - low) / np.where(valid, above - below, 1.0), low)
            value = self._excess(rays, t)
            inside = value < 0
            # Illinois: the end that stays counts half
            below, above = np.where(inside, value, 0.5 * below), np.where(inside, 0.5 * above, value)
            low, high = np.where(inside, t, low), np.where(inside, high, t)
        t = np.where(np.abs(below) < np.abs(above), low, high)
        return np.where(valid & (np.abs(value) < 0.01), t, np.nan)

    def beams(self, rays: Rays, t: Floats) -> Beams:
        """Local lines about the meetings."""
        tunnel = self.tunnel
        s, u, v = tunnel.alignment.to_local(rays.origin + t[:, None] * rays.direction)
        ds, du, dv = tunnel.alignment.direction_to_local(rays.direction, s)
        phi = np.arctan2(u, v - tunnel.profile.centre)
        arc = tunnel.profile.arc_at(phi)
        normal, tangent = tunnel.profile.frame_at(phi)
        slope_s, slope_a = (tunnel.canvas.sample(slope, s, arc) for slope in self.slopes)
        d_arc = du * tangent[0] + dv * tangent[1]
        toward = -(du * normal[0] + dv * normal[1]) - slope_s * ds - slope_a * d_arc
        cosine = toward / np.sqrt(1.0 + slope_s**2 + slope_a**2)
        return Beams(s, u, v, ds, du, dv, t, arc, d_arc, cosine, self.instrument.half_beam(t))
