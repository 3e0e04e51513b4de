"""Sections of tunnels, about a point from which all of the wall is seen."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .arrays import Floats

_BINS = 16384
_STEP = math.radians(0.25)


def _arc(centre: tuple[float, float], radius: float, start: float, stop: float) -> list[tuple[float, float]]:
    """Points of an arc; angles from the vertical, clockwise."""
    angles = np.linspace(start, stop, max(3, math.ceil(abs(stop - start) / _STEP)))
    return [(centre[0] + radius * math.sin(a), centre[1] + radius * math.cos(a)) for a in angles]


@dataclass(frozen=True)
class Profile:
    """A symmetrical closed section, tabulated over the angle about its centre.

    Attributes
    ----------
    centre : float
        Height of the centre above the middle of the floor.
    foot : float
        Length along the section from crown to foot of the wall.
    half : float
        Length along the section from crown to the middle of the floor.
    radius, arc : ndarray
        Distance from the centre, and length from the crown (right: positive), over the angle.
    normal, tangent : ndarray
        Inward normal and direction of growing length (2 × n).
    """

    centre: float
    foot: float
    half: float
    radius: Floats
    arc: Floats
    normal: Floats
    tangent: Floats

    @staticmethod
    def build(outline: list[tuple[float, float]], foot: tuple[float, float], centre: float) -> Profile:
        """From the right half of the outline, crown to middle of the floor."""
        points = np.array([p for i, p in enumerate(outline) if i == 0 or math.dist(p, outline[i - 1]) > 1e-6])
        lengths = np.hypot(*np.diff(points, axis=0).T)
        along = np.concatenate([[0.0], np.cumsum(lengths)])
        at_foot = float(along[np.argmin(np.hypot(*(points - np.array(foot)).T))])
        angle = np.arctan2(points[:, 0], points[:, 1] - centre)
        angle[0], angle[-1] = 0.0, math.pi
        phi = np.linspace(-math.pi, math.pi, _BINS + 1)
        edge = np.clip(np.searchsorted(angle, np.abs(phi), side="right") - 1, 0, len(points) - 2)
        start, step = points[edge] - np.array([0.0, centre]), np.diff(points, axis=0)[edge]
        ray = np.stack([np.sin(np.abs(phi)), np.cos(np.abs(phi))], axis=1)
        cross = ray[:, 0] * step[:, 1] - ray[:, 1] * step[:, 0]
        share = np.clip((start[:, 0] * ray[:, 1] - start[:, 1] * ray[:, 0]) / cross, 0.0, 1.0)
        radius = np.hypot(*(start + share[:, None] * step).T)
        sign = np.where(phi < 0, -1.0, 1.0)
        unit = step / np.hypot(step[:, 0], step[:, 1])[:, None]
        tangent = np.stack([unit[:, 0], sign * unit[:, 1]])
        normal = np.stack([sign * unit[:, 1], -unit[:, 0]])
        return Profile(
            centre=centre,
            foot=at_foot,
            half=float(along[-1]),
            radius=radius,
            arc=sign * (along[edge] + share * lengths[edge]),
            normal=normal,
            tangent=tangent,
        )

    def _look_up(self, table: Floats, phi: Floats) -> Floats:
        at = (phi + math.pi) * (_BINS / (2.0 * math.pi))
        low = np.clip(at.astype(np.int64), 0, _BINS - 1)
        first = table[low]
        return first + (at - low) * (table[low + 1] - first)

    def radius_at(self, phi: Floats) -> Floats:
        """Distance of the section from its centre."""
        return self._look_up(self.radius, phi)

    def arc_at(self, phi: Floats) -> Floats:
        """Length along the section from the crown."""
        return self._look_up(self.arc, phi)

    def frame_at(self, phi: Floats) -> tuple[Floats, Floats]:
        """Inward normal and tangent (each 2 × n)."""
        at = np.clip(((phi + math.pi) * (_BINS / (2.0 * math.pi))).astype(np.int64), 0, _BINS)
        return self.normal[:, at], self.tangent[:, at]

    def phi_at(self, arc: Floats) -> Floats:
        """Angle about the centre, of a length along the section."""
        return np.interp(arc, self.arc, np.linspace(-math.pi, math.pi, _BINS + 1))

    def point(self, arc: float, inward: float = 0.0) -> tuple[float, float, float]:
        """Place before the wall, and the angle of the outward normal (from the vertical, clockwise)."""
        phi = self.phi_at(np.array([arc]))
        normal, _ = self.frame_at(phi)
        radius = float(self.radius_at(phi)[0])
        u = radius * math.sin(float(phi[0])) + inward * float(normal[0, 0])
        v = self.centre + radius * math.cos(float(phi[0])) + inward * float(normal[1, 0])
        return u, v, math.atan2(-float(normal[0, 0]), -float(normal[1, 0]))

    def arc_of_height(self, height: float) -> float:
        """Length from the crown down to where the wall is so high above the floor."""
        phi = np.linspace(0.0, math.pi, 4001)
        above = self.centre + self.radius_at(phi) * np.cos(phi)
        lengths = self.arc_at(phi)
        wall = lengths <= self.foot
        return float(np.interp(-height, -above[wall], lengths[wall]))

    def ranges_from(self, u: float, v: float) -> tuple[Floats, Floats]:
        """Range to the section, and angle about its centre, over the direction as seen from a place in it."""
        phi = np.linspace(-math.pi, math.pi, _BINS + 1)
        du = self.radius * np.sin(phi) - u
        dv = self.centre + self.radius * np.cos(phi) - v
        seen = np.unwrap(np.arctan2(du, dv))
        seen = np.maximum.accumulate(seen)
        grid = np.linspace(-math.pi, math.pi, _BINS + 1)
        turned = seen[0] + np.mod(grid - seen[0], 2.0 * math.pi)
        hit = np.interp(turned, seen, phi)
        radius = self.radius_at(hit)
        return np.hypot(radius * np.sin(hit) - u, self.centre + radius * np.cos(hit) - v), hit

    def look_up_turn(self, table: Floats, angle: Floats) -> Floats:
        """Value of a table over the full turn, nearest bin."""
        at = np.rint((angle + math.pi) * (_BINS / (2.0 * math.pi))).astype(np.int64)
        return table[np.clip(at, 0, _BINS)]


def _floor(foot: tuple[float, float], kerb: tuple[float, float] | None) -> list[tuple[float, float]]:
    """From the foot of the wall to the middle of the floor, over a walkway (width, height) if there is one."""
    if kerb is None:
        return [foot, (0.0, 0.0)]
    return [foot, (foot[0] - kerb[0], kerb[1]), (foot[0] - kerb[0] - 0.02, 0.0), (0.0, 0.0)]


def three_centred(crown: float, opening: float, side: float, height: float, kerb: tuple[float, float] | None = None) -> Profile:
    """Vault of a crown arc (half of its opening in degrees) and two side arcs, down to the walkway or the floor."""
    turn, base = math.radians(opening), 0.0 if kerb is None else kerb[1]
    centre = (0.0, height - crown)
    beside = ((crown - side) * math.sin(turn), centre[1] + (crown - side) * math.cos(turn))
    last = math.pi - math.acos((beside[1] - base) / side)
    outline = _arc(centre, crown, 0.0, turn) + _arc(beside, side, turn, last)
    foot = outline[-1]
    return Profile.build(outline + _floor(foot, kerb), foot, 0.4 * height)


def horseshoe(radius: float, springing: float, batter: float = 0.0, kerb: tuple[float, float] | None = None) -> Profile:
    """Half circle on walls which lean inwards by ``batter`` (horizontal over vertical) towards the floor."""
    base = 0.0 if kerb is None else kerb[1]
    foot = (radius - batter * (springing - base), base)
    outline = [*_arc((0.0, springing), radius, 0.0, math.pi / 2), foot]
    return Profile.build(outline + _floor(foot, kerb), foot, 0.45 * (springing + radius))


def box(half_width: float, height: float, haunch: float, kerb: tuple[float, float] | None = None) -> Profile:
    """Frame with haunches at 45 degrees below its roof."""
    base = 0.0 if kerb is None else kerb[1]
    foot = (half_width, base)
    outline = [(0.0, height), (half_width - haunch, height), (half_width, height - haunch), foot]
    return Profile.build(outline + _floor(foot, kerb), foot, 0.45 * height)


def circle(radius: float, floor_half_angle: float) -> Profile:
    """Full circle; within that angle (degrees) of the lowest point it counts as floor."""
    outline = _arc((0.0, radius), radius, 0.0, math.pi)
    turn = math.pi - math.radians(floor_half_angle)
    return Profile.build(outline, (radius * math.sin(turn), radius * (1.0 + math.cos(turn))), radius)
