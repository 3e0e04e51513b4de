"""Members, faces and spots of scan files, in three passes over their points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import chain, repeat
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float, Int32, Int64, Single, UInt32
from tunneldb.counted import counted
from tunneldb.errors import UserError
from tunneldb.geometry.crs import describe_crs
from tunneldb.geometry.units import IN_METRES, Units
from tunneldb.pointcloud.formats.faults import require_dimension
from tunneldb.pointcloud.formats.table import has_scans
from tunneldb.pointcloud.points import Points, ScanHeader
from tunneldb.pointcloud.poses import PoseModel
from tunneldb.pointcloud.prefetch import prefetch
from tunneldb.pointcloud.reader import read_chunks, read_header
from tunneldb.pointcloud.stations import read_stations
from tunneldb.pointcloud.units import NOT_GIVEN, GivenUnits, in_units, unit_faults
from tunneldb.progress import StartProgress
from tunneldb.radiometry.cells import IntensitySamples
from tunneldb.radiometry.correction import Kind, needs_reference, to_decibel
from tunneldb.radiometry.intensity_kind import contradiction, doubt
from tunneldb.radiometry.range_curve import ADVICE, estimate_range_curve
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.structures.contrast import observe_face
from tunneldb.structures.face_raster import Sums
from tunneldb.structures.find import Found, find_structures
from tunneldb.structures.joining import RangeImages
from tunneldb.structures.models import to_space
from tunneldb.structures.segmentation import Segmentation, find_faces
from tunneldb.structures.voxel_moments import REACH, SCANS, VoxelMoments

AUTO = "auto"

SATURATED = 0.5
"""Share of points with the greatest value from which an intensity is unusable."""

UNKNOWN = 0.01
"""Maximum share of points without a scanner position that may be left out."""

_WITHOUT = "the level of a flat face depends on incidence, which determines the range there, that of a pipe on both"

AT_ONCE = 250_000
"""Number of points read and written at a time: voxels and faces need the memory."""

_SAMPLES = 400_000
_SAMPLE_OF_VALUES = 100_000


@dataclass(frozen=True)
class Inputs:
    """Input of the search for members.

    Attributes
    ----------
    paths : tuple of Path
        Scan files, of one coordinate system and one numbering of scans.
    dimension : str
        Dimension of the intensity.
    kind : {'amplitude', 'reflectance', 'linear'}
    poses : PoseModel
        Stations.
    reference : ReferenceCurve or 'auto' or None
        Curve for correcting levels for range.
    units : tuple of Units
        Units of each file's coordinates; empty: all are in metres.
    """

    paths: tuple[Path, ...]
    dimension: str
    kind: Kind
    poses: PoseModel
    reference: ReferenceCurve | str | None
    units: tuple[Units, ...] = ()

    @property
    def name(self) -> str:
        """Return the name of all files for errors."""
        return (
            str(self.paths[0]) if len(self.paths) == 1 else f"{self.paths[0]} and {counted(len(self.paths) - 1, 'more file')}"
        )


@dataclass(frozen=True)
class FileMembers:
    """Result of the search in files.

    Attributes
    ----------
    found : Found
    segmentation : Segmentation
    points, far, unknown, untold : int
        Points; those left out for lying too far away, for lack of a scanner position, and those whose intensity is no number.
    saturated : float
        Share of the points with the greatest intensity of all.
    notes : tuple of str
    """

    found: Found
    segmentation: Segmentation
    points: int
    far: int
    unknown: int
    untold: int
    saturated: float
    notes: tuple[str, ...]


def find_members(inputs: Inputs, begin: StartProgress) -> FileMembers:
    """Find the members of scan files, their faces and spots.

    Memory grows with the surface that was scanned, not with the points.

    Parameters
    ----------
    inputs : Inputs
    begin : callable
        Called with a text and the number of points before each pass; returns a function that takes the points done.

    Raises
    ------
    UserError
        If the file cannot be read, is in degrees, has no usable intensity, or scans without a position.
    """
    of_files = zip(inputs.paths, inputs.units or repeat(None), strict=False)
    headers = [_usable(path, inputs.dimension, units) for path, units in of_files]
    total = sum(header.points for header in headers)
    values = _Values(inputs)
    moments = VoxelMoments(_middle(inputs.poses.station, headers))
    for points, scan in _read(inputs, values, begin("points", total)):
        moments.add(points.xyz, scan)
    values.require()
    moments.complete()
    if not len(moments):
        raise UserError(
            f"{inputs.name}: all points lie more than {REACH:g} m from the middle of the scanner positions, which is"
            f" {_place(moments.origin)}: are they in the file's coordinates?"
        )
    begin("faces", None)
    far = moments.far
    segmentation = find_faces(moments, inputs.poses.station)
    del moments
    sums, images = Sums.empty(segmentation.layout.size), RangeImages(segmentation.stations)
    progress = begin("intensity", total)
    for points, scan in _read(inputs, None, progress):
        level = to_decibel(points.intensity, inputs.kind).astype(np.float32)
        segmentation.finder.add(points.xyz, scan, level, sums)
        images.add(points.xyz - segmentation.origin, scan)
    begin("spots", None)
    reference, note = _reference(inputs, segmentation, sums)
    by_range = needs_reference(inputs.kind) and reference is None
    found = find_structures(segmentation, sums, images, reference, by_range=by_range)
    notes = tuple(filter(None, [values.note, note]))
    return FileMembers(found, segmentation, values.count, far, values.unknown, values.untold, values.saturated, notes)


def _usable(path: Path, dimension: str, units: Units | None) -> ScanHeader:
    """Read the header of a file, and check that the file is usable; its units are known if it was loaded."""
    given = NOT_GIVEN if units is None else GivenUnits(units.plan, units.height)
    header = in_units(read_header(path), given)
    if header.crs is not None and header.crs.is_geographic:
        raise UserError(
            f"{path}: its coordinates are degrees, {describe_crs(header.crs)}, but structures are measured in metres;"
            " transform the file into a projected system"
        )
    if unit_faults(header):
        raise UserError(
            f"{path}: its coordinates are not in metres (tunneldb inspect {path}); transform the file, or load it with its"
            " --unit into a survey of a site: tunneldb members SURVEY"
        )
    require_dimension(path, dimension, header.dimensions, "--intensity")
    return header


def numbers_of_points(inputs: Inputs, members: FileMembers) -> Iterator[tuple[UInt32, UInt32, UInt32]]:
    """Yield face, member and spot of all points, in the order of the files, chunk by chunk; 0 is none."""
    finder, found = members.segmentation.finder, members.found
    for points, scan, use in read_all(inputs, lambda count: None):
        out = np.zeros((3, len(points)), np.uint32)
        face, pixel = finder.find(points.xyz[use], scan[use])
        out[:, use] = found.of_points(face, pixel)
        yield out[0], out[1], out[2]


def stations_for(path: Path, stations: list[Path]) -> PoseModel:
    """Return scanner positions, from the given files, or from the poses of an E57 or PTX file.

    Raises
    ------
    UserError
        If there is none.
    """
    if not stations and not has_scans(path):
        raise UserError(
            f"{path}: the scanner position is not in the file, but needed for incidence;"
            " give --stations FILE with scan_id,x,y,z"
        )
    read = read_stations(stations or [path])
    if len(read.scan_id) > SCANS:
        raise UserError(f"{path}: {len(read.scan_id)} stations, the maximum is {SCANS}; split the file")
    return PoseModel.from_stations(read.scan_id.astype(np.int64), read.xyz)


class _Values:
    """Statistics of the values of an intensity, summed chunk by chunk."""

    def __init__(self, inputs: Inputs) -> None:
        self.inputs = inputs
        self.count = self.untold = self.unknown = self.at_most = 0
        self.least, self.most = np.inf, -np.inf
        self.sample: list[Single] = []

    def add(self, points: Points, known: int) -> None:
        value = points.intensity
        self.count += len(value)
        self.unknown += len(value) - known
        finite = value[np.isfinite(value)]
        self.untold += len(value) - len(finite)
        if not len(finite):
            return
        most = float(finite.max())
        if most > self.most:
            self.most, self.at_most = most, 0
        if most == self.most:
            self.at_most += int(np.count_nonzero(finite == most))
        self.least = min(self.least, float(finite.min()))
        if len(self.sample) < 20:
            self.sample.append(finite[:: max(1, len(finite) * 20 // _SAMPLE_OF_VALUES)].copy())

    @property
    def saturated(self) -> float:
        return self.at_most / max(self.count, 1)

    @property
    def note(self) -> str | None:
        """Return doubts about the values."""
        return doubt(self.inputs.kind, np.concatenate(self.sample)) if self.sample else None

    def require(self) -> None:
        """Raise a UserError if the values are unusable."""
        what = f"{self.inputs.name}: {self.inputs.dimension}"
        if not np.isfinite(self.most):
            raise UserError(f"{what}: no value is a number; choose another --intensity")
        if self.least == self.most:
            raise UserError(f"{what}: all values are {self.most:g}; choose another --intensity")
        if self.saturated > SATURATED:
            raise UserError(
                f"{what} is saturated: {100 * self.saturated:.0f} % of the points have its greatest value, {self.most:g};"
                " choose another --intensity, or scan with less gain"
            )
        wrong = contradiction(self.inputs.kind, np.concatenate(self.sample)) if self.sample else None
        if wrong:
            raise UserError(f"{what} is not {self.inputs.kind}: {wrong}")


def _read(inputs: Inputs, values: _Values | None, progress: Callable[[float], None]) -> Iterator[tuple[Points, Int32]]:
    """Return points with a known scanner position, with the index of their scan among the stations."""
    for points, scan, use in read_all(inputs, progress):
        if values is not None:
            values.add(points, int(use.size))
            _refuse_unknown(inputs, points, values)
        yield (points, scan) if len(use) == len(points) else (points.some(use), scan[use])


def _refuse_unknown(inputs: Inputs, points: Points, values: _Values) -> None:
    if values.unknown > max(UNKNOWN * values.count, 1000):
        raise UserError(f"{inputs.name}: {inputs.poses.coverage.faults(points).text() or 'points without a scanner position'}")


def read_all(
    inputs: Inputs, progress: Callable[[float], None], *, colours: bool = False
) -> Iterator[tuple[Points, Int32, Int64]]:
    """Return all points, the index of their scan among the stations, and which of them have one."""
    ids = inputs.poses.scan_id
    of_files = zip(inputs.paths, inputs.units or repeat(IN_METRES), strict=False)
    files = chain.from_iterable(
        read_chunks(path, inputs.dimension, AT_ONCE, units=units, colours=colours) for path, units in of_files
    )
    with closing(prefetch(files)) as chunks:
        for points in chunks:
            scan = np.minimum(np.searchsorted(ids, points.scan_id), len(ids) - 1).astype(np.int32)
            yield points, scan, np.flatnonzero(ids[scan] == points.scan_id)
            progress(len(points))


def _reference(inputs: Inputs, segmentation: Segmentation, sums: Sums) -> tuple[ReferenceCurve | None, str | None]:
    """Return the curve for correcting levels, and a note."""
    if not needs_reference(inputs.kind):
        return None, None
    if isinstance(inputs.reference, ReferenceCurve):
        return inputs.reference, None
    if inputs.reference is None:
        return None, f"no reference curve: {_WITHOUT}; use --reference auto to estimate it from the faces"
    try:
        found = estimate_range_curve(_samples(segmentation, sums), unrolled=False)
        found.require()
    except UserError as error:
        why = str(error).removesuffix(f"; {ADVICE}").replace("lining", "surface")
        return None, f"no reference curve could be found from the faces ({why}), so none is used: {_WITHOUT}"
    return found.curve, f"reference curve found from the faces, {found.nearest:.1f} to {found.farthest:.1f} m"


def _samples(segmentation: Segmentation, sums: Sums) -> IntensitySamples:
    """Return pixels of all faces as samples of intensity over range and incidence."""
    layout = segmentation.layout
    step = max(1, int(np.count_nonzero(sums.count)) // _SAMPLES)
    place: list[Float] = []
    scans, ranges, cosines, levels = [], [], [], []
    for face in range(len(layout.models)):
        u, v = layout.centres(face)
        for seen in observe_face(layout, sums, face, segmentation.stations, None):
            row, column = np.divmod(seen.pixel[::step], len(u))
            place.append(to_space(layout.models[face], u[column], v[row]))
            scans.append(np.full(len(row), seen.scan, np.int32))
            ranges.append(seen.range_m[::step])
            cosines.append(np.cos(seen.angle[::step]))
            levels.append(seen.value[::step])
    return IntensitySamples(
        np.concatenate(place), np.concatenate(scans), np.concatenate(ranges), np.concatenate(cosines), np.concatenate(levels)
    )


def _middle(stations: Float, headers: Sequence[ScanHeader]) -> Float:
    """Return the middle of the scanner positions near the points' box: a list may include those of other files."""
    low = np.min([header.low for header in headers], axis=0)
    high = np.max([header.high for header in headers], axis=0)
    aside = np.maximum(low - stations, stations - high).max(axis=1)
    near = stations[aside < REACH]
    return np.asarray((near if len(near) else stations).mean(axis=0))


def _place(xyz: Float) -> str:
    return ", ".join(f"{value:.1f}" for value in xyz)
