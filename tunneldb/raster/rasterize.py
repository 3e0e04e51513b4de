"""Rasterise scan files at full density into the sums of a kilometre's image."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tunneldb.errors import UserError
from tunneldb.pointcloud.reader import Points, ScanSource, read_chunks
from tunneldb.radiometry.oren_nayar import incidence_db
from tunneldb.raster.accumulator import Accumulator
from tunneldb.raster.colour_sums import ColourSums
from tunneldb.raster.grid import Grid
from tunneldb.raster.observation import Observer, RangeSpan
from tunneldb.raster.projection import (
    COSINES,
    CorrectionArrays,
    EdgeArrays,
    Pixels,
    PixelTarget,
    PoseArrays,
    ProjectionCounts,
    SurfaceArrays,
    project,
)
from tunneldb.threads import threads

Counts = dict[str, Any]

CHUNK = 50_000
"""Number of points read at a time by one thread: a chunk of most LAZ files, small enough for the processor's cache."""


def rasterize(
    observer: Observer,
    files: list[ScanSource],
    image: Accumulator,
    roughness: float,
    progress: Callable[[float], None],
    colours: ColourSums | None = None,
) -> Counts:
    """Read the files and add their points to the image.

    Parameters
    ----------
    observer : Observer
        Kilometre, and the observation of its points.
    files : list of ScanSource
        Files to read.
    image : Accumulator
        Image that receives the points.
    roughness : float
        Roughness of the lining, degrees.
    progress : callable
        Called with the completed share, 0 to 0.9.
    colours : ColourSums or None
        Image that receives the colours of the points, in the same grid; None to read no colours.

    Raises
    ------
    UserError
        If a file cannot be read, too much of the lining is outside the reference curve, or no point is on the lining.
    """
    total, read, used, lost = sum(file.points for file in files), 0, 0, 0
    span = RangeSpan()
    projector = Projector.of(observer, image.grid, roughness)
    brightest: dict[Path, int] = {}
    for file, points in _chunks(files, colours is not None):
        pixels, tally = projector.project(points)
        image.add(pixels, len(points))
        if colours is not None and points.colour is not None:
            colours.add(pixels, points.colour, file.full_colour)
            brightest[file.path] = max(brightest.get(file.path, 0), int(points.colour.max(initial=0)))
        span.add(tally.nearest, tally.farthest, tally.outside, tally.lining)
        read += len(points)
        used += tally.used
        lost += tally.lost
        progress(0.9 * read / max(total, 1))
    if observer.radiometer:
        span.require(observer.radiometer)
    if not used:
        unposed = f": the scanner position of {lost:,} of its points is not known" if lost else ""
        raise UserError(
            f"no point of {', '.join(file.path.name for file in files)} is on the lining of kilometre {observer.km}{unposed}"
        )
    return {
        "files": len(files),
        "points_read": read,
        "points_used": used,
        **({"points_unposed": lost} if lost else {}),
        **({"points_outside_curve": span.outside} if span.outside else {}),
        **({"colours_cut": cut} if (cut := _cut(files, brightest)) else {}),
    }


def _cut(files: list[ScanSource], brightest: Mapping[Path, int]) -> list[str]:
    """Return notes on the files with colours brighter than full colour."""
    return [
        f"{file.path.name}: colours up to {brightest[file.path]} are shown as {file.full_colour}, because a sample of the file"
        " has 8 bits"
        for file in files
        if brightest.get(file.path, 0) > file.full_colour
    ]


def _chunks(files: list[ScanSource], colours: bool) -> Iterator[tuple[ScanSource, Points]]:
    size = CHUNK if threads() == 1 else 4 * CHUNK * threads()  # so that each thread has chunks to decode
    for file in files:
        coloured = colours and file.full_colour > 0
        for points in read_chunks(file.path, file.dimension, size, file.ranges, units=file.units, colours=coloured):
            yield file, points


@dataclass
class Projector:
    """Input of the kernel, prepared once for a kilometre; `project` processes chunk after chunk."""

    shape: SurfaceArrays
    faces: EdgeArrays
    scanner: PoseArrays
    optics: CorrectionArrays
    target: PixelTarget
    pixels: Pixels

    @classmethod
    def of(cls, observer: Observer, grid: Grid, roughness: float) -> Projector:
        """Prepare the projector for an image; ``roughness`` in degrees."""
        s, edges, floor = observer.surface, observer.edges, observer.floor
        scanned = grid.columns_between(*observer.ends)
        return cls(
            SurfaceArrays(s.segments, s.number, s.ends, s.chainages, s.radius, s.arcs, s.reach),
            EdgeArrays(bool(edges.sharp.any()), edges.start, edges.first, edges.feet, edges.normals, edges.sharp),
            _scanner(observer),
            _optics(observer, roughness),
            PixelTarget(
                observer.box[0],
                observer.box[1],
                observer.limits,
                grid.west,
                1.0 / grid.pixel,
                grid.bottom,
                grid.rows,
                max(grid.near.start, scanned.start),
                min(grid.near.stop, scanned.stop),
                grid.inner.start,
                grid.inner.stop,
                float(floor.start),
                floor.left,
                floor.right,
            ),
            Pixels.empty(0),
        )

    def project(self, points: Points) -> tuple[Pixels, ProjectionCounts]:
        """Find the pixels of a chunk of points; the result is overwritten by the next chunk."""
        if len(self.pixels.row) < len(points):
            self.pixels = Pixels.empty(len(points))
        tally = project(
            self.shape,
            self.faces,
            self.scanner,
            self.optics,
            self.target,
            points.xyz,
            points.time,
            points.scan_id,
            points.intensity,
            self.pixels,
        )
        return self.pixels, tally


def _scanner(observer: Observer) -> PoseArrays:
    if observer.radiometer is None:
        return PoseArrays(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)), np.inf)
    poses = observer.radiometer.poses
    return PoseArrays(poses.scan_id, poses.station, poses.time, poses.track, poses.longest)


def _optics(observer: Observer, roughness: float) -> CorrectionArrays:
    nothing = np.zeros(0)
    if observer.radiometer is None:
        return CorrectionArrays(False, False, nothing, nothing, -np.inf, np.inf, nothing)
    radiometer, curve = observer.radiometer, observer.radiometer.reference
    low, high = curve.span if curve else (-np.inf, np.inf)
    return CorrectionArrays(
        True,
        radiometer.kind == "linear",
        curve.range_m if curve else nothing,
        curve.intensity_db if curve else nothing,
        low,
        high,
        incidence_db(np.arange(COSINES + 1) / COSINES, roughness),
    )
