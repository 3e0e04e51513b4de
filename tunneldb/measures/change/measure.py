"""Change of the lining and its leaks between two surveys of a tunnel, kilometre by kilometre."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import psycopg
import shapely
from affine import Affine
from rasterio import features
from shapely.geometry import MultiPolygon, Polygon

from tunneldb.anomalies.geometries import anomaly_geometries
from tunneldb.arrays import Bool, Float, Single
from tunneldb.errors import UserError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.measures.change.compute import change as shape_change
from tunneldb.measures.change.compute.cells import (
    MIN_SEEN_SHARE,
    MIN_SIDE,
    CellGrid,
    Cells,
    CellSums,
    with_hollows,
    without_edges,
)
from tunneldb.measures.change.compute.leaks import Group, Leak, groups, state_of, wet_area
from tunneldb.measures.change.compute.sections import Change, measure_change, median, section_figures
from tunneldb.measures.change.rows import (
    StoredGroup,
    StoredRegion,
    clear_change,
    load_blocks,
    load_leaks,
    save_images,
    save_leaks,
    save_regions,
    save_sections,
)
from tunneldb.measures.deviation.measure import lining_by_class
from tunneldb.progress import StartProgress
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.state import PixelState, shows_lining
from tunneldb.stages.on_demand import measure_kilometres, refuse_beyond, refuse_wrong_pair
from tunneldb.stages.stale import Result, refuse_blocked, result_states
from tunneldb.store.images import image_blocks, load_block
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey

NEWER_SURVEY_MARGIN = 5.0
"""Distance beyond the ends of a kilometre, m, from which parts of the newer survey may be in it by the older one's axis."""


HALO = 100.0
"""Distance beyond the ends of a kilometre, m, within which leaks are matched with it, so that groups are the same from both."""

_AT_A_TIME = 2_000_000  # pixels


def compare(
    conn: psycopg.Connection[Any],
    old: Survey,
    new: Survey,
    low: float,
    high: float,
    cell: float,
    length: float,
    begin: StartProgress,
) -> list[int]:
    """Bring the change of a stretch up to date, each kilometre in one transaction; return those that were made.

    Parameters
    ----------
    conn : Connection
        Idle.
    old, new : Survey
        Surveys of one tunnel.
    low, high : float
        Chainage, m.
    cell, length : float
        Side of a cell, and length of a section, m.
    begin : callable
        See `tunneldb.progress.StartProgress`.

    Raises
    ------
    UserError
        If they are of two tunnels or one and the same, the older one comes last, they have no kilometre in common, or one is
        out of date.
    """
    refuse_wrong_pair(conn, old, new, "compare")
    for survey in (old, new):
        refuse_beyond(conn, survey, low, high)
    result = change_between(old, new)
    states = result_states(conn, result, low, high)
    conn.rollback()
    if not states:
        raise UserError(
            f"{old.name} and {new.name} have no common kilometre with offset images there: make them with tunneldb run"
        )
    refuse_blocked(states, "SURVEY", "compare")
    return measure_kilometres(
        conn, result, states, lambda km: {"cell": cell, "length": length},
        lambda km: _kilometre(conn, old, new, km, cell, length), f"change from {old.name} to {new.name}", begin,
    )  # fmt: skip


def change_between(old: Survey, new: Survey) -> Result:
    """Return the result of this measure that is of a pair of surveys."""
    return Result(new, "compare", {"old": old.id})


def _kilometre(conn: psycopg.Connection[Any], old: Survey, new: Survey, km: int, cell: float, length: float) -> dict[str, Any]:
    clear_change(conn, old, new, km)
    low, high = km * KILOMETRE, (km + 1) * KILOMETRE
    surface, other = (
        load_surface(conn, old, low, high),
        load_surface(conn, new, low - NEWER_SURVEY_MARGIN, high + NEWER_SURVEY_MARGIN),
    )
    sums = _old_sums(conn, old, km, surface, cell)
    if sums is None:  # it was there when it was asked for
        return {"sections": 0}
    newer = _new_sums(conn, new, km, other, surface, sums.grid, sums.pixel)
    first, second = (without_edges(cells) for cells in with_hollows(sums, newer))
    grid, pixel = sums.grid, sums.pixel
    del sums, newer  # a third of the memory that is needed
    found = measure_change(surface, grid, first, second, length, pixel)
    transform = Affine(cell, 0.0, grid.west, 0.0, -cell, grid.south + grid.rows * cell)
    save_sections(conn, old, new, km, section_figures(found))
    save_images(
        conn, old, new, km, *(Raster(np.ascontiguousarray(values[::-1]), transform) for values in (found.difference, found.lod))
    )
    regions = [
        stored
        for region in shape_change.change_regions(
            found.difference, found.variance, found.removed_error, found.scatter, found.place_error
        )
        for stored in _stored_region(region, grid, surface)
    ]
    save_regions(conn, old, new, km, regions)
    leaks = _leaks(conn, (old, new), km, (surface, other), found, pixel)
    save_leaks(conn, old, new, km, leaks)
    both = np.isfinite(found.difference)
    return {
        "sections": len(found.sections), "regions": len(regions), "region_area": sum(region.area for region in regions),
        "leaks": len(leaks), "compared_area": float(both.sum()) * cell**2,
        "unseen_area": float((np.isfinite(first.offset) & ~both).sum()) * cell**2,
        "scatter": found.scatter.factors.tolist(), "lod": lod if np.isfinite(lod := median(found.lod)) else None,
    }  # fmt: skip


