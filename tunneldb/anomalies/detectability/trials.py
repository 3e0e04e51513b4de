"""Trials: synthetic leaks are injected into a picture, and detection is repeated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tunneldb.anomalies.detectability.conditions import NAMES, Conditions
from tunneldb.anomalies.detectability.synthetic import SyntheticLeak, draw_leak
from tunneldb.arrays import Bool, Float, Int16, Int64, UInt8
from tunneldb.raster.geotiff import NODATA, STEP
from tunneldb.raster.image import LiningImage
from tunneldb.raster.state import PixelState

CELL = 3.0
"""Side of the cells that take one leak each, m."""

JITTER = 0.5
"""Maximum distance of a leak from the middle of its cell, m."""

MIN_POSSIBLE = 0.7
"""Minimum share of a leak's pixels that could show lining."""

MAX_DARK = 0.02
"""Maximum share of pixels around a leak that were dark before."""

MIN_OVERLAP = 0.5
"""Minimum share of a leak that leaks cover for it to be found."""

Detector = Callable[[LiningImage], Bool]
"""Returns the pixels (rows, columns) of the leaks in a picture, whose levels it may overwrite."""


@dataclass(frozen=True)
class Trials:
    """Synthetic leaks, and which of them were found.

    Attributes
    ----------
    area, drop : (n,) float arrays
        Their area, m², and mean darkening, dB.
    conditions : (n, len(NAMES)) float array
        Conditions at their places.
    found : (n,) bool array
    """

    area: Float
    drop: Float
    conditions: Float
    found: Bool

    @classmethod
    def none(cls) -> Trials:
        """Return no trials."""
        return cls(np.zeros(0), np.zeros(0), np.zeros((0, len(NAMES))), np.zeros(0, np.bool_))

    @classmethod
    def of(cls, parts: list[Trials]) -> Trials:
        """Join the trials of several passes."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in cls.__dataclass_fields__))


@dataclass(frozen=True)
class _Planted:
    """A leak in the picture: the rows and columns of its pixels."""

    row: int
    column: int
    leak: SyntheticLeak


def run_trial(picture: LiningImage, dark: Bool, conditions: Conditions, detect: Detector, number: int) -> Trials:
    """Inject a leak into each blank cell of a picture, and detect again.

    Parameters
    ----------
    picture : LiningImage
        Picture before detection; it is not changed.
    dark : (rows, columns) bool array
        Its dark pixels: leaks are injected where there are none.
    conditions : Conditions
        Of the picture.
    detect : callable
    number : int
        Number of the trial; with the places of the cells it determines the leaks.
    """
    level = picture.level.copy()
    planted = _plant(level, picture, dark, number)
    wet = detect(LiningImage(picture.grid, picture.state.copy(), level, picture.gaps))
    found = [_is_found(one, wet, picture.state) for one in planted]
    places = np.array([[one.row, one.column] for one in planted], np.int64).reshape(-1, 2)
    middle = places + np.array([len(one.leak.wet) // 2 for one in planted], np.int64)[:, None]
    tiles = middle // conditions.tile
    pixel = picture.grid.pixel
    return Trials(
        np.array([np.count_nonzero(one.leak.wet) * pixel**2 for one in planted]),
        np.array([one.leak.drop for one in planted]),
        conditions.values[:, tiles[:, 0], tiles[:, 1]].T.reshape(-1, len(NAMES)),
        np.array(found, np.bool_),
    )


def _plant(level: Int16, picture: LiningImage, dark: Bool, number: int) -> list[_Planted]:
    """Inject leaks into levels, in place."""
    grid = picture.grid
    side = round(CELL / grid.pixel)
    shift = np.array([number % 2, number // 2 % 2]) * (side // 2)
    possible = picture.state <= PixelState.RECESS
    planted = []
    for row in _cells(grid.rows, -grid.bottom - grid.rows + int(shift[0]), side):
        for column in _cells(grid.columns, grid.first_column + int(shift[1]), side):
            if not possible[max(row - side // 2, 0) : row + side // 2, max(column - side // 2, 0) : column + side // 2].any():
                continue
            # By the cell's place in the tunnel: the same whichever kilometre it is seen from.
            place = (grid.bottom + grid.rows - row, grid.first_column + column)
            rng = np.random.default_rng([number, abs(place[0]), int(place[0] < 0), abs(place[1]), int(place[1] < 0)])
            # The crown is at arc 0: water runs from it to both sides.
            one = draw_leak(rng, grid.pixel, downward=place[0] > 0)
            half = len(one.wet) // 2
            move = np.rint(rng.uniform(-JITTER, JITTER, 2) / grid.pixel).astype(int)
            top, left = row + int(move[0]) - half, column + int(move[1]) - half
            found = _Planted(top, left, one)
            if _is_blank(found, picture.state, dark):
                _darken(level, found)
                planted.append(found)
    return planted


def _cells(count: int, first: int, side: int) -> Int64:
    """Return the positions of the middles of the cells in a row of ``count`` pixels; ``first`` is the first pixel's number."""
    return np.arange((side // 2 - first) % side, count, side, dtype=np.int64)


def _is_blank(planted: _Planted, state: UInt8, dark: Bool) -> bool:
    """Return True if a leak lies within the picture, on lining without anything dark."""
    if (box := _box(planted, state.shape)) is None:
        return False
    possible = state[box] <= PixelState.RECESS
    return bool(possible[planted.leak.wet].mean() >= MIN_POSSIBLE and dark[box].mean() <= MAX_DARK)


def _darken(level: Int16, planted: _Planted) -> None:
    """Darken levels by a leak that lies within the picture, in place."""
    box = _box(planted, level.shape)
    assert box is not None
    here = level[box]
    steps = np.rint(planted.leak.darkening / STEP["corrected"]).astype(np.int32)
    darker = np.maximum(here.astype(np.int32) - steps, NODATA + 1).astype(np.int16)
    level[box] = np.where(here == NODATA, here, darker)


def _is_found(planted: _Planted, wet: Bool, state: UInt8) -> bool:
    """Return True if leaks cover enough of the lining on which a leak lies."""
    box = _box(planted, state.shape)
    assert box is not None
    lining = planted.leak.wet & (state[box] <= PixelState.RECESS)
    return bool(np.count_nonzero(wet[box] & lining) >= MIN_OVERLAP * np.count_nonzero(lining))


def _box(planted: _Planted, shape: tuple[int, ...]) -> tuple[slice, slice] | None:
    """Return the rows and columns of a leak; None if it reaches beyond the picture."""
    size = len(planted.leak.wet)
    if planted.row < 0 or planted.column < 0 or planted.row + size > shape[0] or planted.column + size > shape[1]:
        return None
    return slice(planted.row, planted.row + size), slice(planted.column, planted.column + size)
