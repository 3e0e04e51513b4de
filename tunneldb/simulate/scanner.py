"""Positions of a scanner and its rays, block by block.

A block is a few hundred thousand rays that are made and written together, so that memory is bounded. Every block has its own
random numbers, by its index, so that the result does not depend on the thread or the time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float, Int64, UInt16
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.tunnel import Tunnel

RAYS = 400_000  # per block
START_TIME = 300_000.0  # GPS seconds of the week
STATION_TIME = 300.0  # between the starts of two stations, s
TRAJECTORY_STEP = 0.1  # s
# Greatest zenith angle, degrees: the tripod hides directions below.
MAX_ZENITH = 150.0


class Rays(NamedTuple):
    """Rays relative to the line's origin: origins and unit directions (n, 3), chainage of the scanner, time (s), scan id.

    ``line`` is the number of the scan line: the turn of a profiler's mirror, the column of a station; 0 for even points.
    """

    origin: Float
    direction: Float
    hint: Float
    time: Float
    scan_id: UInt16
    line: Int64


@dataclass(frozen=True)
class BlockPlan:
    """Block before it is made: index, chainage (for the file), and range ``first`` to ``last``.

    For static stations these are azimuth indices of station ``station``; for a profiler, indices of shots; for uniform
    sampling, ``first`` and ``last`` are unused and the chainages are given.
    """

    index: int
    chainage: float
    station: int
    first: int
    last: int
    chainage_to: float


class Scanner:
    """Static scanner on stations, or profiler on a trolley, in a tunnel."""

    def __init__(self, parameters: Parameters, tunnel: Tunnel) -> None:
        self.parameters = parameters
        self.tunnel = tunnel
        line, p = tunnel.line, parameters
        self.height = tunnel.section.floor + p.scanner_height
        count = max(1, math.ceil((line.end - line.start) / p.station_spacing - 1e-9))
        gap = (line.end - line.start) / count
        self.station_chainage: Float = line.start + gap * (np.arange(count, dtype=np.float64) + 0.5)
        # Tripods are beside the middle, alternately on both sides.
        self.station_offset = p.scanner_offset * np.where(np.arange(count) % 2 == 0, 1.0, -1.0)

    def _at(self, chainage: Float, offset: Float | float) -> Float:
        """Return scanner positions relative to the line's origin, (n, 3)."""
        f = self.tunnel.line.frame(chainage)
        across = np.broadcast_to(offset, chainage.shape)[:, None]
        return f.position - self.tunnel.line.origin + across * f.u + self.height * f.w

    def stations(self) -> Float:
        """Return the positions of static stations, (n, 3); station i has scan id i + 1."""
        return self._at(self.station_chainage, self.station_offset) + self.tunnel.line.origin

    def time_at(self, chainage: Float) -> Float:
        """Return the GPS time at which the trolley passes a chainage."""
        return START_TIME + (chainage - self.tunnel.line.start) / self.parameters.speed

    def trajectory(self) -> Float:
        """Return trolley poses from a second before the start to a second after the end; (n, 4): time, x, y, z."""
        line, speed = self.tunnel.line, self.parameters.speed
        duration = (line.end - line.start) / speed
        time = np.arange(-1.0, duration + 1.0 + TRAJECTORY_STEP, TRAJECTORY_STEP)
        position = self._at(line.start + speed * time, self.parameters.scanner_offset) + line.origin
        return np.column_stack([START_TIME + time, position])

    def plans(self) -> Iterator[BlockPlan]:
        """Yield blocks in the order of writing, by ascending chainage."""
        p, line = self.parameters, self.tunnel.line
        if p.density is not None:
            yield from self._uniform_plans(p.density)
        elif p.scanner == "static":
            rows, columns = self._grid()
            wide = max(1, RAYS // rows)
            index = 0
            for station, s in enumerate(self.station_chainage):
                for first in range(0, columns, wide):
                    yield BlockPlan(index, float(s), station, first, min(first + wide, columns), float(s))
                    index += 1
        else:
            profiles = math.ceil((line.end - line.start) / p.profile_spacing)
            deep = max(1, RAYS // p.profile_points)
            edges = self._file_edges()
            index = 0
            for low, high in pairwise(edges.tolist()):
                begin = min(profiles, math.ceil((low - line.start) / p.profile_spacing - 1e-9))
                end = min(profiles, math.ceil((high - line.start) / p.profile_spacing - 1e-9))
                for first in range(begin, end, deep):
                    last = min(first + deep, end)
                    s, t = line.start + np.array([first, last]) * p.profile_spacing
                    yield BlockPlan(index, float(s), 0, first * p.profile_points, last * p.profile_points, float(t))
                    index += 1

    def times(self) -> tuple[float, float]:
        """Return the GPS times of the start and end of the survey, s."""
        if self.parameters.scanner == "static":
            return START_TIME, START_TIME + STATION_TIME * self.station_chainage.size
        begin, end = self.time_at(np.array([self.tunnel.line.start, self.tunnel.line.end])).tolist()
        return begin, end

    def _file_edges(self) -> Float:
        """Return start, kilometre marks and end."""
        line = self.tunnel.line
        marks = 1000.0 * np.arange(math.floor(line.start / 1000.0) + 1, math.ceil(line.end / 1000.0))
        return np.concatenate([[line.start], marks, [line.end]])

    def _uniform_plans(self, density: float) -> Iterator[BlockPlan]:
        step = RAYS / (density * 2.0 * self.tunnel.section.half_perimeter)
        edges = self._file_edges()
        index = 0
        for low, high in pairwise(edges.tolist()):
            count = max(1, math.ceil((high - low) / step))
            cuts = np.linspace(low, high, count + 1)
            for a, b in pairwise(cuts.tolist()):
                yield BlockPlan(index, a, 0, 0, 0, b)
                index += 1

    def _grid(self) -> tuple[int, int]:
        """Return the numbers of rows (zenith) and columns (azimuth) of a static scan."""
        step = self.parameters.angular_step
        return int(MAX_ZENITH / step), round(360.0 / step)

    def rays(self, plan: BlockPlan, rng: np.random.Generator) -> Rays:
        """Return the rays of a block."""
        if self.parameters.density is not None:
            return self._uniform_rays(plan, rng, self.parameters.density)
        if self.parameters.scanner == "static":
            return self._static_rays(plan)
        return self._profiler_rays(plan)

    def _static_rays(self, plan: BlockPlan) -> Rays:
        rows, columns = self._grid()
        azimuth = 2.0 * np.pi / columns * np.arange(plan.first, plan.last)
        zenith = np.radians(self.parameters.angular_step) * (np.arange(rows) + 0.5)
        sz, cz = np.sin(zenith), np.cos(zenith)
        n = azimuth.size * rows
        direction = np.empty((azimuth.size, rows, 3))
        direction[:, :, 0] = np.sin(azimuth)[:, None] * sz
        direction[:, :, 1] = np.cos(azimuth)[:, None] * sz
        direction[:, :, 2] = cz
        k = plan.station
        pace = 0.8 * STATION_TIME / (rows * columns)
        origin = self._at(self.station_chainage[k : k + 1], self.station_offset[k])
        shot = plan.first * rows + np.arange(n)
        return Rays(
            np.repeat(origin, n, axis=0),
            direction.reshape(n, 3),
            np.full(n, plan.chainage),
            START_TIME + STATION_TIME * k + pace * shot.astype(np.float64),
            np.full(n, k + 1, dtype=np.uint16),
            k * columns + shot // rows,
        )

    def _profiler_rays(self, plan: BlockPlan) -> Rays:
        """Return rays of a rotating mirror on the moving trolley: each profile is one turn of a helix."""
        p, line = self.parameters, self.tunnel.line
        shot = np.arange(plan.first, plan.last)
        s: Float = line.start + shot * np.float64(p.profile_spacing / p.profile_points)
        f = line.frame(s)
        origin = f.position - line.origin + p.scanner_offset * f.u + self.height * f.w
        angle = 2.0 * np.pi / p.profile_points * ((shot % p.profile_points) + 0.5)
        # Clockwise from the floor over the left wall, so that the seam of a profile is on the floor.
        direction = -np.sin(angle)[:, None] * f.u - np.cos(angle)[:, None] * f.w
        return Rays(origin, direction, s, self.time_at(s), np.ones(s.size, dtype=np.uint16), shot // p.profile_points)

    def _uniform_rays(self, plan: BlockPlan, rng: np.random.Generator, density: float) -> Rays:
        """Return rays to points uniformly spread over the surface, from the trolley beside them or the nearest station."""
        p, line, half = self.parameters, self.tunnel.line, self.tunnel.section.half_perimeter
        n = round(density * 2.0 * half * (plan.chainage_to - plan.chainage))
        s = np.sort(rng.uniform(plan.chainage, plan.chainage_to, n))
        target = self.tunnel.to_space(s, rng.uniform(-half, half, n)) - line.origin
        if p.scanner == "static":
            gap = (line.end - line.start) / self.station_chainage.size
            k = np.clip(((s - line.start) / gap).astype(int), 0, self.station_chainage.size - 1)
            hint = self.station_chainage[k]
            origin = self._at(self.station_chainage, self.station_offset)[k]
            within = (s - (hint - 0.5 * gap)) / gap
            time = START_TIME + STATION_TIME * (k + 0.8 * np.clip(within, 0.0, 1.0))
            scan_id = (k + 1).astype(np.uint16)
        else:
            hint, time, scan_id = s, self.time_at(s), np.ones(n, dtype=np.uint16)
            origin = self._at(s, p.scanner_offset)
        direction = target - origin
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        return Rays(origin, direction, hint, time, scan_id, np.zeros(n, dtype=np.int64))
