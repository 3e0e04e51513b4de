"""From scan files at full density to the sums of a kilometre's image."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tunneldb.errors import UserError
from tunneldb.pointcloud.reader import Points, Source, read_chunks
from tunneldb.radiometry.oren_nayar import incidence_db
from tunneldb.radiometry.reference_curve import SPAN_TOLERANCE
from tunneldb.raster.accumulator import Accumulator
from tunneldb.raster.grid import Grid
from tunneldb.raster.observation import Eye, Span
from tunneldb.raster.projection import COSINES, Faces, Optics, Pixels, Scanner, Shape, Tally, Target, look
from tunneldb.threads import threads

Counts = dict[str, Any]

CHUNK = 50_000
"""Points read at a time by one thread: a chunk of most LAZ files, and few enough to stay in the processor's cache."""


def gather(eye: Eye, files: list[Source], image: Accumulator, roughness: float, progress: Callable[[float], None]) -> Counts:
    """Read the files and put their points into the image.

    Parameters
    ----------
    eye : Eye
        The kilometre, and how its points are seen.
    files : list of Source
        What to read.
    image : Accumulator
        Gets the points.
    roughness : float
        Of the lining, degrees.
    progress : callable
        Takes the share that is done, 0 to 0.9.

    Raises
    ------
    UserError
        If a file can't be read, the scanner position of a point is unknown, lining points lie outside the reference curve
        or no point lies on the lining.
    """
    total, read, used = sum(file.points for file in files), 0, 0
    span = Span()
    lens = Lens.of(eye, image.grid, roughness)
    reference = eye.radiometer.reference if eye.radiometer else None
    for path, points in _chunks(files):
        pixels, tally = lens.look(points)
        if tally.lost:
            assert eye.radiometer is not None
            raise eye.radiometer.poses.faults(eye.near(points)).error(path.name)
        image.add(pixels, len(points))
        span.add(tally.nearest, tally.farthest, tally.outside, tally.lining)
        read += len(points)
        used += tally.used
        progress(0.9 * read / max(total, 1))
    if reference:
        span.require(reference)
    if not used:
        raise UserError(f"no point of {', '.join(file.path.name for file in files)} lies on the lining of kilometre {eye.km}")
    return {"files": len(files), "points_read": read, "points_used": used}


def _chunks(files: list[Source]) -> Iterator[tuple[Path, Points]]:
    size = CHUNK if threads() == 1 else 4 * CHUNK * threads()  # so that each thread has chunks to decode
    for file in files:
        for points in read_chunks(file.path, file.dimension, size, file.ranges):
            yield file.path, points


@dataclass
class Lens:
    """What the kernel needs, prepared once for a kilometre; `look` takes chunk after chunk."""

    shape: Shape
    faces: Faces
    scanner: Scanner
    optics: Optics
    target: Target
    pixels: Pixels

    @classmethod
    def of(cls, eye: Eye, grid: Grid, roughness: float) -> Lens:
        """Prepare it for an image; ``roughness`` in degrees."""
        s, edges, floor = eye.surface, eye.edges, eye.floor
        return cls(
            Shape(s.segments, s.number, s.ends, s.chainages, s.radius, s.arcs, s.reach),
            Faces(bool(edges.sharp.any()), edges.start, edges.first, edges.feet, edges.normals, edges.sharp),
            _scanner(eye),
            _optics(eye, roughness),
            Target(
                eye.box[0],
                eye.box[1],
                eye.tolerance,
                eye.recess,
                grid.west,
                1.0 / grid.pixel,
                grid.bottom,
                grid.rows,
                grid.near.start,
                grid.near.stop,
                grid.inner.start,
                grid.inner.stop,
                float(floor.start),
                floor.left,
                floor.right,
            ),
            Pixels.empty(0),
        )

    def look(self, points: Points) -> tuple[Pixels, Tally]:
        """Find the pixels of a chunk of points; what is returned is overwritten by the next chunk."""
        if len(self.pixels.row) < len(points):
            self.pixels = Pixels.empty(len(points))
        tally = look(
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


def _scanner(eye: Eye) -> Scanner:
    if eye.radiometer is None:
        return Scanner(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)))
    poses = eye.radiometer.poses
    return Scanner(poses.scan_id, poses.station, poses.time, poses.track)


def _optics(eye: Eye, roughness: float) -> Optics:
    nothing = np.zeros(0)
    if eye.radiometer is None:
        return Optics(False, False, nothing, nothing, -np.inf, np.inf, nothing, 0.0, np.inf)
    radiometer, curve = eye.radiometer, eye.radiometer.reference
    return Optics(
        True,
        radiometer.kind == "linear",
        curve.range_m if curve else nothing,
        curve.intensity_db if curve else nothing,
        float(curve.range_m[0]) - SPAN_TOLERANCE if curve else -np.inf,
        float(curve.range_m[-1]) + SPAN_TOLERANCE if curve else np.inf,
        incidence_db(np.arange(COSINES + 1) / COSINES, roughness),
        float(np.cos(np.radians(radiometer.max_incidence))),
        radiometer.max_range,
    )
