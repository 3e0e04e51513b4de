"""Selection of the points of one scan file for the database.

Only points that may get a row are examined closely. Of each voxel of thinning and each chunk of the file, the point nearest
to the voxel's centre is a candidate. On a dense wall, enough points of the chunk lie around it to show that it is not noise;
the other points of the voxel can then be skipped at once. Otherwise all of them stay candidates until the whole file is
read; then those nearer to the centre than the nearest certain point are classified.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy  # its modules are imported on first use: they take long

from tunneldb.arrays import Bool, Float, Int32, Int64, Intp, Single
from tunneldb.errors import InputError
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.misplacement import explain_misplacement
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.units import IN_METRES, Units
from tunneldb.pointcloud.beyond_ends import BeyondEnds
from tunneldb.pointcloud.block_times import BlockTimes
from tunneldb.pointcloud.chainage_lookup import STRETCHING, ChainageLookup
from tunneldb.pointcloud.formats.raw import read_raw
from tunneldb.pointcloud.noise import DIAMETER, POINTS, is_noise, search_radii, typical_density
from tunneldb.pointcloud.points import CHUNK, Points, on_earth
from tunneldb.pointcloud.pose_coverage import PoseCoverage, PoseFaults
from tunneldb.pointcloud.pose_sample import PoseSample, SampledPoints
from tunneldb.pointcloud.prefetch import in_order, prefetch
from tunneldb.pointcloud.spool import BINS_PER_KM, BINS_PER_METRE, PLACE, Rows, Spool, bin_of, rows_xyz, windows
from tunneldb.pointcloud.thinning import first_of_voxels, pick, voxel_edge
from tunneldb.pointcloud.units import NOT_GIVEN, GivenUnits
from tunneldb.pointcloud.voxels import CellCounts
from tunneldb.threads import threads

Progress = Callable[[int], None]
CheckPoses = Callable[[SampledPoints], str | None]

MEMORY = 192 << 20  # bytes of rows that each spool keeps in memory before it uses the disk
WINDOW = 500_000  # points whose neighbourhoods a thread examines at a time
MAX_PARALLEL_POINTS = 4_000_000  # points of a window from which one thread is used, to limit memory
BLOCK = 50_000  # points of a LAZ file that can be decoded separately
MARGIN = 18.0  # m beyond the ends of a kilometre that are also read from a file
MAX_SPARSE_POINTS = 150  # points in a cell up to which hardly any has enough neighbours to be certain not to be noise
SAMPLE_STEP = 1000  # one in this many intensities is kept as a sample
STRETCH = 5.0  # m of tunnel for which the noise filter's widest radius is computed
CERTAIN_TAG = -1  # tag of a candidate that is certain not to be noise; others have the number of their cell


@dataclass(frozen=True)
class FilterSettings:
    """Parameters of the selection of points.

    Attributes
    ----------
    density : float or None
        Survey density, points per m²; None to keep every point.
    noise_points : int
        Least number of points in the neighbourhood of a point, itself included, that is not noise.
    noise_diameter : float
        Diameter of the neighbourhood at full density, m.
    max_distance : float
        Distance from the given axis beyond which points are outside, m.
    max_left_out : float
        Greatest share of the points near the axis that may be invalid or without a scanner position.
    units : GivenUnits
        Units of the files' coordinates as given by the user.
    """

    density: float | None = 100.0
    noise_points: int = POINTS
    noise_diameter: float = DIAMETER
    max_distance: float = 25.0
    max_left_out: float = 0.05
    units: GivenUnits = NOT_GIVEN

    @property
    def edge(self) -> float | None:
        """Voxel edge for thinning, m; None if every point is kept."""
        return None if self.density is None else voxel_edge(self.density)


@dataclass
class FilterCounts:
    """Counts of the points of a file: points = invalid + outside + unposed + noise + thinned + kept.

    Attributes
    ----------
    points, invalid, outside, unposed, noise, kept : int
        Points read; without a finite coordinate, or a required finite time or intensity; beyond the ends of the axis or too
        far from it; with unknown scanner position; noise; kept after thinning.
    chainage : (float, float)
        Least and greatest chainage of the points kept, m; infinite if there is none.
    extent : (6,) float64 array
        Least and greatest x, y, z of the points kept: x0, y0, z0, x1, y1, z1, m.
    box : (6,) float64 array
        The same of all points with a finite coordinate.
    beyond : (int, int)
        Points outside before the start of the axis, and after its end, where the tunnel may continue.
    beyond_reach : (float, float)
        Distance beyond the ends within which nearly all of these lie, m.
    intensities : list of float32 arrays
        Sample of raw intensities near the axis.
    ranges : dict of int to list of (int, int)
        Ranges of point indices, from 0, that contain the points of each kilometre and of MARGIN beyond it.
    pose_note : str or None
        Doubt about the scanner positions of the points.
    seconds : dict of int to list of (int, int)
        Half-open ranges of whole seconds that contain all finite times of the points in these ranges.
    density : float
        Points per m² of surface that about half of the points near the axis have around them, noise included.
    """

    points: int = 0
    invalid: int = 0
    outside: int = 0
    unposed: int = 0
    noise: int = 0
    kept: int = 0
    chainage: tuple[float, float] = (math.inf, -math.inf)
    extent: Float = field(default_factory=lambda: np.array([np.inf] * 3 + [-np.inf] * 3))
    box: Float = field(default_factory=lambda: np.array([np.inf] * 3 + [-np.inf] * 3))
    ranges: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    seconds: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    beyond: tuple[int, int] = (0, 0)
    beyond_reach: tuple[float, float] = (0.0, 0.0)
    intensities: list[Single] = field(default_factory=list)
    density: float = 0.0
    pose_note: str | None = None

    @property
    def intensity_sample(self) -> Single:
        """About one in a thousand of the raw intensities near the axis."""
        return np.concatenate(self.intensities) if self.intensities else np.empty(0, np.float32)

    @property
    def thinned(self) -> int:
        """Number of points removed by thinning."""
        return self.points - self.invalid - self.outside - self.unposed - self.noise - self.kept

    def enclose(self, xyz: Float) -> None:
        """Extend the box of all points by a chunk (n, 3)."""
        low, high = xyz.min(axis=0, initial=np.inf), xyz.max(axis=0, initial=-np.inf)
        if not on_earth(np.concatenate([low, high])).all():  # also NaN
            valid = xyz[on_earth(xyz).all(axis=1)]
            low, high = valid.min(axis=0, initial=np.inf), valid.max(axis=0, initial=-np.inf)
        np.minimum(self.box[:3], low, out=self.box[:3])
        np.maximum(self.box[3:], high, out=self.box[3:])

    def locate(self, blocks: Int64, low: Float, high: Float) -> None:
        """Record the places of kilometres in the file: blocks of BLOCK points, with start and end chainage of each, m."""
        lowest, highest = (np.floor(ends / KILOMETRE).astype(int).tolist() for ends in (low - MARGIN, high + MARGIN))
        for block, first, last in zip(blocks.tolist(), lowest, highest, strict=True):
            for km in range(first, last + 1):
                ranges = self.ranges.setdefault(km, [])
                if ranges and ranges[-1][1] >= block * BLOCK:
                    ranges[-1] = (ranges[-1][0], (block + 1) * BLOCK)
                else:
                    ranges.append((block * BLOCK, (block + 1) * BLOCK))

    def keep(self, rows: Rows) -> None:
        """Count rows that are kept."""
        self.kept += len(rows)
        if len(rows):
            low, high = float(rows["chainage"].min()), float(rows["chainage"].max())
            self.chainage = (min(self.chainage[0], low), max(self.chainage[1], high))
            for column, name in enumerate("xyz"):
                self.extent[column] = min(self.extent[column], rows[name].min())
                self.extent[column + 3] = max(self.extent[column + 3], rows[name].max())


def filter_file(
    path: Path,
    dimension: str | None,
    alignment: Alignment,
    poses: PoseCoverage,
    settings: FilterSettings,
    survivors: Spool,
    tag: int,
    progress: Progress = lambda points: None,
    memory: int = MEMORY,
    chunk: int = CHUNK,
    check_poses: CheckPoses | None = None,
    units: Units = IN_METRES,
) -> FilterCounts:
    """Read a scan file at full density and store the points selected for the database.

    The whole file is read before points are classified, so the result does not depend on the order of its points.

    Parameters
    ----------
    path, dimension : Path and str or None
        File and its intensity dimension.
    alignment : Alignment
        Given axis, which defines the chainage.
    poses : PoseCoverage
        Available scanner positions.
    settings : FilterSettings
        Parameters of noise filter and thinning, and greatest distance from the axis.
    survivors : Spool
        Receives the selected points, with `tag`; they are thinned within the file up to the borders of its parts, and must be
        thinned once more together with other files.
    tag : int
        Number of the file.
    progress : callable
        Function of a number of points; the total is twice the number of points of the file.
    memory, chunk : int
        Bytes of rows in memory; points read at a time.
    check_poses : callable or None
        Function of a sample of the points near the axis; it returns a doubt about their scanner positions, or raises an error.
    units : Units
        Units of the file's coordinates.

    Raises
    ------
    InputError
        If the file cannot be read, no point is near the axis (states their distance), all near it are noise, or the share of
        points near the axis that are invalid or without scanner position exceeds ``max_left_out``.
    """
    with _Filter(path, dimension, alignment, poses, settings, memory, units) as work:
        work.read(progress, chunk, check_poses)
        for rows in work.judge(progress):
            rows["tag"] = tag
            survivors.add(rows)
    if work.counts.kept == 0:
        raise InputError(
            f"{path}: all {work.counts.noise} points near the axis are noise: none has {settings.noise_points} points around it"
        )
    return work.counts


def voxel_reach(edge: float) -> float:
    """Return the greatest difference of chainage between two points of one voxel, m."""
    return edge * math.sqrt(3.0) * STRETCHING


class _Filter:
    """File in progress: its candidates, and the places of all its points by chainage."""

    def __init__(
        self,
        path: Path,
        dimension: str | None,
        alignment: Alignment,
        poses: PoseCoverage,
        settings: FilterSettings,
        memory: int,
        units: Units,
    ) -> None:
        self.path, self.dimension, self.units = path, dimension, units
        self.poses, self.settings = poses, settings
        self.counts, self.cells = FilterCounts(), CellCounts()
        self.faults, self.invalid = PoseFaults(), ""
        self.places = ChainageLookup(alignment, settings.max_distance, self.cells.edge)
        self.beyond = BeyondEnds(alignment, settings.max_distance)
        self.times, self.sample = BlockTimes(BLOCK), PoseSample()
        self.rows, self.cloud = Spool(memory // 2), Spool(memory // 2, PLACE)

    def __enter__(self) -> _Filter:
        return self

    def __exit__(self, *_: object) -> None:
        self.rows.close()
        self.cloud.close()

    def read(self, progress: Progress, chunk: int, check_poses: CheckPoses | None) -> None:
        """Read the file, and store the points that the noise filter has to examine."""
        counts, nearest, guess = self.counts, math.inf, None
        with closing(prefetch(map(Points.of, read_raw(self.path, self.dimension, chunk, units=self.units)))) as chunks:
            for points in chunks:
                self._set_aside(points)
                if counts.outside and counts.outside + counts.invalid == counts.points:
                    vertices = self.places.alignment.vertices
                    some = points.xyz[np.isfinite(points.xyz).all(axis=1)][::100]
                    nearest = min(nearest, float(scipy.spatial.cKDTree(vertices).query(some)[0].min(initial=math.inf)))
                    if guess is None and len(some):
                        guess = explain_misplacement(some, vertices, self.settings.max_distance)
                progress(len(points))
        counts.beyond, counts.beyond_reach = self.beyond.points, self.beyond.reach
        for ranges in counts.ranges.values():
            ranges[-1] = (ranges[-1][0], min(ranges[-1][1], counts.points))
        counts.seconds = {km: self.times.seconds(ranges) for km, ranges in counts.ranges.items()}
        if counts.outside and counts.outside + counts.invalid == counts.points:
            check = "check the axis, the file's coordinates and the tunnel's SRID"
            raise InputError(
                f"{self.path}: no points near the axis: the nearest is about {nearest:.0f} m from it, the limit is "
                f"{self.settings.max_distance:g} m; {guess or check}"
            )
        if check_poses is not None:
            counts.pose_note = check_poses(self.sample.points)
        self._require_most()

    def _require_most(self) -> None:
        """Refuse the file if too many of its points near the axis are left out."""
        counts = self.counts
        near = counts.points - counts.outside
        nothing = counts.invalid + counts.unposed == near
        for count, reason in ((counts.invalid, self.invalid), (counts.unposed, self.faults.text())):
            if count > self.settings.max_left_out * near or (nothing and count):
                raise InputError(
                    f"{self.path}: {reason} ({100.0 * count / near:.3g} % of the points near the axis; "
                    f"--max-left-out {100.0 * self.settings.max_left_out:g} allows less)"
                )

    def _set_aside(self, points: Points) -> None:
        """Store the points of a chunk that are near the axis and have a known scanner position."""
        self.times.add(self.counts.points, points.time)
        number = np.arange(self.counts.points, self.counts.points + len(points))
        self.counts.points += len(points)
        self.counts.enclose(points.xyz)
        finite = points.finite(time=self.poses.mobile, intensity=self.dimension is not None)
        if finite is not None:
            self._note_invalid(points, number, finite)
            number, points = number[finite], points.some(finite)
            if not len(points):
                return
        cell = self.cells.add(points.xyz)
        self.places.update(self.cells)
        outside = self.places.outside(points, cell)
        self.counts.outside += len(outside)
        if len(outside):
            self.beyond.add(points.xyz[outside])
            number, cell, points = self._drop(number, cell, points, outside)
        self.sample.add(points.xyz, points.time, points.scan_id)
        faults = self.poses.faults(points)
        if faults:
            self.faults += faults
            self.counts.unposed += faults.points
            number, cell, points = self._drop(number, cell, points, np.flatnonzero(~self.poses.known(points)))
        if len(points):
            self.counts.intensities.append(points.intensity[::SAMPLE_STEP].copy())
            self.counts.locate(*self.places.span(number, cell, BLOCK))
            picked, certain = self._pick(points, cell)
            tag = np.where(certain, np.int32(CERTAIN_TAG), cell[picked])
            self.rows.add(self.places.rows(points, cell, picked, tag))
            self.cloud.add(points.xyz.view(PLACE).ravel(), self.places.bin[cell])

    def _drop(self, number: Int64, cell: Int32, points: Points, dropped: Intp) -> tuple[Int64, Int32, Points]:
        """Remove some points from a chunk and from the counts of their cells."""
        self.cells.remove(cell[dropped])
        kept = np.delete(np.arange(len(points)), dropped)
        return number[kept], cell[kept], points.some(kept)

    def _note_invalid(self, points: Points, number: Int64, finite: Bool) -> None:
        """Count the points of a chunk that are not finite, and record the number of the first."""
        self.counts.invalid += int(np.count_nonzero(~finite))
        if not self.invalid:
            first = int(np.argmin(finite))
            which = ("a coordinate" if not on_earth(points.xyz[first]).all()
                     else "gps_time" if not np.isfinite(points.time[first]) and self.poses.mobile
                     else self.dimension)  # fmt: skip
            self.invalid = f"{which} is NaN or infinite, first at point {number[first] + 1}; remove the point"

    def _pick(self, points: Points, cell: Int32) -> tuple[Int32, Bool]:
        if self.settings.edge is None or self.cells.counts[cell].mean() < MAX_SPARSE_POINTS:
            return np.arange(len(points), dtype=np.int32), np.zeros(len(points), np.bool_)
        return pick(
            points.xyz, points.time, points.intensity, points.scan_id, points.classification, self.places.whole[cell],
            self.settings.edge, (self.settings.noise_diameter / 2) ** 2, self.settings.noise_points,
        )  # fmt: skip

    def judge(self, progress: Progress) -> Iterator[Rows]:
        """Yield the rows that are kept, thinned within the file, one window of chainage after the other."""
        counts, cells, settings = self.counts, self.cells, self.settings
        stretch = np.floor(self.places.chainage / STRETCH).astype(np.int64)
        counts.density = typical_density(cells.counts, cells.edge)
        radii = search_radii(cells.counts, cells.edge, settings.noise_points, settings.noise_diameter, stretch)
        widest = _widest(stretch, radii)
        first, bins = self.cloud.counts()
        # A point's bin may differ from its cell's by some bins.
        bins, first = np.pad(bins, self.places.bins_off), first - self.places.bins_off
        parts = list(windows(first, bins, WINDOW))
        crowded = max(int(bins[low - first : high - first].sum()) for low, high in parts) > MAX_PARALLEL_POINTS

        def work(low: int, high: int) -> tuple[int, Rows]:
            return self._judge(low, high, _reach(low, high, widest), radii)

        for (low, high), (noise, rows) in zip(parts, in_order(1 if crowded else threads(), work, parts), strict=True):
            counts.noise += noise
            counts.keep(rows)
            progress(int(bins[low - first : high - first].sum()))
            yield rows
        progress(counts.points - counts.noise - counts.kept - counts.thinned)

    def _judge(self, low: int, high: int, reach: int, radii: Float) -> tuple[int, Rows]:
        """Return the number of noise points of a window, and the rows that are kept."""
        edge = self.settings.edge
        margin = 0 if edge is None else math.ceil(voxel_reach(edge) * BINS_PER_METRE)
        begin = math.floor(low / BINS_PER_KM) * BINS_PER_KM  # each kilometre is thinned separately
        rows = self.rows.read(max(low - margin, begin), min(high + margin, begin + BINS_PER_KM))
        wide = margin + reach + self.places.bins_off
        good = rows["tag"] == CERTAIN_TAG

        def judge(doubtful: Bool) -> None:
            chosen = np.flatnonzero(doubtful)
            if len(chosen):
                cloud = self.cloud.read(low - wide, high + wide)["xyz"]
                radius = radii[rows["tag"][chosen]]
                good[chosen] = ~is_noise(cloud, rows_xyz(rows, chosen), radius, self.settings.noise_points)

        if edge is None:
            judge(~good)
            stays, noise = good, ~good
        else:
            # The first point of each voxel is mostly good; then the others need not be examined.
            front, _ = first_of_voxels(rows, edge, np.ones(len(rows), np.bool_))
            judge(front & ~good)
            stays, noise = first_of_voxels(rows, edge, good)
            rest = noise & ~front
            if rest.any():
                judge(rest)
                part = np.flatnonzero(stays | noise)
                stays[part], noise[part] = first_of_voxels(rows[part], edge, good[part])
        bins = bin_of(rows["chainage"])
        inside = (bins >= low) & (bins < high)
        return int((noise & inside).sum()), rows[stays & inside]


def _widest(stretch: Int64, radii: Float) -> tuple[int, Float]:
    """Return the widest radius in each stretch from the first on."""
    first = int(stretch.min())
    widest = np.zeros(int(stretch.max()) - first + 1)
    np.maximum.at(widest, stretch - first, radii)
    return first, widest


def _reach(low: int, high: int, widest: tuple[int, Float]) -> int:
    """Return the number of bins beyond a window in which its points may have neighbours."""
    first, radii = widest
    # A point's cell may have its centre in the next stretch.
    begin = math.floor(low / BINS_PER_METRE / STRETCH) - 1 - first
    end = math.floor(high / BINS_PER_METRE / STRETCH) + 2 - first
    near = radii[max(begin, 0) : max(end, 1)]
    radius = float(near.max()) if len(near) else float(radii.max())
    return math.ceil(radius * STRETCHING * BINS_PER_METRE)
