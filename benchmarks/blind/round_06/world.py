"""A tunnel with all that is in it, its scan and its truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import ndimage

from . import outline
from .canvas import CELL, Canvas
from .equipment import NOTHING, Rays, Thing, trace
from .fields import Array
from .files import write_cloud, write_table
from .instrument import Aim, Instrument, Law, Mobile, Static
from .tunnel import Axis

GRAZING = 0.06
"""Cosine of the incidence at which the lining's own relief hides it."""

WIDE = 0.15
"""Strips that are hidden and wider than this are no part of a leak (m)."""

GLINT = 0.09
"""Width of mirror reflections (rad)."""


@dataclass
class World:
    """Tunnel, scanner and surroundings; ``law`` is the lining's reflection, ``axis_points`` how far apart its points are."""

    axis: Axis
    canvas: Canvas
    things: Sequence[Thing]
    instrument: Instrument
    survey: Static | Mobile
    law: Law
    rng: np.random.Generator
    reference: bool = True
    axis_points: float = 4.0

    def __post_init__(self) -> None:
        self.slopes = np.gradient(ndimage.gaussian_filter(self.canvas.relief, 1.5), CELL)

    def write(self, folder: Path) -> None:
        """Write all files of the scene."""
        section, length = self.canvas.section, self.canvas.length
        parts = [self._scan(aim) for aim in self.survey.aims(section, length, self.rng)]
        columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
        write_cloud(folder / "scan.laz", *columns)
        s = np.arange(-6, length + 6.01, self.axis_points)
        write_table(folder / "axis.csv", "x,y,z", self.axis.frame(s)[0], "%.4f")
        if isinstance(self.survey, Static):
            write_table(folder / "stations.csv", "scan_id,x,y,z", self.survey.track(self.axis, section), "%d,%.4f,%.4f,%.4f")
        else:
            track = self.survey.track(self.axis, section, length)
            write_table(folder / "trajectory.csv", "time,x,y,z", track, "%.4f")
        if self.reference:
            r = np.arange(0.5, 30.01, 0.25)
            level = (
                self.instrument.constant + self.instrument.distance(r) + 10 * np.log10(0.8) + self.rng.normal(0, 0.05, len(r))
            )
            write_table(folder / "reference.csv", "range_m,intensity_db", np.column_stack([r, level]), "%.3f")
        outline.write(folder / "truth.geojson", self._leaks())
        outline.write(folder / "other.geojson", self._others())

    def _surface(self, s: Array, u: Array) -> tuple[Array, Array, Array]:
        """Points, normals, and ``n`` and ``z`` of places on the lining."""
        n, z, mn, mz, tn, tz = self.canvas.section.at(u)
        out = self.canvas.sample(self.canvas.relief, s, u)
        along, around = (self.canvas.sample(grid, s, u)[:, None] for grid in self.slopes)
        centre, ahead, right = self.axis.frame(s)
        up = np.array([0.0, 0.0, 1.0])
        n, z = n + out * mn, z + out * mz
        normal = (mn[:, None] - around * tn[:, None]) * right + (mz[:, None] - around * tz[:, None]) * up - along * ahead
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return centre + right * n[:, None] + up * z[:, None], normal, np.stack([n, z])

    def _source(self, at: Array, n: float, z: float) -> Array:
        centre, _, right = self.axis.frame(at)
        centre = centre + n * right
        centre[:, 2] += z
        return centre

    def _rays(self, s: Array, source: Array, place: Array) -> Rays:
        centre, ahead, right = self.axis.frame(s)
        away = source - centre
        a = (away * ahead).sum(1)
        return Rays(s, a, (away * right).sum(1), away[:, 2] - self.axis.grade * a, place[0], place[1])

    def _scan(self, aim: Aim) -> tuple[Array, Array, Array, Array]:
        """Points, amplitudes, times and sources of a part of the scan."""
        device, rng, canvas = self.instrument, self.rng, self.canvas
        source = self._source(aim.at, aim.n, aim.z)
        target, normal, place = self._surface(aim.s, aim.u)
        full = np.linalg.norm(target - source, axis=1)
        direction = (target - source) / full[:, None]
        footprint = 0.004 + device.beam / 2 * full
        hits = trace(self.things, self._rays(aim.s, source, place), footprint)
        hit = hits.thing != NOTHING
        cos = -(direction * normal).sum(1)
        shine = canvas.sample(canvas.gloss, aim.s, aim.u)
        echo = self._echo(cos, canvas.sample(canvas.albedo - canvas.drop, aim.s, aim.u), shine) * hits.passed
        lost = canvas.hole[np.rint(aim.s / CELL).astype(int), np.rint((aim.u - canvas.u[0]) / CELL).astype(int)]
        echo[(cos < GRAZING) | lost] = 0
        t = hits.t.copy()
        if hit.any():
            _, ahead, right = self.axis.frame(aim.s[hit])
            local = hits.normal[hit]
            facing = local[:, :1] * ahead + local[:, 1:2] * right + local[:, 2:] * np.array([0.0, 0.0, 1.0])
            db, gloss = (np.array([getattr(thing, name) for thing in self.things])[hits.thing[hit]] for name in ("db", "gloss"))
            onto = self._echo(np.clip(-(direction[hit] * facing).sum(1), 0.02, 1), db + rng.normal(0, 0.4, len(db)), gloss)
            share = hits.share[hit]
            mixed = (share < 0.95) & (rng.random(len(share)) < 0.5)
            behind = echo[hit]
            echo[hit] = onto * share + np.where(mixed, behind * (1 - share), 0)
            gap = 1 - t[hit]
            close = gap * full[hit] < 0.6
            t[hit] += np.where(mixed & close, gap * (1 - share) * rng.random(len(share)), 0)
        stray = rng.random(len(t)) < device.stray
        t = np.where(stray, t * rng.uniform(0.3, 1.03, len(t)), t)
        echo = np.where(stray, echo * 10 ** (-rng.uniform(0, 1.2, len(t))), echo)
        r = full * t + rng.normal(0, device.range_noise, len(t))
        with np.errstate(divide="ignore"):
            amplitude = device.constant + device.distance(np.maximum(r, 0.3)) + 10 * np.log10(echo)
        weak = 10 ** (-(np.maximum(amplitude, 0) - device.threshold) / 20)
        with np.errstate(invalid="ignore"):
            amplitude = amplitude + rng.normal(0, 1, len(t)) * np.hypot(device.noise, device.noise_weak * weak)
        amplitude += self._drift(aim)
        kept = (amplitude > device.threshold) & (r > 0.8)
        points = source[kept] + direction[kept] * r[kept, None]
        level = np.round(amplitude[kept] / device.step) * device.step
        return points, level.astype(np.float32), aim.time[kept], np.full(int(kept.sum()), aim.source)

    def _drift(self, aim: Aim) -> Array:
        if isinstance(self.survey, Static):
            return np.full(len(aim.s), self.rng.normal(0, self.instrument.drift))
        return np.asarray(self.instrument.drift * np.sin(aim.time / 9.0))

    def _echo(self, cos: Array, db: Array, gloss: Array) -> Array:
        """Power that comes back, of a white square target's."""
        safe = np.clip(cos, 0.01, 1)
        return np.asarray(self.law(safe) * 10 ** (db / 10) + gloss * np.exp(-((np.arccos(safe) / GLINT) ** 2)))

    def _hidden(self, s: Array, u: Array) -> Array:
        """Whether no scanner saw the places of a grid."""
        S, U = (g.ravel().astype(float) for g in np.meshgrid(s, u, indexing="ij"))
        seen = np.zeros(len(S), bool)
        target, normal, place = self._surface(S, U)
        for at, n, z in self.survey.views(self.canvas.section, S, U):
            source = self._source(at, n, z)
            ray = target - source
            r = np.linalg.norm(ray, axis=1)
            cos = -(ray * normal).sum(1) / r
            hits = trace(self.things, self._rays(S, source, place), np.full(len(S), 1e-4))
            seen |= (hits.thing == NOTHING) & (cos > GRAZING) & (r < self.survey.reach)
        return ~seen.reshape(len(s), len(u))

    def _place(self, s: Array, u: Array) -> Array:
        return self._surface(s, u)[0]

    def _leaks(self) -> list[dict[str, object]]:
        """Wet places that hang together, less what wide things hide."""
        canvas = self.canvas
        labels, _ = ndimage.label(canvas.outline < 0)
        found: list[dict[str, object]] = []
        for number, window in enumerate(ndimage.find_objects(labels), 1):
            rows, columns = (slice(max(w.start - 12, 0), w.stop + 12) for w in window)
            mine = labels[rows, columns] == number
            others = (labels[rows, columns] > 0) & ~mine
            field = np.where(others, 0.02, canvas.outline[rows, columns])[::2, ::2]
            s, u = canvas.s[rows][::2].astype(float), canvas.u[columns][::2].astype(float)
            hidden = np.pad(self._hidden(s, u), 6, mode="edge")
            wide = ndimage.binary_opening(hidden, _disc(WIDE / 2 / (2 * CELL)))[6:-6, 6:-6]
            cut = (ndimage.distance_transform_edt(wide) - ndimage.distance_transform_edt(~wide)) * 2 * CELL
            cut = np.where(wide, cut - CELL, cut + CELL) if wide.any() else np.full(wide.shape, -9.0)
            parts = [part for part in outline.polygons(s, u, np.maximum(field, cut)) if part.area > 0.004]
            if not parts:
                continue
            within = mine[::2, ::2] & ~wide
            owner = canvas.owner[rows, columns][mine]
            leak = canvas.leaks[int(np.bincount(owner[owner >= 0]).argmax())]
            drop = float(canvas.drop[rows, columns][::2, ::2][within].mean()) if within.any() else leak.drop
            properties: dict[str, object] = {"id": len(found) + 1, "drop_db": round(drop, 2), "phenomenon": leak.phenomenon}
            if leak.limit:
                properties["limit"] = leak.limit
            found.append(outline.feature(parts, self._place, properties))
        return found

    def _others(self) -> list[dict[str, object]]:
        """What is dark but dry, or bright."""
        canvas = self.canvas
        found: list[dict[str, object]] = []
        for stain in canvas.stains:
            s, u = canvas.s[stain.rows][::2].astype(float), canvas.u[stain.columns][::2].astype(float)
            parts = [part for part in outline.polygons(s, u, stain.outline[::2, ::2]) if part.area > 0.004]
            if parts:
                properties = {"id": len(found) + 1, "kind": stain.kind, "change_db": round(stain.change, 2)}
                found.append(outline.feature(parts, self._place, properties))
        return found


def _disc(radius: float) -> Array:
    reach = int(np.ceil(radius))
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    return np.asarray(np.hypot(x, y) <= radius + 0.2)
