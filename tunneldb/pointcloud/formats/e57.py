"""E57 files: their scans with poses, read in chunks of constant memory.

Needs pye57 (the extra ``e57``). Only its binding to libE57Format is used, since pye57 itself reads whole scans.

Source: ASTM E2807-11, Standard Specification for 3D Imaging Data Exchange, Version 1.0.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from itertools import islice, product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tunneldb.arrays import Bool, Float, UInt16
from tunneldb.errors import InputError, UserError
from tunneldb.pointcloud.formats.e57_counts import scan_name, surplus_notes
from tunneldb.pointcloud.formats.e57_xml import require_bounded_xml
from tunneldb.pointcloud.formats.faults import check_ranges, decoding, require_dimension
from tunneldb.pointcloud.formats.scans import scan_number
from tunneldb.pointcloud.points import CHUNK, Ranges, Raw, ScanHeader
from tunneldb.pointcloud.stated_crs import StatedCrs, stated_in_text

KIND = "an E57"
CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
COLOURS = ("colorRed", "colorGreen", "colorBlue")
NO_COLOUR = "isColorInvalid"
SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
MAX_BOUND = 1e8  # m; greater bounds are placeholders of an exporter


@dataclass(frozen=True)
class Scan:
    """One scan of an E57 file, from its header.

    Attributes
    ----------
    index : int
        Index in the file, from 0.
    name : str
        Name given by the exporter.
    number : int
        Result of `scan_number`.
    records : int
        Number of points, invalid ones included.
    fields : frozenset of str
        Fields of a point.
    rotation : (3, 3) float64 array
        Rotation from the scan's own frame to the file's.
    position : (3,) float64 array or None
        Scanner position (origin of the scan's own frame) in the file's frame, m; None if the scan has no pose.
    start : float or None
        Start of the scan, s of GPS time; None if not stated.
    """

    index: int
    name: str
    number: int
    records: int
    fields: frozenset[str]
    rotation: Float
    position: Float | None
    start: float | None

    @property
    def has_time(self) -> bool:
        """True if its points have a GPS time."""
        return "timeStamp" in self.fields and self.start is not None

    def has(self, dimension: str) -> bool:
        """Return True if its points have a dimension, under its name in the scan header."""
        return self.has_time if dimension == "gps_time" else dimension in self.fields

    def flags(self, dimension: str | None) -> list[str]:
        """Return the flag fields, which are 0 for valid points."""
        names = ["cartesianInvalidState" if self._cartesian else "sphericalInvalidState"]
        if dimension == "intensity":
            names.append("isIntensityInvalid")
        return [name for name in names if name in self.fields]

    @property
    def has_colours(self) -> bool:
        """True if its points have a colour."""
        return self.fields.issuperset(COLOURS)

    @property
    def coordinates(self) -> tuple[str, str, str]:
        """Names of the coordinate fields."""
        return CARTESIAN if self._cartesian else SPHERICAL

    @property
    def _cartesian(self) -> bool:
        return self.fields.issuperset(CARTESIAN)


def is_e57(path: Path) -> bool:
    """Return True if the suffix of a file is that of E57."""
    return path.suffix.lower() == ".e57"


def read_e57_scans(path: Path) -> list[Scan]:
    """Read the scans of an E57 file that contain points.

    Raises
    ------
    InputError
        If the file cannot be read or holds no points, or pye57 is missing.
    """
    with open_e57(path) as image, decoding(path, KIND):
        return scans_of(path, image)


def read_e57_header(path: Path) -> ScanHeader:
    """Read the header of an E57 file; see `tunneldb.pointcloud.reader.read_header`.

    The dimensions are ``intensity``, ``gps_time`` and fields of extensions (for example ``rlms:reflectance``) that all scans
    have. If a scan has no bounds, its points are read.
    """
    with open_e57(path) as image, decoding(path, KIND):
        scans = scans_of(path, image)
        boxes = [_box(image, scan) for scan in scans]
        stated = _stated_crs(image)
        notes = surplus_notes(path, _libe57(), image)
    return ScanHeader(
        path,
        sum(scan.records for scan in scans),
        tuple(_dimensions(scans)),
        stated,
        np.min([low for low, _ in boxes], axis=0),
        np.max([high for _, high in boxes], axis=0),
        notes=tuple(notes),
        tight=False,
    )


def _dimensions(scans: Sequence[Scan]) -> list[str]:
    """Return the dimensions, beside coordinates, that every scan has: those of the standard, then extensions (PREFIX:NAME)."""
    extensions = sorted(name for name in scans[0].fields if ":" in name)
    return [name for name in ("intensity", "gps_time", *extensions) if all(scan.has(name) for scan in scans)]


def read_e57(
    path: Path, dimension: str | None, size: int, ranges: Ranges | None = None, colours: bool = False
) -> Iterator[Raw]:
    """Read the valid points of an E57 file chunk by chunk; see `tunneldb.pointcloud.formats.raw.read_raw`.

    Points are numbered through all scans, without invalid ones. A scan before a range is skipped. Points before the range
    within a scan are decoded, for libE57Format cannot seek inside a scan.
    """
    with open_e57(path) as image:
        with decoding(path, KIND):
            scans = scans_of(path, image)
        names = _dimensions(scans)
        require_dimension(path, dimension, names)
        if dimension == "gps_time":
            raise InputError(f"{path}: gps_time cannot be the intensity; the file has {', '.join(names)}")
        records = sum(scan.records for scan in scans)
        requested = check_ranges(path, ranges, records)
        cursor = _Cursor(path, image, scans, dimension, size, colours)
        if ranges is None:
            yield from cursor.all()
            return
        for begin, end in requested:
            yield from cursor.read(begin, end)


def read_e57_beginnings(path: Path, scans: int, size: int) -> Iterator[Raw]:
    """Read the first `size` points of at most `scans` scans, spread evenly over an E57 file; less the invalid ones.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    with open_e57(path) as image, decoding(path, KIND):
        every = scans_of(path, image)
        for index in np.unique(np.linspace(0, len(every) - 1, min(scans, len(every))).astype(int)).tolist():
            yield from islice(_read_scan(image, every[index], None, size), 1)


class _Cursor:
    """Reader of valid points by index, which continues from the last one where possible."""

    def __init__(self, path: Path, image: Any, scans: Sequence[Scan], dimension: str | None, size: int, colours: bool) -> None:
        self.colours = colours
        self.path, self.image, self.scans, self.dimension, self.size = path, image, scans, dimension, size
        self.stream: Iterator[Raw] = iter(())
        self.piece: Raw | None = None
        self.at = self.stop = 0  # indices of the points of the piece

    def all(self) -> Iterator[Raw]:
        """Read the whole file."""
        good = 0
        for raw in self._from(0):
            good += len(raw)
            yield raw
        require_good(self.path, self.scans, good)

    def read(self, begin: int, end: int) -> Iterator[Raw]:
        """Read points begin to end, half-open."""
        if begin < end:
            self._go_to(begin)
        while begin < end:
            if begin < self.stop and self.piece is not None:
                raw = self.piece.part(begin - self.at, min(end, self.stop) - self.at)
                begin += len(raw)
                yield raw
                continue
            self.at = self.stop
            self.piece = next(self.stream, None)
            if self.piece is None:
                raise InputError(f"{self.path}: the file has changed: {self.at} valid points, points up to {end} requested")
            self.stop = self.at + len(self.piece)

    def _go_to(self, number: int) -> None:
        first, scan = 0, 0
        while scan + 1 < len(self.scans) and first + (good := self._good(scan)) <= number:
            first, scan = first + good, scan + 1
        if number < self.at or first >= self.stop:
            self.stream, self.piece, self.at, self.stop = self._from(scan), None, first, first

    def _good(self, scan: int) -> int:
        flags = tuple(self.scans[scan].flags(self.dimension))
        if not flags:
            return self.scans[scan].records
        status = self.path.stat()
        return _count_good(self.path, (status.st_size, status.st_mtime_ns), scan, flags)

    def _from(self, scan: int) -> Iterator[Raw]:
        for one in self.scans[scan:]:
            with decoding(self.path, KIND):
                yield from _read_scan(self.image, one, self.dimension, self.size, self.colours)


@cache
def _count_good(path: Path, version: tuple[int, int], scan: int, flags: tuple[str, ...]) -> int:
    """Count the valid points of a scan; `version` identifies the file's contents."""
    with open_e57(path) as image, decoding(path, KIND):
        one = scans_of(path, image)[scan]
        return sum(int(good_of(fields, flags).sum()) for fields in read_fields(image, one, flags, CHUNK))


def good_of(fields: dict[str, NDArray[Any]], flags: Sequence[str]) -> Bool:
    """Return True for points without a set flag."""
    return np.logical_and.reduce([fields[flag] == 0 for flag in flags])


def require_good(path: Path, scans: Sequence[Scan], good: int) -> None:
    """Raise a UserError if none of the points read was valid."""
    if not good:
        raise InputError(f"{path}: all {sum(scan.records for scan in scans)} points are marked as invalid")


def _read_scan(image: Any, scan: Scan, dimension: str | None, size: int, colours: bool = False) -> Iterator[Raw]:
    """Read points of a scan, rotated into the file's frame; the position is in the offsets."""
    coloured = colours and scan.has_colours
    limits = _colour_limits(image, scan) if coloured else np.ones(3)
    flags = scan.flags(dimension)
    names = [*scan.coordinates, *flags]
    names += [dimension] if dimension is not None else []
    names += ["timeStamp"] if scan.has_time else []
    names += [name for name in (*COLOURS, NO_COLOUR) if coloured and name in scan.fields]
    offsets = np.zeros(3) if scan.position is None else scan.position
    for fields in read_fields(image, scan, names, size):
        if flags:
            good = good_of(fields, flags)
            fields = {name: values[good] for name, values in fields.items() if name not in flags}
        turned = own_coordinates(scan, fields) @ scan.rotation.T
        if len(turned):
            yield Raw(
                turned[:, 0],
                turned[:, 1],
                turned[:, 2],
                np.ones(3),
                offsets,
                fields["timeStamp"] + scan.start if scan.has_time else None,
                np.full(len(turned), scan.number, np.int32),
                None if dimension is None else fields[dimension].copy(),
                None,
                _colours(fields, limits) if coloured else None,
            )


def _colours(fields: dict[str, NDArray[Any]], limits: Float) -> UInt16:
    """Return 16-bit colours (n, 3); black for points that have none."""
    colour = np.column_stack([fields[name] for name in COLOURS]) * (65535.0 / limits)
    if NO_COLOUR in fields:
        colour[fields[NO_COLOUR] != 0] = 0.0
    return np.rint(np.clip(colour, 0.0, 65535.0)).astype(np.uint16)


def _colour_limits(image: Any, scan: Scan) -> Float:
    """Return the greatest red, green and blue of a scan; 255 if its header does not state them."""
    node = image.root()["data3D"][scan.index]
    limits = [value_of(node, f"colorLimits/{name}Maximum", 255.0) for name in COLOURS]
    return np.array([limit if limit and limit > 0.0 else 255.0 for limit in limits], np.float64)


def own_coordinates(scan: Scan, fields: dict[str, NDArray[Any]]) -> Float:
    """Return coordinates (n, 3) in the scan's own frame, m."""
    own = np.column_stack([fields[name] for name in scan.coordinates])
    return _to_cartesian(own) if scan.coordinates is SPHERICAL else own


def _to_cartesian(rae: Float) -> Float:
    """Convert range, azimuth and elevation (m, rad) to x, y, z (m)."""
    distance, azimuth, elevation = rae.T
    plan = distance * np.cos(elevation)
    return np.column_stack([plan * np.cos(azimuth), plan * np.sin(azimuth), distance * np.sin(elevation)])


def read_fields(image: Any, scan: Scan, names: Sequence[str], size: int) -> Iterator[dict[str, NDArray[Any]]]:
    """Read fields of a scan's points, as views of buffers that the next chunk overwrites."""
    libe57 = _libe57()
    count = min(size, scan.records)
    arrays = {name: np.empty(count) for name in names}
    buffers = libe57.VectorSourceDestBuffer()
    for name, array in arrays.items():
        buffers.append(libe57.SourceDestBuffer(image, name, array, count, True, True))
    reader = image.root()["data3D"][scan.index]["points"].reader(buffers)
    done = 0
    try:
        while done < scan.records:
            read = reader.read()
            if read == 0:
                raise ValueError(f"scan {scan.name!r} ends after {done} of {scan.records} points")
            done += read
            yield {name: array[:read] for name, array in arrays.items()}
    finally:
        reader.close()


@contextmanager
def open_e57(path: Path) -> Iterator[Any]:
    """Open a file with libE57Format as a context."""
    libe57 = _libe57()
    with decoding(path, KIND):
        with path.open("rb") as file:
            if file.read(8) != b"ASTM-E57":
                raise ValueError("it does not begin with ASTM-E57")
        require_bounded_xml(path)
        image = libe57.ImageFile(str(path), "r")
    try:
        yield image
    finally:
        image.close()


def _libe57() -> Any:
    try:
        from pye57 import libe57
    except ImportError as error:
        raise UserError('reading E57 needs pye57, which is not installed: pip install "tunneldb[e57]"') from error
    return libe57


def scans_of(path: Path, image: Any) -> list[Scan]:
    """Return the scans of an open file that contain points."""
    root = image.root()
    nodes = root["data3D"] if root.isDefined("data3D") else []
    if len(nodes) == 0:
        pictures = len(root["images2D"]) if root.isDefined("images2D") else 0
        only = f", only pictures ({pictures}): tunneldb image import places those that have a pose" if pictures else ""
        raise InputError(f"{path}: the file holds no scan{only}")
    scans = [scan for scan in (_scan(index, nodes[index]) for index in range(len(nodes))) if scan.records]
    if not scans:
        raise InputError(f"{path}: the file holds no points")
    for scan in scans:
        if not (scan.fields.issuperset(CARTESIAN) or scan.fields.issuperset(SPHERICAL)):
            raise InputError(
                f"{path}: the points of scan {scan.name!r} have no coordinates, only {', '.join(sorted(scan.fields))}"
            )
        if scan.position is not None and not np.isfinite([*scan.position, *scan.rotation.ravel()]).all():
            raise InputError(f"{path}: scan {scan.name!r} has an invalid pose; export it again")
    return scans


def _scan(index: int, node: Any) -> Scan:
    points = node["points"]
    prototype = _libe57().StructureNode(points.prototype())
    fields = frozenset(prototype.get(i).elementName() for i in range(prototype.childCount()))
    name = scan_name(node, index)
    guid = node["guid"].value() if node.isDefined("guid") else f"{name} {index}"
    rotation, position = pose_of(node)
    start = value_of(node, "acquisitionStart/dateTimeValue")
    return Scan(index, name, scan_number(guid, position), points.childCount(), fields, rotation, position, start)


def pose_of(node: Any) -> tuple[Float, Float | None]:
    """Return the rotation of a scan or a picture into the file's frame, and its position, m; None without a pose."""
    if not node.isDefined("pose"):
        return np.eye(3), None
    position = np.array([value_of(node, f"pose/translation/{name}", 0.0) for name in "xyz"], np.float64)
    quaternion = [value_of(node, f"pose/rotation/{name}", float(name == "w")) for name in "wxyz"]
    return _rotation(np.array(quaternion, np.float64)), position


def _rotation(quaternion: Float) -> Float:
    """Return the matrix of a quaternion w, x, y, z; NaN if its length is 0."""
    with np.errstate(invalid="ignore", divide="ignore"):
        w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def value_of(node: Any, name: str, missing: float | None = None) -> float | None:
    """Return the number at a path below a node."""
    if not node.isDefined(name):
        return missing
    for part in name.split("/"):
        node = node[part]
    return float(node.scaledValue() if hasattr(node, "scaledValue") else node.value())


def _box(image: Any, scan: Scan) -> tuple[Float, Float]:
    """Return the bounding box of a scan in the file's frame."""
    node = image.root()["data3D"][scan.index]
    limits = [[value_of(node, f"cartesianBounds/{axis}{end}", np.nan) for axis in "xyz"] for end in ("Minimum", "Maximum")]
    low, high = np.array(limits, np.float64)
    if not np.all(np.abs([low, high]) < MAX_BOUND):
        boxes = [(xyz.min(axis=0), xyz.max(axis=0)) for xyz in map(_xyz, _read_scan(image, scan, None, CHUNK))]
        if not boxes:
            return np.full(3, np.inf), np.full(3, -np.inf)
        return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)
    position = np.zeros(3) if scan.position is None else scan.position
    # The standard's bounds are in the scan's own frame; some exporters (pye57) write them in the file's.
    if np.all((low <= position) & (position <= high)) and not np.all((low <= 0) & (high >= 0)):
        return low, high
    corners = np.array(list(product(*zip(low, high, strict=True)))) @ scan.rotation.T + position
    return corners.min(axis=0), corners.max(axis=0)


def _xyz(raw: Raw) -> Float:
    return np.column_stack([raw.x, raw.y, raw.z]) * raw.scales + raw.offsets


def _stated_crs(image: Any) -> StatedCrs:
    """Return the coordinate system that the file states; exporters write various texts there."""
    root = image.root()
    text = root["coordinateMetadata"].value() if root.isDefined("coordinateMetadata") else ""
    return stated_in_text(text, "coordinateMetadata")
