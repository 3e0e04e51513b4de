"""Measure what other images than the intensity show under findings: the scan's colours, and imported images."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import Any

import psycopg
import shapely

from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.grid import BLOCK, BLOCKS
from tunneldb.raster.surroundings import compare
from tunneldb.store.finding_images import Outline, Row, load_outlines, measurable_images, replace_rows
from tunneldb.store.images import load_kinds, survey_blocks
from tunneldb.store.survey import Survey

MARGIN = 2.0
"""Distance beyond a stretch from which other findings are left out of surroundings, m; pixels of 0.1 m reach 1 m."""


def measure_under_findings(
    conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, image: str | None = None
) -> None:
    """Replace the values of images under the findings that overlap a stretch, in the caller's transaction.

    Parameters
    ----------
    conn, survey
        Place.
    low, high : float
        Stretch, m.
    image : str, optional
        Kind of one image; by default all are measured.
    """
    around = load_outlines(conn, survey, low - MARGIN, high + MARGIN)
    outlines = [one for one in around if one.polygon.bounds[2] >= low and one.polygon.bounds[0] <= high]
    for kind, number in measurable_images(conn, survey).items():
        if image in (None, kind):
            replace_rows(conn, number, outlines, _rows(_reader(conn, survey, kind), outlines, around))


def measure_kilometre(conn: psycopg.Connection[Any], survey: Survey, km: int) -> None:
    """Replace the values of all images under the findings of a kilometre."""
    measure_under_findings(conn, survey, km * KILOMETRE, (km + 1) * KILOMETRE)


def _rows(
    blocks_between: Callable[[float, float], list[Raster]], outlines: Sequence[Outline], around: Sequence[Outline]
) -> Iterator[Row]:
    tree = shapely.STRtree([other.polygon for other in around])
    for outline in outlines:
        west, _, east, _ = outline.polygon.bounds
        beside = tree.query(outline.polygon, predicate="dwithin", distance=MARGIN).tolist()
        others = [around[n].polygon for n in beside if around[n].finding != outline.finding]
        found = compare(outline.polygon, others, blocks_between(west - MARGIN, east + MARGIN))
        if found is not None:
            yield Row(outline.finding, outline.key, found.mean, found.surroundings, found.spread, found.share)


def _reader(conn: psycopg.Connection[Any], survey: Survey, kind: str) -> Callable[[float, float], list[Raster]]:
    """Return a function that returns the blocks of an image in a stretch, m. A few stay in memory: findings follow in order."""
    there = frozenset(survey_blocks(conn, survey, kind))

    @lru_cache(maxsize=3)
    def block(number: int) -> Raster:
        return load_kinds(conn, survey, number // BLOCKS, number, (kind,))[kind]

    def between(low: float, high: float) -> list[Raster]:
        numbers = range(int(low // BLOCK), int(high // BLOCK) + 1)
        return [block(number) for number in numbers if number in there]

    return between
