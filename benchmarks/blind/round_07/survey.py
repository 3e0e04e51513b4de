"""Files that a surveyor hands over, and the truth."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import laspy
import numpy as np
from numpy.typing import NDArray
from pyproj import CRS
from scipy.ndimage import binary_closing, binary_opening, distance_transform_edt
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from .canvas import Canvas, Mark, Mask
from .casting import LINING
from .instrument import Instrument
from .scanner import Cloud
from .section import Alignment, Array

# The dry lining about a leak: from where to where it is taken, in metres, and from what loss on the lining is not dry, in dB.
GAP, RING, RIM = 0.08, 0.45, -0.25
# Of the vertices of an outline, in metres.
SPACING = 0.045


@dataclass
class Survey:
    """A scanned tunnel with its truth.

    Attributes
    ----------
    canvas : Canvas
        The lining.
    alignment : Alignment
        Where it lies.
    instrument : Instrument
        The scanner.
    cloud : Cloud
        The scan.
    axis : tuple of float
        Offset and height of the axis handed over.
    stations : list of tuple of float
        Chainage, offset and height of each station; empty for a mobile scan.
    path : ndarray
        Time, chainage, offset and height of a mobile scanner; empty for a static scan.
    reference : tuple of float
        Least and greatest range of the reference curve; empty where there is none.
    """

    canvas: Canvas
    alignment: Alignment
    instrument: Instrument
    cloud: Cloud
    axis: tuple[float, float]
    stations: list[tuple[float, float, float]]
    path: Array
    reference: tuple[float, float] | tuple[()] = ()

    def hidden(self) -> Mask:
        """Cells of the lining that no beam has met, in strips wider than 0.15 m."""
        canvas, cloud = self.canvas, self.cloud
        coarse = 0.04
        shape = [int(np.ceil(n * canvas.cell / coarse)) + 1 for n in canvas.shape]
        on = cloud.met == LINING
        i = np.clip(cloud.u[on] / coarse, 0, shape[0] - 1).astype(int)
        j = np.clip((cloud.s[on] - canvas.origin) / coarse, 0, shape[1] - 1).astype(int)
        seen = np.zeros(shape, dtype=bool)
        seen[i, j] = True
        seen = binary_closing(seen, np.ones((3, 3)))
        hidden = binary_opening(~seen, np.ones((4, 4)))
        rows = (canvas.u / coarse).astype(int)
        columns = ((canvas.s - canvas.origin) / coarse).astype(int)
        return hidden[np.ix_(rows, columns)]

    def wet(self) -> Mask:
        """Cells of the lining that any leak covers."""
        wet = np.zeros(self.canvas.shape, dtype=bool)
        for mark in self.canvas.leaks:
            wet[mark.window] |= mark.mask
        return wet

    def drop(self, mark: Mark, hidden: Mask) -> float:
        """By how much a leak lies below the dry lining within half a metre about it, in dB.

        Parameters
        ----------
        mark : Mark
            The leak.
        hidden : ndarray
            Cells that no beam has met.

        Returns
        -------
        float
        """
        canvas = self.canvas
        leak = np.zeros(canvas.shape, dtype=bool)
        leak[mark.window] = mark.mask & ~hidden[mark.window]
        # What is painted, mended or stained about a leak says nothing of the lining there, nor does a rim half dry.
        odd = hidden | (canvas.water < RIM) | ~canvas.on_wall[None, :]
        for other in canvas.others:
            odd[other.window] |= other.mask
        reach = round(RING / canvas.cell)
        part = tuple(slice(max(0, w.start - reach), w.stop + reach) for w in mark.window)
        distance = distance_transform_edt(~leak[part]) * canvas.cell
        about = np.zeros(canvas.shape, dtype=bool)
        about[part] = (distance > GAP) & (distance < RING) & ~odd[part]
        i, j, level = self.levels()
        return float(level[about[i, j]].mean() - level[leak[i, j]].mean())

    def levels(self) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
        """Cells of the points on the lining, and their amplitudes without what range and incidence do to them."""
        canvas, cloud = self.canvas, self.cloud
        on = cloud.met == LINING
        i = np.clip(cloud.u[on] / canvas.cell, 0, canvas.shape[0] - 1).astype(np.intp)
        j = np.clip((cloud.s[on] - canvas.origin) / canvas.cell, 0, canvas.shape[1] - 1).astype(np.intp)
        return i, j, cloud.amplitude[on] - cloud.range_part[on] - cloud.incidence_part[on]

    def write(self, folder: Path) -> None:
        """Write all files into a folder."""
        self._points(folder / "scan.laz")
        chainages = np.append(np.arange(-2.0, self.canvas.length, 2.5), self.canvas.length + 2.0)
        line = self.alignment.place(np.column_stack([chainages, np.tile(self.axis, (len(chainages), 1))]))
        _table(folder / "axis.csv", ["x", "y", "z"], [[f"{v:.3f}" for v in row] for row in line])
        if self.stations:
            stands = self.alignment.place(np.array(self.stations))
            rows = [[str(k), *(f"{v:.4f}" for v in row)] for k, row in enumerate(stands, 1)]
            _table(folder / "stations.csv", ["scan_id", "x", "y", "z"], rows)
        else:
            way = self.alignment.place(self.path[:, 1:])
            rows = [[f"{t:.4f}", *(f"{v:.4f}" for v in row)] for t, row in zip(self.path[:, 0], way, strict=True)]
            _table(folder / "trajectory.csv", ["time", "x", "y", "z"], rows)
        if self.reference:
            ranges = np.arange(self.reference[0], self.reference[1] + 0.01, 0.5)
            levels = self.instrument.constant + self.instrument.range_law(ranges)
            rows = [[f"{r:.2f}", f"{a:.2f}"] for r, a in zip(ranges, levels, strict=True)]
            _table(folder / "reference.csv", ["range_m", "intensity_db"], rows)
        self._truth(folder)

    def _points(self, path: Path) -> None:
        cloud = self.cloud
        header = laspy.LasHeader(version="1.4", point_format=6)
        header.scales = np.full(3, 0.0005)
        header.offsets = np.floor(cloud.xyz.min(axis=0))
        header.add_crs(CRS.from_epsg(25832))
        header.add_extra_dim(laspy.ExtraBytesParams(name="Amplitude", type=np.float32, description="dB"))
        las = laspy.LasData(header)
        las.x, las.y, las.z = cloud.xyz.T
        las["Amplitude"] = cloud.amplitude.astype(np.float32)
        spread = np.clip((cloud.amplitude - cloud.amplitude.min()) / 60, 0, 1)
        las.intensity = (65535 * spread).astype(np.uint16)
        las.gps_time = cloud.time
        las.point_source_id = cloud.station
        las.return_number = np.ones(len(cloud.time), dtype=np.uint8)
        las.number_of_returns = np.ones(len(cloud.time), dtype=np.uint8)
        las.write(path)

    def _truth(self, folder: Path) -> None:
        hidden = self.hidden()
        leaks: list[dict[str, object]] = []
        others: list[dict[str, object]] = []
        for mark in self.canvas.leaks:
            outline = self.canvas.outline(mark, hidden)
            if outline.is_empty:
                continue
            drop = self.drop(mark, hidden)
            properties = {"id": len(leaks) + 1, "drop_db": round(drop, 2), "phenomenon": mark.name}
            leaks.append(self._feature(outline, properties | ({"limit": mark.limit} if mark.limit else {})))
        covered = hidden | self.wet()
        for mark in self.canvas.others:
            outline = self.canvas.outline(mark, covered)
            if not outline.is_empty:
                others.append(self._feature(outline, {"id": len(others) + 1, "kind": mark.name}))
        crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}
        for name, features in (("truth", leaks), ("other", others)):
            collection = {"type": "FeatureCollection", "name": name, "crs": crs, "features": features}
            (folder / f"{name}.geojson").write_text(json.dumps(collection), encoding="utf-8")

    def _feature(self, outline: BaseGeometry, properties: dict[str, object]) -> dict[str, object]:
        """Outline on the lining as a GeoJSON feature."""
        parts = [[self._ring(r.coords) for r in (p.exterior, *p.interiors)] for p in _parts(outline.segmentize(SPACING))]
        geometry = (
            {"type": "MultiPolygon", "coordinates": parts} if len(parts) > 1 else {"type": "Polygon", "coordinates": parts[0]}
        )
        return {"type": "Feature", "properties": properties, "geometry": geometry}

    def _ring(self, coordinates: Iterable[Sequence[float]]) -> list[list[float]]:
        canvas = self.canvas
        u, s = np.array(coordinates).T
        i = np.clip(u / canvas.cell, 0, canvas.shape[0] - 1).astype(int)
        j = np.clip((s - canvas.origin) / canvas.cell, 0, canvas.shape[1] - 1).astype(int)
        normal = canvas.section.normals[canvas.section.segment(s)]
        flat = canvas.section.locate(s) + canvas.height[i, j][:, None] * normal
        placed = self.alignment.place(np.column_stack([u, flat]))
        # Where the lining steps, as at a pocket, neighbours in the plane lie apart in space.
        pieces = np.ceil(np.linalg.norm(np.diff(placed, axis=0), axis=1) / SPACING).astype(int)
        at = [k + n / count for k, count in enumerate(np.maximum(pieces, 1)) for n in range(count)] + [len(pieces)]
        filled = np.column_stack([np.interp(at, np.arange(len(placed)), column) for column in placed.T])
        return [[round(float(v), 4) for v in row] for row in filled]


def _parts(outline: BaseGeometry) -> list[Polygon]:
    return [p for p in getattr(outline, "geoms", [outline]) if isinstance(p, Polygon)]


def _table(path: Path, head: list[str], rows: list[list[str]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        writer.writerows(rows)
