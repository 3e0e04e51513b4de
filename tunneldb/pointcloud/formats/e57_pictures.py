"""Pictures of E57 files: how they are projected, and where they were taken.

Source: ASTM E2807-11, on images and their visual reference, pinhole, spherical and cylindrical representations.
"""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from tunneldb.arrays import Float, UInt8
from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.e57 import KIND, open_e57, pose_of, value_of
from tunneldb.pointcloud.formats.faults import decoding

PROJECTIONS = {
    "pinhole": "pinholeRepresentation",
    "spherical": "sphericalRepresentation",
    "cylindrical": "cylindricalRepresentation",
    "none": "visualReferenceRepresentation",
}
"""Projections, and the nodes of their parameters; a picture without one is a view for people."""

MAX_PIXELS = 400_000_000
"""Maximum number of pixels of a picture."""


@dataclass(frozen=True)
class Picture:
    """A picture of an E57 file, without its pixels.

    Attributes
    ----------
    index : int
        Index in the file, from 0.
    name : str
    projection : str
        One of PROJECTIONS.
    columns, rows : int
        Size.
    pixel_width, pixel_height : float
        Size of a pixel: rad (spherical; width of cylindrical ones) or m; 0 without a projection.
    focal : float
        Focal length of a pinhole camera, or radius of a cylinder, m.
    principal : (float, float)
        Column and row of the principal point.
    rotation : (3, 3) float64 array
        Rotation from the camera's frame to the file's.
    position : (3,) float64 array or None
        Place of the camera in the file's frame, m; None without a pose.
    """

    index: int
    name: str
    projection: str
    columns: int
    rows: int
    pixel_width: float
    pixel_height: float
    focal: float
    principal: tuple[float, float]
    rotation: Float
    position: Float | None

    @property
    def placed(self) -> bool:
        """True if it can be projected onto a surface."""
        return self.projection != "none" and self.position is not None


def read_pictures(path: Path) -> list[Picture]:
    """Read the pictures of an E57 file, without their pixels.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    with open_e57(path) as image, decoding(path, KIND):
        root = image.root()
        nodes = root["images2D"] if root.isDefined("images2D") else []
        return [_picture(path, index, nodes[index]) for index in range(len(nodes))]


def read_pixels(path: Path, picture: Picture) -> UInt8:
    """Read the pixels of a picture: (rows, columns, 3), red, green and blue.

    Raises
    ------
    InputError
        If they cannot be decoded, or there are more or fewer than its header states.
    """
    if picture.columns * picture.rows > MAX_PIXELS:
        raise InputError(f"{path}: picture {picture.name!r} has {picture.columns} × {picture.rows} pixels, too many to be read")
    with open_e57(path) as image, decoding(path, KIND):
        node = image.root()["images2D"][picture.index][PROJECTIONS[picture.projection]]
        blob = next(node[name] for name in ("jpegImage", "pngImage") if node.isDefined(name))
        content = np.zeros(blob.byteCount(), np.uint8)
        blob.read(content, 0, len(content))
    try:
        with Image.open(BytesIO(content.tobytes()), formats=("JPEG", "PNG")) as opened:
            size = opened.size
            if size == (picture.columns, picture.rows):
                return np.array(opened.convert("RGB"))
    except (OSError, Image.DecompressionBombError) as error:
        raise InputError(f"{path}: picture {picture.name!r} cannot be decoded: {error}") from None
    raise InputError(
        f"{path}: picture {picture.name!r} has {size[0]} × {size[1]} pixels, its header states {picture.columns} ×"
        f" {picture.rows}"
    )


def _picture(path: Path, index: int, node: Any) -> Picture:
    name = node["name"].value() if node.isDefined("name") else f"picture {index}"
    found = next((one for one, place in PROJECTIONS.items() if node.isDefined(place)), None)
    if found is None:
        raise InputError(f"{path}: picture {name!r} has no pixels")
    values = node[PROJECTIONS[found]]
    rotation, position = pose_of(node)
    number = {
        key: value_of(values, key, 0.0) or 0.0
        for key in ("imageWidth", "imageHeight", "pixelWidth", "pixelHeight", "focalLength", "radius")
    }
    columns, rows = int(number["imageWidth"]), int(number["imageHeight"])
    middle = columns / 2.0, rows / 2.0
    principal = (
        value_of(values, "principalPointX", middle[0]) or 0.0,
        value_of(values, "principalPointY", middle[1]) or 0.0,
    )
    focal = number["radius"] if found == "cylindrical" else number["focalLength"]
    picture = Picture(
        index, name, found, columns, rows, number["pixelWidth"], number["pixelHeight"], focal, principal, rotation, position
    )
    _check(path, picture)
    return picture


def _check(path: Path, picture: Picture) -> None:
    """Refuse a picture whose parameters project nothing."""
    needed: dict[str, float] = {"columns": picture.columns, "rows": picture.rows}
    if picture.projection != "none":
        needed |= {"pixelWidth": picture.pixel_width, "pixelHeight": picture.pixel_height}
    if picture.projection in ("pinhole", "cylindrical"):
        needed["focalLength" if picture.projection == "pinhole" else "radius"] = picture.focal
    for name, value in needed.items():
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{path}: picture {picture.name!r} has {name} {value:g}: it must be positive")
    if picture.position is not None and not np.isfinite([*picture.position, *picture.rotation.ravel()]).all():
        raise InputError(f"{path}: picture {picture.name!r} has an invalid pose; export it again")
