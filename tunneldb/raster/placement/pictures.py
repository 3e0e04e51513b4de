"""Pictures projected onto the lining by the poses of their cameras, block by block."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int64, Single, UInt8
from tunneldb.compiled import point_kernel
from tunneldb.geometry.surface import Surface
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.grid import BLOCK, Grid
from tunneldb.raster.placement.camera import Camera, pixel_of
from tunneldb.threads import in_blocks

MAX_DISTANCE = 20.0
"""Distance from the camera up to which a picture is used, m."""

MIN_COSINE = 0.3
"""Minimum cosine of the incidence angle at which a picture is used (72.5°): beyond, things before the lining hide it."""

MESH = 0.05
"""Distance of the nodes at which the lining is worked out, m."""

ROWS = 64
"""Number of rows that a thread draws at once."""

Offsets = Callable[[Float, Float], Single]
"""Function that returns the offset of the lining from the surface (rows, columns), m, at chainages and arcs."""


def project_pictures(
    cameras: Sequence[Camera], pixels: Callable[[int], UInt8], surface: Surface, offsets: Offsets, grid: Grid
) -> Iterator[tuple[int, Raster]]:
    """Project pictures into the blocks of a kilometre; where several show the lining, the one that shows it best is used.

    A picture shows the lining better the nearer it is and the less oblique: by cosine over squared distance, the solid angle
    of a pixel. Things before the lining are not taken away: they appear on it. Black is no colour: panoramas have it where
    the camera saw nothing.

    Parameters
    ----------
    cameras : sequence of Camera
    pixels : callable
        Returns the pixels (rows, columns, 3) of the picture of a camera, by its index.
    surface : Surface
    offsets : callable
    grid : Grid
        Pixels of the kilometre, without halo.

    Yields
    ------
    block : int
        Number of a block with values.
    raster : Raster
        Its colours.
    """
    places = surface.unroll(np.array([camera.position for camera in cameras])).chainage
    for first in range(0, grid.columns, grid.block_columns):
        west = grid.west + first * grid.pixel
        near = np.flatnonzero((places > west - MAX_DISTANCE) & (places < west + BLOCK + MAX_DISTANCE))
        if not len(near):
            continue
        nodes = _nodes([cameras[k] for k in near.tolist()], surface, offsets, grid, first)
        values = np.full((grid.rows, grid.block_columns, 3), np.nan, np.float32)
        for k, number in enumerate(near.tolist()):
            if (nodes.best == k).any():
                _draw_camera(values, nodes, k, cameras[number], pixels(number))
        if np.isfinite(values).any():
            yield grid.first_block + first // grid.block_columns, Raster(values, grid.transform(first))


@dataclass(frozen=True)
class _Nodes:
    """Places of the lining at every `step`-th pixel of a block, and the camera that shows each best.

    Between the nodes the lining is straight: over MESH that is wrong by less than a millimetre.

    Attributes
    ----------
    step : int
    points : (rows, columns, 3) float array
        m; NaN off the lining.
    best : (rows, columns) int array
        Index of a camera; -1 where none shows it.
    """

    step: int
    points: Float
    best: Int64


def _nodes(cameras: Sequence[Camera], surface: Surface, offsets: Offsets, grid: Grid, first: int) -> _Nodes:
    """Return the nodes of a block that begins with a column."""
    step = max(1, round(MESH / grid.pixel))
    rows, columns = (step * np.arange((count - 1) // step + 2) for count in (grid.rows, grid.block_columns))
    chainages = np.asarray(grid.west + (first + columns + 0.5) * grid.pixel, np.float64)
    arcs = np.asarray((grid.bottom + grid.rows - rows - 0.5) * grid.pixel, np.float64)
    points, normals = _lining(surface, offsets, chainages, arcs)
    best, most = np.full(len(points), -1, np.int64), np.zeros(len(points))
    for k, camera in enumerate(cameras):
        worth = _worth(camera, points, normals)
        better = worth > most
        best[better], most[better] = k, worth[better]
    shape = len(rows), len(columns)
    return _Nodes(step, points.reshape(*shape, 3), best.reshape(shape))


def _lining(surface: Surface, offsets: Offsets, chainages: Float, arcs: Float) -> tuple[Float, Float]:
    """Return the points of the lining (rows × columns, 3), and vectors along its normals, into the tunnel."""
    x, y = (grid.ravel() for grid in np.meshgrid(chainages, arcs))
    offset = offsets(chainages, arcs).ravel().astype(np.float64)
    points = surface.to_space(x, y, offset)
    return points, surface.to_space(x, y, offset + 0.01) - points


def _worth(camera: Camera, points: Float, normals: Float) -> Float:
    """Return how well a camera shows points: cosine over squared distance, 0 where it does not."""
    sight = camera.position - points
    distance = np.linalg.norm(sight, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = (sight * normals).sum(axis=1) / (distance * np.linalg.norm(normals, axis=1))
        shown = (distance <= MAX_DISTANCE) & (cosine >= MIN_COSINE)
    shown[shown] = np.isfinite(camera.project(points[shown])[0])
    return np.where(shown, cosine / distance**2, 0.0)


def _draw_camera(values: Single, nodes: _Nodes, k: int, camera: Camera, picture: UInt8) -> None:
    """Draw what the k-th camera shows best into values (rows, columns, 3)."""
    own = (nodes.points - camera.position) @ camera.rotation

    def rows(begin: int, end: int) -> None:
        _draw(camera.numbers, own, nodes.best, k, nodes.step, picture, begin, values[begin:end])

    in_blocks(rows, len(values), ROWS)


@point_kernel
def _draw(
    numbers: Float, own: Float, best: Int64, camera: int, step: int, picture: UInt8, first: int, values: Single
) -> None:  # pragma: no cover - compiled
    """Draw rows of a block from ``first`` on: linear between nodes, and between the pixels of the picture."""
    last_row, last_column = picture.shape[0] - 1, picture.shape[1] - 1
    for i in range(values.shape[0]):
        node_row = (first + i) // step
        down = (first + i) / step - node_row
        near_row = node_row + (1 if down > 0.5 else 0)
        for j in range(values.shape[1]):
            node_column = j // step
            along = j / step - node_column
            if best[near_row, node_column + (1 if along > 0.5 else 0)] != camera:
                continue
            a, b = (1.0 - down) * (1.0 - along), (1.0 - down) * along
            c, d = down * (1.0 - along), down * along
            x, y, z = (
                a * own[node_row, node_column, 0] + b * own[node_row, node_column + 1, 0]
                + c * own[node_row + 1, node_column, 0] + d * own[node_row + 1, node_column + 1, 0],
                a * own[node_row, node_column, 1] + b * own[node_row, node_column + 1, 1]
                + c * own[node_row + 1, node_column, 1] + d * own[node_row + 1, node_column + 1, 1],
                a * own[node_row, node_column, 2] + b * own[node_row, node_column + 1, 2]
                + c * own[node_row + 1, node_column, 2] + d * own[node_row + 1, node_column + 1, 2],
            )  # fmt: skip
            column, row = pixel_of(numbers, x, y, z)
            if np.isnan(column):
                continue
            column, row = min(max(column - 0.5, 0.0), float(last_column)), min(max(row - 0.5, 0.0), float(last_row))
            u, v = min(int(column), last_column - 1), min(int(row), last_row - 1)
            right, below = column - u, row - v
            black = True
            for band in range(3):
                above = (1.0 - right) * picture[v, u, band] + right * picture[v, u + 1, band]
                under = (1.0 - right) * picture[v + 1, u, band] + right * picture[v + 1, u + 1, band]
                values[i, j, band] = (1.0 - below) * above + below * under
                black = black and values[i, j, band] == 0.0
            if black:
                for band in range(3):
                    values[i, j, band] = np.nan
