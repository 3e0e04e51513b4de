"""Cracks of a mask into a survey: traced, placed as an image, and drawn as findings; all or none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import shapely

from tunneldb.arrays import Bool, Int64
from tunneldb.counted import counted
from tunneldb.errors import InputError
from tunneldb.finding_kind import FindingKind
from tunneldb.pipeline.finding_layers import Row
from tunneldb.pipeline.findings import insert_once
from tunneldb.pipeline.image_placement import ControlPoint, ImportSettings, place_image
from tunneldb.raster.placement.checks import Lining
from tunneldb.raster.placement.mapping import Bounds, inverse, pixel_sides
from tunneldb.raster.placement.resample import Frame, Source
from tunneldb.raster.tracing.joining import TracedLine, join_images
from tunneldb.raster.tracing.lines import trace
from tunneldb.raster.tracing.thinning import thin
from tunneldb.store.crack_search import CrackSearch, add_crack_search
from tunneldb.store.imported_images import section_extent
from tunneldb.store.survey import Survey

PART = 1 << 24
"""Number of pixels that are read at once."""

HALO = 128
"""Pixels around a part by which its thinning is that of the whole image, if areas are at most half as wide."""

MAX_PIXELS = 20_000_000
"""Maximum number of pixels of a mask that are not 0."""

MAX_SHARE = 0.5
"""Share of such pixels from which a mask is refused as inverted."""

MAX_WIDTH = 100.0
"""Maximum width of a crack, mm."""

MAX_GAP, MAX_GAP_PIXELS = 0.02, 3.0
"""Maximum distance of a line and its continuation in the next frame, m and pixels."""

EDGE = 16
"""Number of points by which an edge of a frame is placed."""

SIMPLIFICATION = 0.5
"""Maximum distance of a line from the traced one, pixels."""


@dataclass(frozen=True)
class TracedResult:
    """Result of tracing.

    Attributes
    ----------
    ids : list of int
        Findings, in the order of lines.
    lines : list of TracedLine
        Cracks.
    short, short_length : int, float
        Number of pieces that are shorter than the minimum, and their length, m.
    wide, beyond, repeated : int
        Number of areas that are too wide for a crack, of lines beyond the lining, and of cracks that the survey has already.
    searched : CrackSearch
        Area of the masks on the lining.
    warnings, notes : list of str
        Of the placement.
    points : list of ControlPoint
    """

    ids: list[int]
    lines: list[TracedLine]
    short: int
    short_length: float
    wide: int
    beyond: int
    repeated: int
    searched: CrackSearch
    warnings: list[str]
    notes: list[str]
    points: list[ControlPoint]


def trace_mask(
    conn: psycopg.Connection[Any],
    survey: Survey,
    path: Path,
    points: Path | None,
    band: int | None,
    min_length: float,
    progress: Callable[[str, float | None], Callable[[float], None]],
) -> TracedResult:
    """Trace the cracks of a mask, or of a table of masks, and add them as open findings in one transaction.

    The area of the masks is recorded as searched for cracks.

    Parameters
    ----------
    conn, survey
        Target. The connection must not be in autocommit.
    path, points : Path
        Mask or table of frames, and control points, as for an imported image.
    band : int, optional
        Band of the mask.
    min_length : float
        Shorter lines are left out, m.
    progress : callable
        Called with each step that begins; returns a function that takes its progress.

    Raises
    ------
    UserError
        If a file cannot be read, the mask cannot be placed in the survey, or it has no crack.
    """
    lining = Lining(*section_extent(conn, survey))
    settings = ImportSettings(path.stem, "other", points, band=band, scale=1.0, offset=0.0)
    placement = place_image(conn, survey, path, settings, lining)
    lines = _traced(path, placement.frames, progress)
    pixel = max(pixel_sides(placement.frames[0].mapping))
    lines = join_images(lines, max(MAX_GAP, MAX_GAP_PIXELS * pixel))
    long = [line for line in lines if line.length >= min_length]
    cracks = [line for line in long if line.width_mm <= MAX_WIDTH]
    short = len(lines) - len(long)
    if not cracks:
        raise InputError(
            f"{path}: the mask has no crack of at least {min_length:g} m: {counted(short, 'shorter line')},"
            f" {counted(len(long), 'area')} wider than {MAX_WIDTH:g} mm; --min-length allows shorter ones; if the"
            " mask rightly has none, record that by: tunneldb findings searched"
        )
    ids, drawn, beyond = _insert(conn, survey, path, cracks, progress("cracks", len(cracks)))
    if beyond == len(cracks):
        raise InputError(f"{path}: all {counted(len(cracks), 'crack')} of the mask reach beyond the survey's lining")
    searched = add_crack_search(conn, survey, shapely.union_all([_outline(frame) for frame in placement.frames]), path.name)
    conn.commit()
    short_length = sum(line.length for line in lines if line.length < min_length)
    return TracedResult(
        ids, drawn, short, short_length, len(long) - len(cracks), beyond, len(cracks) - len(drawn) - beyond, searched,
        placement.placed.warnings, placement.notes, placement.points,
    )  # fmt: skip


def _insert(
    conn: psycopg.Connection[Any],
    survey: Survey,
    path: Path,
    cracks: Sequence[TracedLine],
    advance: Callable[[float], None],
) -> tuple[list[int], list[TracedLine], int]:
    """Insert new cracks as open findings; return their ids and lines, and the number of those beyond the lining."""
    ids, drawn, beyond = [], [], 0
    for number, line in enumerate(cracks, start=1):
        values = {"width_mm": f"{line.width_mm:.3f}", "review": "open", "remark": f"traced in {path.name}"}
        try:
            key = insert_once(conn, survey, Row(number, values, shapely.LineString(line.points), "unrolled"), FindingKind.CRACK)
        except psycopg.errors.InvalidParameterValue:  # beyond the lining
            beyond += 1
        else:
            if key is not None:
                ids.append(key)
                drawn.append(line)
        advance(1)
    return ids, drawn, beyond


def _outline(frame: Frame) -> shapely.Polygon:
    """Return the outline of a frame in the unrolled plane; its edges may be bent."""
    share = np.linspace(0.0, 1.0, EDGE, endpoint=False)
    column = np.concatenate((share, np.ones(EDGE), 1.0 - share, np.zeros(EDGE))) * frame.source.columns
    row = np.concatenate((np.zeros(EDGE), share, np.ones(EDGE), 1.0 - share)) * frame.source.rows
    return shapely.Polygon(np.column_stack(frame.mapping.forward(column, row)))


def _traced(
    path: Path, frames: Sequence[Frame], progress: Callable[[str, float | None], Callable[[float], None]]
) -> list[TracedLine]:
    """Return the lines of all frames, each of the part of a frame whose middle is nearer than that of the others."""
    advance = progress("masks", len(frames))
    lines = []
    for number, frame in enumerate(frames):
        thinned, mask = read_mask(path, frame.source)
        others = [other for other in frames if other is not frame]
        own = [places[_is_nearest(frame, others, places)] for places in (thinned, mask)]
        lines += _placed(frame, number, *own)
        advance(1)
    return lines


def _placed(frame: Frame, number: int, thinned: Int64, mask: Int64) -> list[TracedLine]:
    """Return the traced lines of a frame in the unrolled plane."""
    linear = frame.mapping.linear
    tolerance = SIMPLIFICATION * min(pixel_sides(frame.mapping))
    lines = []
    for found in trace(thinned, mask) if len(thinned) else []:
        points = np.column_stack(frame.mapping.forward(found.points[:, 1], found.points[:, 0]))
        simple = shapely.get_coordinates(shapely.simplify(shapely.LineString(points), tolerance))
        line = TracedLine(simple, found.pixels * abs(linear.determinant), number)
        lines += [line] if line.length > 0 else []
    return lines


def _is_nearest(frame: Frame, others: Sequence[Frame], places: Int64) -> Bool:
    """Return for pixels (row, column) of a frame whether no other frame has its middle nearer."""
    row, column = places.T + 0.5
    chainage, arc = frame.mapping.forward(column, row)
    nearest = np.ones(len(places), dtype=bool)
    own = _from_middle(frame, column, row)
    extent = _bounds(frame)
    for other in others:
        beside = _bounds(other)
        if beside.chainage_from < extent.chainage_to and beside.chainage_to > extent.chainage_from:
            nearest &= own <= _from_middle(other, *inverse(other.mapping, chainage, arc))
    return nearest


def _bounds(frame: Frame) -> Bounds:
    return frame.mapping.bounds(frame.source.columns, frame.source.rows)


def _from_middle(frame: Frame, column: Any, row: Any) -> Any:
    """Return the distance of pixels from the middle of a frame, as a share of its size; infinite outside it."""
    share = np.maximum(abs(column / frame.source.columns - 0.5), abs(row / frame.source.rows - 0.5))
    return np.where(share <= 0.5, share, np.inf)


def read_mask(path: Path, source: Source) -> tuple[Int64, Int64]:
    """Return row and column of the thinned pixels of a mask, and of all its pixels that are not 0.

    Raises
    ------
    InputError
        If it has several values besides 0, or too many pixels.
    """
    width = max(2 * HALO, PART // source.rows)
    thinned: list[Int64] = []
    mask: list[Int64] = []
    values: set[tuple[float, ...]] = set()
    for start in range(0, source.columns, width):
        low, high = max(0, start - HALO), min(source.columns, start + width + HALO)
        bands = np.nan_to_num(source.read(slice(low, high), slice(0, source.rows), 1))
        there = (bands != 0).any(axis=0)
        found = bands[:, there]
        if found.size:
            values |= {tuple(found.min(axis=1).tolist()), tuple(found.max(axis=1).tolist())}
        if len(values) > 1:
            listed = " and ".join(f"{max(value):g}" for value in sorted(values)[:2])
            raise InputError(
                f"{path}: the mask has several values besides 0, such as {listed}; write one with 0 and one other value, for"
                " cracks"
            )
        if there.mean() > MAX_SHARE:
            raise InputError(
                f"{path}: {100 * there.mean():.0f} % of the mask's pixels are not 0; invert it: only pixels of cracks are not 0"
            )
        core = slice(start - low, min(start + width, source.columns) - low)
        for image, places in ((thin(there), thinned), (there, mask)):
            at = np.argwhere(image[:, core])
            at[:, 1] += start
            places.append(at)
        if sum(len(places) for places in mask) > MAX_PIXELS:
            raise InputError(f"{path}: more than {MAX_PIXELS} pixels of the mask are not 0; divide it")
    return np.concatenate(thinned), np.concatenate(mask)
