"""Scenes of plates and pipes, seen by rays: truth by closed formulas of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Plate:
    """Rectangle: a corner and two sides, m."""

    corner: tuple[float, float, float]
    first: tuple[float, float, float]
    second: tuple[float, float, float]

    def hit(self, origin: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        a, b = np.array(self.first), np.array(self.second)
        normal = np.cross(a, b) / np.linalg.norm(np.cross(a, b))
        with np.errstate(divide="ignore", invalid="ignore"):
            t = ((np.array(self.corner) - origin) @ normal) / (rays @ normal)
            at = origin + rays * t[:, None] - np.array(self.corner)
            inside = (at @ a >= 0) & (at @ a <= a @ a) & (at @ b >= 0) & (at @ b <= b @ b) & (t > 0)
        return np.where(inside, t, np.inf), np.abs(rays @ normal)


@dataclass(frozen=True)
class Pipe:
    """Cylinder: its two ends on the axis and its radius, m."""

    begin: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float

    def hit(self, origin: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        begin = np.array(self.begin)
        axis = np.array(self.end) - begin
        length = np.linalg.norm(axis)
        axis = axis / length
        d = rays - np.outer(rays @ axis, axis)
        q = origin - begin
        q = q - (q @ axis) * axis
        a, b, c = (d * d).sum(1), d @ q, q @ q - self.radius**2
        root = b * b - a * c
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (-b - np.sqrt(root)) / a
            at = origin + rays * t[:, None] - begin
            along = at @ axis
            inside = (root > 0) & (t > 0) & (along >= 0) & (along <= length)
            normal = (at - np.outer(along, axis)) / self.radius
            cosine = np.abs((normal * rays).sum(1))
        return np.where(inside, t, np.inf), np.where(inside, cosine, 0.0)


@dataclass(frozen=True)
class Seen:
    """Points with truth: which surface each is on, its range and cosine of incidence."""

    xyz: np.ndarray
    surface: np.ndarray
    scan: np.ndarray
    range_m: np.ndarray
    cosine: np.ndarray


def scan(surfaces, stations, step=0.0012, noise=0.0015, seed=1, window=None) -> Seen:
    """Rays every ``step`` radians over a window (azimuth from, to, elevation from, to; radians) from each station."""
    rng = np.random.default_rng(seed)
    parts = []
    for number, station in enumerate(np.asarray(stations, float)):
        low, high, down, up = window or (-np.pi, np.pi, -1.2, 1.4)
        azimuth, elevation = np.meshgrid(np.arange(low, high, step), np.arange(down, up, step))
        azimuth, elevation = azimuth.ravel(), elevation.ravel()
        azimuth = azimuth + rng.uniform(-0.1, 0.1, len(azimuth)) * step
        rays = np.column_stack([np.cos(elevation) * np.sin(azimuth), np.cos(elevation) * np.cos(azimuth), np.sin(elevation)])
        t = np.full(len(rays), np.inf)
        on, cosine = np.full(len(rays), -1), np.zeros(len(rays))
        for k, surface in enumerate(surfaces):
            here, seen = surface.hit(station, rays)
            nearer = here < t
            t[nearer], on[nearer], cosine[nearer] = here[nearer], k, seen[nearer]
        hit = np.isfinite(t)
        t, rays, on, cosine = t[hit], rays[hit], on[hit], cosine[hit]
        far = t + rng.normal(0, noise, len(t))
        parts.append((station + rays * far[:, None], on, np.full(len(t), number), t, cosine))
    return Seen(*(np.concatenate(part) for part in zip(*parts, strict=True)))