def _old_sums(conn: psycopg.Connection[Any], old: Survey, km: int, surface: Surface, cell: float) -> CellSums | None:
    """Sum the older survey's kilometre by cell; the grid covers the stored blocks."""
    ends = _extent(conn, old, km)
    if ends is None:
        return None
    west, east, south, north, pixel = ends
    if cell < MIN_SIDE * pixel * (1.0 - 1e-5):
        raise UserError(f"cells of {cell:g} m have too few pixels of {pixel:g} m: give --cell {MIN_SIDE * pixel:g} or more")
    row = np.floor(south / cell), np.ceil(north / cell)
    column = np.floor(west / cell + 1e-9), np.ceil(east / cell - 1e-9)
    grid = CellGrid(cell, float(column[0] * cell), float(row[0] * cell), int(column[1] - column[0]), int(row[1] - row[0]))
    sums = CellSums(grid, pixel)
    classes = _Lining(conn, old, km, surface)
    for raster, state in load_blocks(conn, old, km * KILOMETRE, (km + 1) * KILOMETRE - 1e-6):
        seen, lining = classes.seen(raster, state)
        for part in _parts(raster, seen):
            chainage, arc, offset = _places(raster, part)
            sums.add(chainage, arc, offset, lining[part])
    return sums


def _new_sums(
    conn: psycopg.Connection[Any], new: Survey, km: int, surface: Surface, old: Surface, grid: CellGrid, pixel: float
) -> CellSums:
    """Sum the newer survey in the cells of the older one's plane; each pixel is transformed through space."""
    sums = CellSums(grid, pixel)
    classes = _Lining(conn, new, km, surface)
    for raster, state in load_blocks(
        conn, new, km * KILOMETRE - NEWER_SURVEY_MARGIN, (km + 1) * KILOMETRE + NEWER_SURVEY_MARGIN
    ):
        seen, lining = classes.seen(raster, state)
        for part in _parts(raster, seen):
            points = surface.to_space(*_places(raster, part))
            valid = np.isfinite(points[:, 0])
            there = old.unroll(points[valid])
            sums.add(there.chainage, there.arc, there.offset, lining[part][valid])
    return sums


class _Lining:
    """Content of a survey's pixels: from their stored states, or without these from the classes of stage ``ground``."""

    def __init__(self, conn: psycopg.Connection[Any], survey: Survey, km: int, surface: Surface) -> None:
        self._of = conn, survey, km, surface
        self._classes: Callable[[Raster], Bool] | None = None

    def seen(self, raster: Raster, state: Single | None) -> tuple[Bool, Bool]:
        """Return the pixels that show lining or its recesses, and those that show lining."""
        there = np.isfinite(raster.values)
        if state is None:
            self._classes = self._classes or lining_by_class(*self._of)
            lining = self._classes(raster)
            return lining, lining
        lining = there & shows_lining(state)
        return lining | (there & (state == PixelState.RECESS)), lining


def _extent(conn: psycopg.Connection[Any], survey: Survey, km: int) -> tuple[float, float, float, float, float] | None:
    """Return the range of chainage and of arc of a kilometre's offset image, and its pixel, m."""
    blocks = image_blocks(conn, survey, km, "offset")
    if not blocks:
        return None
    first = load_block(conn, survey, km, "offset", blocks[0])  # all blocks of a kilometre have its rows
    place, (rows, columns) = first.transform, first.values.shape
    east = place.c + (blocks[-1] - blocks[0] + 1) * columns * place.a
    return place.c, east, place.f - rows * place.a, place.f, place.a


def _parts(raster: Raster, seen: Bool) -> list[tuple[Any, Any]]:
    row, column = np.nonzero(seen)
    return [(row[k : k + _AT_A_TIME], column[k : k + _AT_A_TIME]) for k in range(0, len(row), _AT_A_TIME)]


def _places(raster: Raster, part: tuple[Any, Any]) -> tuple[Float, Float, Float]:
    """Return chainage, arc and offset of pixels."""
    place = raster.transform
    return (
        place.c + (part[1] + 0.5) * place.a,
        place.f + (part[0] + 0.5) * place.e,
        raster.values[part].astype(np.float64),
    )


