"""Synthetic scan of a structure: members, anomalies on their faces, and the points of each station."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from tunneldb.arrays import Bool, Float, Int32, Int64, Single, UInt16
from tunneldb.simulate.noise_field import smooth_field
from tunneldb.simulate.radiometry import SYSTEM_CONSTANT, counts, range_term
from tunneldb.simulate.structure import layout
from tunneldb.simulate.structure.anomalies import Anomaly, place
from tunneldb.simulate.structure.cast import TILE, View, cast, view
from tunneldb.simulate.structure.materials import MATERIALS
from tunneldb.simulate.structure.parameters import StructureParameters
from tunneldb.simulate.structure.shapes import TUBE, Structure, normals

RAYS = 400_000  # per block
SCOUT_STEP = math.radians(0.2)  # between the rays that find visible places for anomalies
MAX_ZENITH = math.radians(150.0)  # the tripod hides directions below
MAX_RANGE = 60.0  # m
MIN_COSINE = math.cos(math.radians(88.0))  # at greater incidence there is no echo
EXIT_DIAMETER = 0.0021  # diameter of the beam at the scanner, m
MIN_SHARE = 0.3  # least share of the footprint for an echo
MAX_FACE_DISTANCE = 0.003  # m: greatest distance of an echo at an edge from its face
FADE_WIDTH = 0.004  # m over which rust and stains fade, in addition to the footprint
MIN_PLACES = 40  # least number of visible places for an anomaly
SUN = np.array([0.4, -0.7, 0.6]) / np.linalg.norm([0.4, -0.7, 0.6])
START_TIME, STATION_TIME = 300_000.0, 300.0  # s

# Centre of the beam and six places around it, with equal shares of its area.
_SAMPLES = np.array([(0.0, 0.0)] + [(0.72 * math.cos(k * math.pi / 3), 0.72 * math.sin(k * math.pi / 3)) for k in range(6)])


class StructureCloud(NamedTuple):
    """Points with reference data, arrays of n in file order.

    ``face``, ``member``, ``anomaly`` are ids, 0 for none (a mixed pixel belongs to no face); ``incidence`` is in degrees;
    ``rgb`` (n, 3) is None by night. Levels are dB, ``time`` s, ``xyz`` m.
    """

    xyz: Float
    time: Float
    scan_id: UInt16
    amplitude: Single
    reflectance: Single
    intensity: UInt16
    rgb: UInt16 | None
    face: UInt16
    member: UInt16
    anomaly: UInt16
    incidence: Single


class _Echoes(NamedTuple):
    """Hits of rays: direction (n, 3), range and level (dB) without noise, surface, cosine, face (0: none), column and line."""

    direction: Float
    range: Float
    level: Float
    surface: Int32
    cosine: Float
    face: Int64
    shot: Int64

    def take(self, rows: Bool) -> _Echoes:
        """Return some of them."""
        return _Echoes(
            self.direction[rows],
            self.range[rows],
            self.level[rows],
            self.surface[rows],
            self.cosine[rows],
            self.face[rows],
            self.shot[rows],
        )


class StructureScan:
    """Synthetic structure, ready to be scanned.

    Attributes
    ----------
    parameters : StructureParameters
    structure : Structure
        Members and faces, in local coordinates.
    stations : (n, 3) array
        Scanner positions in local coordinates, m; station i has scan id i + 1.
    anomalies : list of Anomaly
    """

    def __init__(self, parameters: StructureParameters) -> None:
        self.parameters = parameters
        made, stood, differs, day, night, salt = np.random.SeedSequence(parameters.seed).spawn(6)
        self._noise = night if parameters.night else day
        self._salt = int(salt.generate_state(1)[0])
        self.structure: Structure = layout.build(parameters, np.random.default_rng(made))
        self.stations: Float = layout.stations(parameters, np.random.default_rng(stood))
        self._rows, self._owner = self.structure.table()
        self._materials = [MATERIALS[name] for name in self.structure.material]
        self._material = np.array([list(MATERIALS).index(name) for name in self.structure.material])
        self._views: list[View] = [view(self._rows, station) for station in self.stations]
        rng = np.random.default_rng(self._noise.spawn(1)[0])
        count = len(self.stations)
        self._shift = rng.normal(0.0, 1.0, (count, 3)) * parameters.misregistration
        self._gain = rng.normal(0.0, 1.0, count) * parameters.gain
        self.anomalies: list[Anomaly] = self._place(np.random.default_rng(differs))

    def _window(self, station: int, step: float) -> tuple[Float, Float]:
        """Return azimuths and zeniths of a station's rays."""
        seen = self._views[station]
        last = np.minimum(seen.low + np.array([seen.columns, seen.lines]) * TILE, [math.pi, MAX_ZENITH])
        azimuth = np.arange(seen.low[0] + 0.5 * step, last[0], step)
        return azimuth, np.arange(seen.low[1] + 0.5 * step, last[1], step)

    def _place(self, rng: np.random.Generator) -> list[Anomaly]:
        """Place anomalies around visible places, at most one per face except for walls and floors."""
        seen: dict[int, list[Float]] = {}
        for k, station in enumerate(self.stations):
            direction = _directions(*self._window(k, SCOUT_STEP))
            distance, which = cast(self._rows, self._views[k], station, direction)
            owner = np.where(which >= 0, self._owner[which], 0)
            xyz = station + np.where(np.isfinite(distance), distance, 0.0)[:, None] * direction
            for face in np.unique(owner[owner > 0]).tolist():
                seen.setdefault(face, []).append(self.structure.faces[face - 1].unroll(xyz[owner == face]))
        places = {face: np.vstack(parts) for face, parts in seen.items()}
        faces = [
            f for f in self.structure.faces if f.row[0] <= TUBE and f.surfaces == 1 and len(places.get(f.id, ())) >= MIN_PLACES
        ]
        out: list[Anomaly] = []
        if not faces:
            return out
        # More often on faces with a larger visible part, but also on small ones.
        weight = np.sqrt([len(places[f.id]) for f in faces])
        for _ in range(20 * self.parameters.anomalies):
            if len(out) == self.parameters.anomalies:
                break
            face = faces[int(rng.choice(len(faces), p=weight / weight.sum()))]
            existing = [a for a in out if a.face is face]
            wide = min(face.size()) > 1.0
            found = place(len(out) + 1, face, places[face.id], self.parameters.contrast, rng)
            if found is None or (existing and not wide) or any(a.outline.distance(found.outline) < 0.15 for a in existing):
                continue
            out.append(found)
        return out

    def blocks(self) -> Iterator[StructureCloud]:
        """Yield points, station by station, by ascending azimuth."""
        step = math.radians(self.parameters.angular_step)
        for k in range(len(self.stations)):
            azimuth, zenith = self._window(k, step)
            wide = max(1, RAYS // len(zenith))
            for block, first in enumerate(range(0, len(azimuth), wide)):
                key = (*self._noise.spawn_key, 1 + k, block)
                rng = np.random.default_rng(np.random.SeedSequence(self._noise.entropy, spawn_key=key))
                yield self._make(k, azimuth, zenith, first, min(first + wide, len(azimuth)), rng)

    def _make(self, k: int, azimuth: Float, zenith: Float, first: int, last: int, rng: np.random.Generator) -> StructureCloud:
        """Return the points of the columns ``first`` to ``last`` of a station."""
        p = self.parameters
        found = self._echoes(k, azimuth, zenith, first, last)
        many = len(found.range)
        met = self.stations[k] + found.range[:, None] * found.direction
        shift, share, number, colour = self._differences(found, met)
        level = found.level + shift + self._gain[k] + rng.standard_normal(many) * p.intensity_noise
        amplitude = SYSTEM_CONSTANT + range_term(found.range) + level
        measured = found.range + rng.standard_normal(many) * p.range_noise
        xyz = self.stations[k] + self._shift[k] + measured[:, None] * found.direction + np.array(p.origin)
        rgb = None if p.night else self._colours(found, met, share, colour, rng)
        member = np.array([0] + [f.member for f in self.structure.faces])[found.face]
        return StructureCloud(
            xyz,
            START_TIME + STATION_TIME * k + 0.8 * STATION_TIME * found.shot / (len(azimuth) * len(zenith)),
            np.full(many, k + 1, dtype=np.uint16),
            amplitude.astype(np.float32),
            level.astype(np.float32),
            counts(amplitude),
            rgb,
            found.face.astype(np.uint16),
            member.astype(np.uint16),
            number.astype(np.uint16),
            np.degrees(np.arccos(found.cosine)).astype(np.float32),
        )

    def _echoes(self, k: int, azimuth: Float, zenith: Float, first: int, last: int) -> _Echoes:
        """Return echoes of a block of columns; of the whole footprint where neighbours hit other surfaces."""
        low, high = max(first - 1, 0), min(last + 1, len(azimuth))
        lines = len(zenith)
        direction = _directions(azimuth[low:high], zenith)
        distance, which = cast(self._rows, self._views[k], self.stations[k], direction)
        owner = np.where(which >= 0, self._owner[which], -1).reshape(-1, lines)
        met = which.reshape(-1, lines)
        edge = np.zeros(owner.shape, dtype=bool)
        for axis in (0, 1):
            unlike = np.diff(owner, axis=axis) != 0
            unlike |= (np.diff(met, axis=axis) != 0) & (np.minimum(*_pair(owner, axis)) <= 0)
            before, after = _pair(edge, axis)
            before |= unlike
            after |= unlike
        mine = np.zeros(owner.shape, dtype=bool)
        mine[first - low : last - low] = True
        rows = np.flatnonzero(mine & (np.isfinite(distance).reshape(-1, lines) | edge))
        edge = edge.ravel()[rows]
        shot = low * lines + rows
        direction, distance, which = direction[rows], distance[rows], which[rows]
        level, cosine = self._levels(k, direction, distance, which)
        face = np.where(which >= 0, self._owner[which], 0)
        found = _Echoes(direction, distance, level, which, cosine, face, shot)
        if self.parameters.beam > 0.0:
            self._mix(k, found, np.flatnonzero(edge))
        good = np.isfinite(found.range) & (found.range < MAX_RANGE) & (found.cosine > MIN_COSINE)
        return found.take(good)

    def _levels(self, k: int, direction: Float, distance: Float, which: Int32) -> tuple[Float, Float]:
        """Return level (dB) and cosine of incidence of rays; -inf and 0 without an echo."""
        level, cosine = np.full(len(distance), -np.inf), np.zeros(len(distance))
        hit = np.flatnonzero(which >= 0)
        xyz = self.stations[k] + distance[hit, None] * direction[hit]
        c = np.abs(np.einsum("ij,ij->i", normals(self._rows[which[hit]], xyz), direction[hit]))
        cosine[hit] = np.minimum(c, 1.0)
        kind = self._material[which[hit]]
        for number in np.unique(kind).tolist():
            mine = hit[kind == number]
            level[mine] = list(MATERIALS.values())[number].level(cosine[mine])
        return level, cosine

    def _mix(self, k: int, found: _Echoes, rows: Int64) -> None:
        """Replace single rays at edges by the mean over the footprint, by power."""
        if not len(rows):
            return
        direction = found.direction[rows]
        distance = found.range[rows]
        reach = np.where(np.isfinite(distance), distance, self.parameters.distance)
        radius = 0.5 * (EXIT_DIAMETER + 1e-3 * self.parameters.beam * reach) / reach
        one = np.cross(direction, [0.0, 0.0, 1.0])
        one /= np.linalg.norm(one, axis=1)[:, None]
        two = np.cross(direction, one)
        power, moment, hits = np.zeros(len(rows)), np.zeros(len(rows)), np.zeros(len(rows))
        for p, q in _SAMPLES:
            samples = direction + radius[:, None] * (p * one + q * two)
            samples /= np.linalg.norm(samples, axis=1)[:, None]
            far, which = cast(self._rows, self._views[k], self.stations[k], samples)
            level, _ = self._levels(k, samples, far, which)
            far = np.where(which >= 0, far, 1.0)
            part = np.where(which >= 0, 10.0 ** (0.1 * (level + range_term(far))), 0.0)
            power, moment, hits = power + part, moment + part * far, hits + (which >= 0)
        gone = hits < MIN_SHARE * len(_SAMPLES)
        mean = np.where(gone, np.inf, moment / np.maximum(power, 1e-300))
        kept = np.where(gone, 1.0, mean)
        away = np.abs(kept - np.where(np.isfinite(distance), distance, 1e9)) * found.cosine[rows]
        is_mixed = ~np.isfinite(distance) | (away > MAX_FACE_DISTANCE)
        found.range[rows] = mean
        found.face[rows[is_mixed]] = 0
        found.level[rows] = 10.0 * np.log10(np.maximum(power, 1e-300) / len(_SAMPLES)) - range_term(kept)
        # An echo beside all hits of its central ray has no incidence.
        found.cosine[rows[~np.isfinite(distance)]] = 1.0

    def _differences(self, found: _Echoes, met: Float) -> tuple[Float, Float, Int64, Float]:
        """Return change of level (dB), share of the footprint on an anomaly, its id if the centre is on it, and its colour."""
        many = len(found.range)
        shift, share, number = np.zeros(many), np.zeros(many), np.zeros(many, dtype=np.int64)
        colour = np.zeros((many, 3))
        on = {a.face.id: [b for b in self.anomalies if b.face is a.face] for a in self.anomalies}
        order = np.argsort(found.face, kind="stable")
        begin = np.searchsorted(found.face[order], np.arange(len(self.structure.faces) + 2))
        for face in self.structure.faces:
            rows = order[begin[face.id] : begin[face.id + 1]]
            if not len(rows):
                continue
            uv = face.unroll(met[rows])
            kind = MATERIALS[face.material]
            shift[rows] += kind.mottle * smooth_field(uv[:, 0] / kind.cell, uv[:, 1] / kind.cell, self._salt + face.id)
            for anomaly in on.get(face.id, ()):
                spot = EXIT_DIAMETER + 1e-3 * self.parameters.beam * found.range[rows]
                part, inside = covered(anomaly, uv, spot)
                touched = np.flatnonzero(part > 0.0)
                mine = rows[touched]
                change = anomaly.level(found.cosine[mine])
                shift[mine] += 10.0 * np.log10(1.0 + part[touched] * (10.0 ** (0.1 * change) - 1.0))
                share[mine], number[rows[inside]] = part[touched], anomaly.id
                colour[mine] = _COLOURS[anomaly.kind]
        return shift, share, number, colour

    def _colours(self, found: _Echoes, met: Float, share: Float, colour: Float, rng: np.random.Generator) -> UInt16:
        """Return RGB by day: the material's colour in sunlight and skylight."""
        many = len(found.range)
        base = np.full((many, 3), 0.4)
        light = np.full(many, 0.6)
        hit = np.flatnonzero(found.surface >= 0)
        table = np.array([m.colour for m in MATERIALS.values()])
        base[hit] = table[self._material[found.surface[hit]]]
        n = normals(self._rows[found.surface[hit]], met[hit])
        n *= -np.sign(np.einsum("ij,ij->i", n, found.direction[hit]))[:, None]
        light[hit] = 0.45 + 0.55 * np.maximum(n @ SUN, 0.0)
        base = base * (1.0 - share[:, None]) + colour * share[:, None]
        value = base * light[:, None] * (1.0 + 0.04 * rng.standard_normal((many, 1)))
        return np.asarray(np.clip(np.rint(65535.0 * value), 0, 65535).astype(np.uint16))


_COLOURS = {
    "rust": (0.42, 0.22, 0.10),
    "stain": (0.25, 0.23, 0.20),
    "crack": (0.12, 0.11, 0.10),
    "flake": (0.90, 0.90, 0.88),
}


def covered(anomaly: Anomaly, uv: Float, spot: Float) -> tuple[Float, Bool]:
    """Return the share of each footprint on an anomaly, and True if its centre is on it.

    Parameters
    ----------
    uv : (n, 2) array
        Centres of the footprints on the anomaly's face, m.
    spot : (n,) array
        Diameter of the footprints, m.
    """
    share, inside = np.zeros(len(uv)), np.zeros(len(uv), dtype=bool)
    fade = float(spot.max()) + FADE_WIDTH if len(spot) else 0.0
    low, high = np.reshape(anomaly.outline.bounds, (2, 2)) + np.array([[-fade], [fade]])
    near = np.flatnonzero(((uv >= low) & (uv <= high)).all(axis=1))
    points = shapely.points(uv[near])
    shapely.prepare(anomaly.outline)
    inside[near] = shapely.contains(anomaly.outline, points)
    if anomaly.line is not None:
        away, half = shapely.distance(anomaly.line, points), 0.5 * spot[near]
        overlap = np.minimum(away + half, 0.5 * anomaly.width) - np.maximum(away - half, -0.5 * anomaly.width)
        share[near] = np.clip(overlap / spot[near], 0.0, 1.0)
        return share, inside
    away = shapely.distance(shapely.boundary(anomaly.outline), points) * np.where(inside[near], 1.0, -1.0)
    edge = spot[near] + (FADE_WIDTH if anomaly.kind in ("rust", "stain") else 0.0)
    share[near] = np.clip(0.5 + away / edge, 0.0, 1.0)
    return share, inside


def _directions(azimuth: Float, zenith: Float) -> Float:
    """Return unit rays (n, 3), the lines of a column one after the other."""
    out = np.empty((len(azimuth), len(zenith), 3))
    out[:, :, 0] = np.sin(azimuth)[:, None] * np.sin(zenith)
    out[:, :, 1] = np.cos(azimuth)[:, None] * np.sin(zenith)
    out[:, :, 2] = np.cos(zenith)
    return out.reshape(-1, 3)


def _pair(grid: NDArray[Any], axis: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return neighbours along an axis, as views."""
    return (grid[:-1], grid[1:]) if axis == 0 else (grid[:, :-1], grid[:, 1:])
