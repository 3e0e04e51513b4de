"""Pictures of an E57 file, projected onto the lining of a survey by the poses of their cameras."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

import numpy as np
import psycopg
from scipy import ndimage

from tunneldb.arrays import Float, Single, UInt8
from tunneldb.counted import counted
from tunneldb.errors import InputError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pointcloud.formats.e57_pictures import Picture, read_pictures, read_pixels
from tunneldb.raster.geotiff import OVERVIEW, Raster
from tunneldb.raster.grid import BLOCKS, Grid
from tunneldb.raster.placement.camera import Camera, Projection
from tunneldb.raster.placement.checks import Lining, Placed
from tunneldb.raster.placement.pictures import MAX_DISTANCE, project_pictures
from tunneldb.raster.placement.resample import PIXELS
from tunneldb.store.images import load_kinds
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey

FINEST = 0.005
"""Side of the pixels of an image by default, m, if the pictures show the lining finer."""

MAX_OFFSET = 0.05
"""Mean offset of a part of the lining (0.4 m) from the surface beyond which it shows cables or a niche, m."""

HELD = 4
"""Number of pictures whose pixels are in memory at once."""


@dataclass(frozen=True)
class Pictures:
    """Pictures of a file that show the lining of a survey.

    Attributes
    ----------
    path : Path
    pictures : list of Picture
        Those in the tunnel, with a pose.
    chainages : (n,) array
        Chainage of each camera, m.
    placed : Placed
        Extent of what they can show; the warnings state what is left out.
    pixel : float
        Side of the pixels that suits them, m.
    """

    path: Path
    pictures: list[Picture]
    chainages: Float
    placed: Placed
    pixel: float


def find_pictures(conn: psycopg.Connection[Any], survey: Survey, path: Path, lining: Lining) -> Pictures:
    """Find the pictures of an E57 file that were taken in the tunnel of a survey.

    Raises
    ------
    InputError
        If there are none.
    """
    every = read_pictures(path)
    if not every:
        raise InputError(f"{path}: the file has no pictures")
    posed = [picture for picture in every if picture.placed]
    if not posed:
        raise InputError(
            f"{path}: none of its {counted(len(every), 'picture')} has a pose and a projection, so they cannot be placed by"
            " themselves: export them as images, and give control points (--points) or a table of frames"
        )
    surface = load_surface(conn, survey, lining.chainage_from, lining.chainage_to)
    unrolled = surface.unroll(np.array([_position(picture) for picture in posed]))
    inside = np.isfinite(unrolled.chainage) & (unrolled.offset > 0.0)
    if not inside.any():
        x, y, z = _position(posed[0])
        raise InputError(
            f"{path}: none of its {counted(len(posed), 'posed picture')} was taken in the tunnel of survey {survey.name};"
            f" {posed[0].name!r} is at {x:.2f} {y:.2f} {z:.2f}: are the poses in the tunnel's coordinate system?"
        )
    chosen = [picture for picture, within in zip(posed, inside, strict=True) if within]
    chainages = unrolled.chainage[inside]
    ends = max(lining.chainage_from, chainages.min() - MAX_DISTANCE), min(lining.chainage_to, chainages.max() + MAX_DISTANCE)
    warnings = []
    for count, why in (
        (len(every) - len(posed), "without a pose or a projection"),
        (len(posed) - len(chosen), "taken outside the tunnel"),
    ):
        if count:
            warnings.append(f"{counted(count, 'picture')} of {len(every)} {why}")
    placed = Placed(float(ends[0]), float(ends[1]), lining.arc_from, lining.arc_to, warnings)
    return Pictures(path, chosen, chainages, placed, _suitable(chosen, unrolled.offset[inside]))


def _suitable(pictures: Sequence[Picture], distances: Float) -> float:
    """Return the side of pixels that suits pictures at distances from the lining, m."""
    sides = [_camera(picture).pixel_angle * distance for picture, distance in zip(pictures, distances, strict=True)]
    side = 1.05 * float(np.median(sides))
    return max((pixel for pixel in PIXELS if FINEST <= pixel <= side), default=FINEST)


def project_kilometre(
    conn: psycopg.Connection[Any], survey: Survey, found: Pictures, km: int, grid: Grid
) -> Iterator[tuple[int, Raster]]:
    """Project the pictures near a kilometre onto its lining; see `project_pictures`."""
    low, high = km * KILOMETRE - MAX_DISTANCE, (km + 1) * KILOMETRE + MAX_DISTANCE
    near = [k for k in range(len(found.pictures)) if low < found.chainages[k] < high]
    if not near:
        return
    surface = load_surface(conn, survey, low - survey.spacing, high + survey.spacing)
    offsets = _Offsets(load_kinds(conn, survey, km, km * BLOCKS, (OVERVIEW + "offset",)).get(OVERVIEW + "offset"))

    @lru_cache(maxsize=HELD)
    def pixels(number: int) -> UInt8:
        return read_pixels(found.path, found.pictures[near[number]])

    yield from project_pictures([_camera(found.pictures[k]) for k in near], pixels, surface, offsets, grid)


class _Offsets:
    """Offset of the lining from the surface, from the overview of the image of a kilometre.

    It is 0 where nothing was measured, and where things before the lining or niches were.
    """

    def __init__(self, overview: Raster | None) -> None:
        self._overview = overview

    def __call__(self, chainages: Float, arcs: Float) -> Single:
        shape = (len(arcs), len(chainages))
        if self._overview is None:
            return np.zeros(shape, np.float32)
        place = self._overview.transform
        columns, rows = (chainages - place.c) / place.a - 0.5, (arcs - place.f) / place.e - 0.5
        at = np.stack(np.meshgrid(rows, columns, indexing="ij"))
        values = np.where(np.abs(self._overview.values) <= MAX_OFFSET, self._overview.values, np.float32(0.0))
        return np.asarray(ndimage.map_coordinates(values, at, np.float32, order=1, mode="nearest"))


def _camera(picture: Picture) -> Camera:
    return Camera(
        cast(Projection, picture.projection), picture.columns, picture.rows, picture.pixel_width, picture.pixel_height,
        picture.focal, picture.principal, picture.rotation, _position(picture),
    )  # fmt: skip


def _position(picture: Picture) -> Float:
    assert picture.position is not None
    return picture.position