def _stored_region(region: shape_change.Region, grid: CellGrid, surface: Surface) -> list[StoredRegion]:
    """Return a region with its outline along the edges of its cells."""
    row, column = int(region.rows.min()), int(region.columns.min())
    mask = np.zeros((int(np.ptp(region.rows)) + 1, int(np.ptp(region.columns)) + 1), np.uint8)
    mask[region.rows - row, region.columns - column] = 1
    transform = Affine(grid.cell, 0.0, grid.west + column * grid.cell, 0.0, grid.cell, grid.south + row * grid.cell)
    outlines = [shapely.geometry.shape(one) for one, value in features.shapes(mask, transform=transform) if value == 1]
    return [
        StoredRegion(
            outline, anomaly_geometries(rings_apart(outline), surface), len(region.rows) * grid.cell**2, region.mean,
            region.lod, region.greatest,
        )
        for outline in outlines
    ]  # fmt: skip


def rings_apart(outline: shapely.Polygon) -> shapely.Polygon:
    """Shrink an outline of cells by 1 mm, so that its rings touch nowhere: QGIS fills no other in 3D.

    Cells that are connected share an edge, so that it stays in one piece.
    """
    return shapely.buffer(outline, -1e-3, join_style="mitre")


def _leaks(
    conn: psycopg.Connection[Any], surveys: tuple[Survey, Survey], km: int, surfaces: tuple[Surface, Surface], found: Change,
    pixel: float,
) -> list[StoredGroup]:  # fmt: skip
    """Return the groups of leaks whose middle is in the kilometre."""
    low, high = km * KILOMETRE, (km + 1) * KILOMETRE
    wide = [load_surface(conn, survey, low - HALO, high + HALO) for survey in surveys]
    old = load_leaks(conn, surveys[0], low - HALO, high + HALO)
    new = [_brought(leak, wide[1], wide[0]) for leak in load_leaks(conn, surveys[1], low - HALO, high + HALO)]
    looked = [survey.intensity_kind != "none" for survey in surveys]
    stored = []
    for group in groups(old, [leak for leak in new if leak is not None]):
        outline = group.outline
        if group.wet and low <= (outline.bounds[0] + outline.bounds[2]) / 2.0 < high:
            stored.append(_stored_group(group, outline, looked, wide[0], found, pixel))
    return stored


def _brought(leak: Leak, surface: Surface, old: Surface) -> Leak | None:
    """Transform a leak of the newer survey to the older one's plane; None where that has no surface."""

    def through_space(unrolled: Float) -> Float:
        there = old.unroll(surface.to_space(unrolled[:, 0], unrolled[:, 1], np.zeros(len(unrolled))))
        return np.column_stack([there.chainage, there.arc])

    outline = shapely.transform(leak.outline, through_space)
    coordinates = shapely.get_coordinates(outline)
    if not np.isfinite(coordinates).all():
        return None
    return Leak(leak.id, leak.kind, leak.wet, leak.area, leak.contrast, shapely.make_valid(outline))


def _stored_group(
    group: Group, outline: shapely.Geometry, looked: list[bool], surface: Surface, found: Change, pixel: float
) -> StoredGroup:
    seen = tuple(_seen_share(outline, cells, found.grid) if there else 0.0
                 for cells, there in zip((found.old, found.new), looked, strict=True))  # fmt: skip
    old, new = wet_area(group.old, pixel), wet_area(group.new, pixel)
    parts = sorted((part for part in _polygons(outline) if part.area > 0.0), key=lambda part: -part.area)
    shaped = [anomaly_geometries(part, surface) for part in parts]
    return StoredGroup(
        state_of(group, old, new, seen[0], seen[1]), group.old, group.new, (*old, *new), (seen[0], seen[1]), shaped[0].clock,
        MultiPolygon(parts), MultiPolygon([one.map for one in shaped]), MultiPolygon([one.surface for one in shaped]),
    )  # fmt: skip


def _polygons(shape: shapely.Geometry) -> list[Polygon]:
    return [part for part in shapely.get_parts(shape) if isinstance(part, Polygon)]


def _seen_share(outline: shapely.Geometry, cells: Cells, grid: CellGrid) -> float:
    """Return the share of a place that an epoch saw."""
    west, south, east, north = outline.bounds
    column = np.arange(max(int((west - grid.west) / grid.cell), 0), min(int((east - grid.west) / grid.cell) + 1, grid.columns))
    row = np.arange(max(int((south - grid.south) / grid.cell), 0), min(int((north - grid.south) / grid.cell) + 1, grid.rows))
    if not len(column) or not len(row):
        return 0.0
    chainage, arc = np.meshgrid(grid.chainage[column], grid.arc[row])
    boxes = shapely.box(chainage - grid.cell / 2.0, arc - grid.cell / 2.0, chainage + grid.cell / 2.0, arc + grid.cell / 2.0)
    shares = shapely.area(shapely.intersection(boxes, outline))
    return float(np.sum(shares * (cells.share[np.ix_(row, column)] >= MIN_SEEN_SHARE)) / max(float(outline.area), 1e-9))
