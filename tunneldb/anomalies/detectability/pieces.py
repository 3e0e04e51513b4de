"""Pieces of a kilometre's picture in which trials are made: a sample that keeps their cost at half that of detection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tunneldb.anomalies.detectability.conditions import Conditions
from tunneldb.anomalies.detectability.trials import CELL, Detector, Trials, run_trial
from tunneldb.anomalies.windows import on_lining
from tunneldb.arrays import Bool, Int16, UInt8
from tunneldb.raster.grid import BLOCKS, Grid
from tunneldb.raster.image import LiningImage
from tunneldb.raster.profiles import ProfileGaps
from tunneldb.raster.state import PixelState

INTERVAL = 4
"""Interval of the blocks of 50 m in which trials are made first."""

ORDER = (1, 3, 0, 2)
"""Remainders of the numbers of the blocks, in the order in which they are used."""

MIN_TRIALS = 60
"""Minimum number of trials for a model: some 10 for each of its coefficients."""

TRIALS_PER_BLOCK = 15
"""Number of trials per block of the kilometre after which no further pieces are used: 300 in a whole kilometre."""

MAX_SHARE = 0.3
"""Maximum number of pieces, as a share of the blocks."""

MIN_PIECES = 2
"""Number of pieces that is allowed for short tunnels."""


@dataclass(frozen=True)
class Pieces:
    """Blocks of a kilometre, with copies of the levels that detection overwrites.

    Attributes
    ----------
    grid : Grid
        Pixels of the kilometre and its context.
    state : (rows, columns) uint8 array
    gaps : ProfileGaps or None
    rounds : list of list of (int, int)
        Pieces to be used together: number of the block in the picture, and number of the trial there.
    levels : dict of int to (rows, columns of a block) int16 array
        Levels of these blocks.
    enough : int
        Number of trials after which no further round is used.
    """

    grid: Grid
    state: UInt8
    gaps: ProfileGaps | None
    rounds: list[list[tuple[int, int]]]
    levels: dict[int, Int16]
    enough: int

    @classmethod
    def of(cls, picture: LiningImage) -> Pieces:
        """Choose the pieces of a picture by their places in the tunnel, and copy their levels.

        There are none in a tunnel too small for MIN_TRIALS leaks at a time.
        """
        grid = picture.grid
        first, stop = grid.inner.start // grid.block_columns, grid.inner.stop // grid.block_columns
        area = {k: _lining_area(picture, k) for k in range(first, stop)}
        shown = [k for k, lining in area.items() if lining > 0.0]
        small = sum(area.values()) < MIN_TRIALS * CELL**2
        rounds = [] if small else choose_rounds([grid.first_block + k for k in shown])
        here = [[(block - grid.first_block, number) for block, number in one] for one in rounds]
        levels = {k: picture.level[:, _columns(grid, k)].copy() for k in {block for one in here for block, _ in one}}
        return cls(grid, picture.state, picture.gaps, here, levels, max(MIN_TRIALS, TRIALS_PER_BLOCK * len(shown)))

    def try_out(self, dark: Bool, conditions: Conditions, detect: Detector) -> Trials:
        """Make trials in one round of pieces after the other, until there are enough.

        Parameters
        ----------
        dark : (rows, columns) bool array
            Dark pixels of the picture, as detected.
        conditions : Conditions
            Of the picture.
        detect : callable
        """
        trials = Trials.none()
        for one in self.rounds:
            trials = Trials.of([trials, *(self._trial(block, number, dark, conditions, detect) for block, number in one)])
            if len(trials.found) >= self.enough:
                break
        return trials

    def _trial(self, block: int, number: int, dark: Bool, conditions: Conditions, detect: Detector) -> Trials:
        columns, tiles = _columns(self.grid, block), self.grid.block_columns // conditions.tile
        there = slice(block * tiles, (block + 1) * tiles)
        picture = LiningImage(
            _grid_of(self.grid, block),
            np.ascontiguousarray(self.state[:, columns]),
            self.levels[block],
            _cut(self.gaps, columns),
        )
        here = replace(conditions, seen=conditions.seen[:, there], values=conditions.values[:, :, there])
        return run_trial(picture, dark[:, columns], here, detect, number)


def choose_rounds(blocks: Sequence[int]) -> list[list[tuple[int, int]]]:
    """Choose pieces, as many as MAX_SHARE allows, by the numbers of the blocks along the tunnel alone.

    Returns
    -------
    list of list of (int, int)
        Block and number of the trial; each list is spread over all blocks.
    """
    left = max(MIN_PIECES, int(MAX_SHARE * len(blocks))) if blocks else 0
    rounds, number = [], 0
    while left > 0:
        for remainder in ORDER:
            if one := [(block, number) for block in blocks if block % INTERVAL == remainder][:left]:
                rounds.append(one)
                left -= len(one)
        number += 1
    return rounds


def _lining_area(picture: LiningImage, block: int) -> float:
    """Return the area of a block that could show lining, m²; 0 if nothing of it does."""
    state = picture.state[:, _columns(picture.grid, block)]
    return np.count_nonzero(state <= PixelState.RECESS) * picture.grid.pixel**2 if on_lining(state).any() else 0.0


def _columns(grid: Grid, block: int) -> slice:
    """Return the columns of a block, counted from the first of the picture."""
    return slice(block * grid.block_columns, (block + 1) * grid.block_columns)


def _grid_of(grid: Grid, block: int) -> Grid:
    """Return the grid of one block without context."""
    number = grid.first_block + block - grid.km * BLOCKS
    return replace(grid, halo=0, covered=(number, number + 1))


def _cut(gaps: ProfileGaps | None, columns: slice) -> ProfileGaps | None:
    return None if gaps is None else replace(gaps, longest=gaps.longest[columns], half=gaps.half[columns])
