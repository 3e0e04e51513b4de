"""Detectability by blocks of the lining: the smallest leak found with 90 % probability, and that of the owner's demand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from tunneldb.anomalies.detectability.chance import Chance
from tunneldb.anomalies.detectability.conditions import Conditions
from tunneldb.anomalies.detectability.pieces import MIN_TRIALS
from tunneldb.anomalies.detectability.synthetic import AREAS
from tunneldb.anomalies.detectability.trials import Trials
from tunneldb.arrays import Float, Int64
from tunneldb.raster.grid import Grid

LENGTH, WIDTH = 10.0, 3.0
"""Length of a block along the tunnel, and its width around it, m; the middle of one is the crown."""

CERTAIN = 0.9
"""Probability from which a leak counts as found."""

DROPS = (1.5, 3.0, 6.0)
"""Darkenings for which the smallest leak is determined, dB."""

MIN_KNOWN = 0.5
"""Minimum share of a block's lining in conditions that occurred in trials."""

STEPS = 9
"""Number of bisections for the smallest leak: within 1 % of its area."""


@dataclass(frozen=True)
class Detectability:
    """Leaks that detection would find in the blocks (n) of a kilometre.

    Attributes
    ----------
    trials : int
        Number of synthetic leaks from which this is known.
    chainage_from, chainage_to, arc_from, arc_to : (n,) float arrays
        Limits of the inspected lining of each block, m.
    lining : (n,) float array
        Inspected lining, m².
    probability : (n,) float array
        Probability that a leak of the demanded area and darkening is found, if it lies anywhere in the block; NaN if unknown.
    smallest : (len(DROPS), n) float array
        Area of the smallest leak found with a probability of at least CERTAIN, m², at least AREAS[0]; NaN if none up to
        AREAS[1] is, or if unknown.
    """

    trials: int
    chainage_from: Float
    chainage_to: Float
    arc_from: Float
    arc_to: Float
    lining: Float
    probability: Float
    smallest: Float


def measure_detectability(grid: Grid, conditions: Conditions, trials: Trials, area: float, drop: float) -> Detectability:
    """Determine which leaks detection would find in each block of a kilometre.

    Without enough trials nothing is known, nor in a block most of whose lining is in worse conditions than all trials.

    Parameters
    ----------
    grid : Grid
        Pixels of the picture.
    conditions : Conditions
    trials : Trials
        Trials in the same picture.
    area, drop : float
        Demand: area, m², and darkening, dB, of the leaks to be found.
    """
    tiles = _Tiles.of(grid, conditions)
    count = len(tiles.seen)
    probability, smallest = np.full(count, np.nan), np.full((len(DROPS), count), np.nan)
    if len(trials.found) >= MIN_TRIALS:
        chance = Chance.fit(trials)
        weights = tiles.weights * chance.covers(tiles.conditions)
        total = tiles.total(weights)
        known = total >= MIN_KNOWN * tiles.seen

        def found(areas: Float, darkening: float) -> Float:
            """Return the mean probability in each block, for leaks of the block's area."""
            of_tile = chance.probability(areas[tiles.block], np.full(len(weights), darkening), tiles.conditions)
            return tiles.total(weights * of_tile) / np.maximum(total, 1e-9)

        probability[known] = found(np.full(count, area), drop)[known]
        for k, darkening in enumerate(DROPS):
            smallest[k, known] = _smallest(partial(found, darkening=darkening), count)[known]
    west, east, low, high = tiles.limits
    lining = tiles.seen * grid.pixel**2
    return Detectability(len(trials.found), west, east, low, high, lining, probability, smallest)


@dataclass(frozen=True)
class _Tiles:
    """Tiles of a kilometre with inspected lining (k), and the blocks (n) in which their middles are.

    Attributes
    ----------
    block : (k,) int array
        Number of the block.
    weights : (k,) float array
        Pixels of inspected lining.
    conditions : (k, len(NAMES)) float array
    seen : (n,) float array
        Pixels of inspected lining.
    limits : (4, n) float array
        First and last chainage, first and last arc of the tiles, within the block, m.
    """

    block: Int64
    weights: Float
    conditions: Float
    seen: Float
    limits: Float

    @classmethod
    def of(cls, grid: Grid, conditions: Conditions) -> _Tiles:
        """Assign the tiles to blocks."""
        tile = conditions.tile
        row, column = np.nonzero(conditions.seen)
        inner = (column * tile >= grid.inner.start) & (column * tile < grid.inner.stop)
        row, column = row[inner], column[inner]
        west = grid.west + column * tile * grid.pixel
        top = (grid.bottom + grid.rows - row * tile) * grid.pixel
        bottom = np.maximum(top - tile * grid.pixel, grid.bottom * grid.pixel)
        place = np.column_stack([
            np.floor((west + 0.5 * tile * grid.pixel) / LENGTH), np.floor(0.5 * (top + bottom) / WIDTH + 0.5)
        ])  # fmt: skip
        blocks, block = np.unique(place, axis=0, return_inverse=True)
        block = block.reshape(-1)
        low = [_extreme(np.minimum, values, block, len(blocks)) for values in (west, bottom)]
        high = [_extreme(np.maximum, values, block, len(blocks)) for values in (west + tile * grid.pixel, top)]
        along, around = LENGTH * blocks[:, 0], WIDTH * (blocks[:, 1] - 0.5)
        limits = np.stack([
            np.maximum(low[0], along), np.minimum(high[0], along + LENGTH), np.maximum(low[1], around),
            np.minimum(high[1], around + WIDTH),
        ])  # fmt: skip
        weights = conditions.seen[row, column].astype(np.float64)
        seen = np.bincount(block, weights, len(blocks)).astype(np.float64)
        return cls(block, weights, conditions.values[:, row, column].T, seen, limits)

    def total(self, values: Float) -> Float:
        """Sum values of tiles (k,) by blocks."""
        totals: Float = np.bincount(self.block, values, len(self.seen)).astype(np.float64)
        return totals


def _extreme(ufunc: np.ufunc, values: Float, block: Int64, count: int) -> Float:
    """Return the extreme of values by blocks."""
    extreme = np.full(count, -np.inf if ufunc is np.maximum else np.inf)
    ufunc.at(extreme, block, values)
    return extreme


def _smallest(found: Callable[[Float], Float], count: int) -> Float:
    """Return the smallest area (n,) found with a probability of at least CERTAIN, m²; NaN if none up to AREAS[1] is.

    Parameters
    ----------
    found : callable
        Returns the probabilities for areas (n,); they grow with the area.
    count : int
        Number of blocks.
    """
    low, high = (np.full(count, np.log(area)) for area in AREAS)
    never, always = found(np.exp(high)) < CERTAIN, found(np.exp(low)) >= CERTAIN
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        enough = found(np.exp(middle)) >= CERTAIN
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    area = np.where(always, AREAS[0], np.exp(high))
    area[never] = np.nan
    return area
