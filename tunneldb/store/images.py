"""Images, radiometry, range curve and coverage of a kilometre, to and from the database."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple
from typing import Any

import numpy as np
import psycopg
import shapely
from shapely.geometry import Polygon

from tunneldb.anomalies.background.level_map import BackgroundMap
from tunneldb.anomalies.bands import DarkBand
from tunneldb.anomalies.coverage import Coverage
from tunneldb.arrays import Bool, Single, UInt8, known
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.radiometry.range_curve import RangeCurve
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.radiometry.robust_statistics import DryLevel
from tunneldb.radiometry.roughness import Roughness
from tunneldb.raster.accumulator import Window
from tunneldb.raster.geotiff import OVERVIEW, RGB, Raster, decode, encode
from tunneldb.raster.grid import BLOCKS, Grid
from tunneldb.raster.overview import Overview
from tunneldb.raster.state import PixelState
from tunneldb.store.survey import Survey


def load_reference(conn: psycopg.Connection[Any], survey: Survey) -> ReferenceCurve | None:
    """Read the reference curve of a survey, None when it has none."""
    rows = conn.execute(
        "SELECT range_m, intensity_db FROM tunnel.reference WHERE survey_id = %s ORDER BY range_m", (survey.id,)
    ).fetchall()
    if not rows:
        return None
    table = np.array(rows, dtype=np.float64)
    return ReferenceCurve.from_rows(table[:, 0], table[:, 1])


def image_blocks(conn: psycopg.Connection[Any], survey: Survey, km: int, kind: str) -> list[int]:
    """Return the numbers of the blocks of a kilometre's image of a kind, in order."""
    rows = conn.execute(
        "SELECT block FROM tunnel.image WHERE survey_id = %s AND km = %s AND kind = %s ORDER BY block", (survey.id, km, kind)
    )
    return [block for (block,) in rows]


def survey_blocks(conn: psycopg.Connection[Any], survey: Survey, kind: str) -> list[int]:
    """Return the numbers of the blocks of a survey's image of a kind, in order."""
    rows = conn.execute("SELECT block FROM tunnel.image WHERE survey_id = %s AND kind = %s ORDER BY block", (survey.id, kind))
    return [block for (block,) in rows]


def load_block(conn: psycopg.Connection[Any], survey: Survey, km: int, kind: str, block: int) -> Raster:
    """Read a block that is there."""
    return load_kinds(conn, survey, km, block, (kind,))[kind]


def load_kinds(conn: psycopg.Connection[Any], survey: Survey, km: int, block: int, kinds: Sequence[str]) -> dict[str, Raster]:
    """Read the images of a block by kind; those that are not stored are missing."""
    rows = conn.execute(
        "SELECT kind, tiff FROM tunnel.image WHERE survey_id = %s AND km = %s AND block = %s AND kind = ANY(%s)",
        (survey.id, km, block, list(kinds)),
        binary=True,
    ).fetchall()
    return {kind: decode(tiff, kind) for kind, tiff in rows}


def load_regions(conn: psycopg.Connection[Any], survey: Survey, km: int, kind: str) -> list[Polygon]:
    """Read the polygons of a kind (homogeneous or dry) that the user drew in a kilometre, in the unrolled plane.

    One that waits for an operator is left out.
    """
    rows = conn.execute(
        "SELECT public.ST_AsBinary(geom) FROM tunnel.region WHERE survey_id = %s AND kind = %s AND NOT pending_approval"
        " AND public.ST_XMax(geom) > %s AND public.ST_XMin(geom) < %s ORDER BY id",
        (survey.id, kind, km * KILOMETRE, (km + 1) * KILOMETRE),
    ).fetchall()
    return [shapely.from_wkb(bytes(wkb)) for (wkb,) in rows]


class ImageStore:
    """Replaces the images of a kilometre, block by block.

    Parameters
    ----------
    conn, survey
        Place.
    kinds : sequence of str
        Kinds of images.

    Attributes
    ----------
    pixels : int
        Number of saved pixels with points.
    """

    def __init__(self, conn: psycopg.Connection[Any], survey: Survey, kinds: Sequence[str]) -> None:
        self.conn, self.survey, self.kinds = conn, survey, kinds
        self.pixels = 0
        self._blocks: list[int] = []
        self._overviews = {kind: Overview(kind) for kind in (*kinds, "state")}

    def save(self, grid: Grid, window: Window) -> None:
        """Save a whole block of a grid as points fell into it."""
        columns = window.columns
        block = grid.first_block + columns.start // grid.block_columns
        if not self._blocks:  # only now: what makes the images takes long, and others look at those that are there
            # Deviation is not made here: it stays, stale, with its sections. Images of other instruments stay, too.
            self.conn.execute(
                "DELETE FROM tunnel.image WHERE survey_id = %s AND km = %s AND kind !~ '^(overview_)?(deviation|imported)_'",
                (self.survey.id, grid.km),
            )
        self.pixels += int(np.count_nonzero(window.weight))
        self._blocks.append(block)
        for kind in self.kinds:
            self._insert(grid, kind, block, Raster(_values(window, kind), grid.transform(columns.start)))

    def save_colours(self, grid: Grid, block: int, colours: Single) -> None:
        """Save the colours (rows, columns of a block, 3) of a block of a grid, counted from 0, that was saved before."""
        if not np.isfinite(colours).any():
            return
        self._overviews.setdefault(RGB, Overview(RGB))
        place = grid.transform(block * grid.block_columns)
        self._insert(grid, RGB, grid.first_block + block, Raster(colours, place))

    def save_states(self, grid: Grid, state: UInt8, dark: Bool) -> None:
        """Save the states of the pixels (rows, columns) of the kilometre, in blocks saved before; ``DARK`` for dark ones."""
        for block in self._blocks:
            first = (block - grid.first_block) * grid.block_columns
            columns = slice(first, first + grid.block_columns)
            values = np.where(dark[:, columns], np.float32(PixelState.DARK), state[:, columns].astype(np.float32))
            self._insert(grid, "state", block, Raster(values, grid.transform(first)))

    def save_overviews(self, grid: Grid) -> None:
        """Save the overviews of the images saved before."""
        for overview in self._overviews.values():
            save_overview(self.conn, self.survey, grid.km, overview)

    def _insert(self, grid: Grid, kind: str, block: int, raster: Raster) -> None:
        self._overviews[kind].add(raster)
        insert_image(self.conn, self.survey, grid.km, kind, block, encode(raster, kind))


def insert_image(conn: psycopg.Connection[Any], survey: Survey, km: int, kind: str, block: int, tiff: bytes) -> None:
    """Add a block of an image."""
    conn.execute(
        "INSERT INTO tunnel.image (survey_id, km, kind, block, tiff) VALUES (%s, %s, %s, %s, %b)",
        (survey.id, km, kind, block, tiff),
    )


def save_overview(conn: psycopg.Connection[Any], survey: Survey, km: int, overview: Overview) -> None:
    """Add the overview of a kilometre, if it has blocks; the former one must be deleted before."""
    raster = overview.raster()
    if raster is not None:
        insert_image(conn, survey, km, OVERVIEW + overview.kind, km * BLOCKS, encode(raster, overview.kind))


def _values(window: Window, kind: str) -> Single:
    values: Single = getattr(window, kind)
    return values


def save_radiometry(
    conn: psycopg.Connection[Any],
    survey: Survey,
    km: int,
    roughness: Roughness,
    dry: BackgroundMap,
    pixels: int,
    wet_pixels: int,
    sigma: tuple[DryLevel, DryLevel, DryLevel],
) -> None:
    """Replace the radiometry of a kilometre.

    Parameters
    ----------
    conn, survey, km
        Place.
    roughness : Roughness
        Stored as NULL where the incidence angles don't determine it.
    dry : BackgroundMap
        Dry lining: the medians of its level and standard deviation, with the threshold by them.
    pixels, wet_pixels : int
        Pixels of lining, and of these covered by leaks.
    sigma : three Dry
        Dry lining points raw, corrected by Lambert's law and by Oren–Nayar (Table 1 of Xu et al., 2018).
    """
    drop_radiometry(conn, survey, km)
    conn.execute(
        "INSERT INTO tunnel.radiometry (survey_id, km, roughness, dry_mean, dry_sigma, threshold, sigma_raw,"
        " sigma_lambert, sigma_oren_nayar, regions, pixels, wet_pixels)"
        " VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s)",
        (
            survey.id,
            km,
            roughness.sigma if roughness.determined else None,
            *(known(v) for v in (dry.mean, dry.spread, dry.mean - 3.0 * dry.spread)),
            *(known(s.sigma) for s in sigma),
            roughness.regions,
            pixels,
            wet_pixels,
        ),
    )


def save_coverage(conn: psycopg.Connection[Any], survey: Survey, km: int, coverage: Coverage) -> None:
    """Replace the coverage of a kilometre."""
    drop_coverage(conn, survey, km)
    conn.execute(
        "INSERT INTO tunnel.coverage (survey_id, km, step, lining, seen, wet) VALUES (%s, %s, %s, %s, %s, %s)",
        (survey.id, km, coverage.step, *(areas.tolist() for areas in (coverage.lining, coverage.seen, coverage.wet))),
    )


def save_bands(conn: psycopg.Connection[Any], survey: Survey, km: int, bands: Sequence[DarkBand]) -> None:
    """Replace the dark bands of a kilometre."""
    drop_bands(conn, survey, km)
    with conn.cursor() as cursor:
        cursor.executemany(
            "INSERT INTO tunnel.dark_band (survey_id, km, n, chainage_from, chainage_to, arc_from, arc_to, darkening, area)"
            " VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s)",
            [(survey.id, km, n, *astuple(band)) for n, band in enumerate(bands)],
        )


def drop_bands(conn: psycopg.Connection[Any], survey: Survey, km: int) -> None:
    """Delete the dark bands of a kilometre."""
    conn.execute("DELETE FROM tunnel.dark_band WHERE survey_id = %s AND km = %s", (survey.id, km))


def drop_coverage(conn: psycopg.Connection[Any], survey: Survey, km: int) -> None:
    """Delete the coverage of a kilometre."""
    conn.execute("DELETE FROM tunnel.coverage WHERE survey_id = %s AND km = %s", (survey.id, km))


def drop_radiometry(conn: psycopg.Connection[Any], survey: Survey, km: int) -> None:
    """Delete the radiometry of a kilometre."""
    conn.execute("DELETE FROM tunnel.radiometry WHERE survey_id = %s AND km = %s", (survey.id, km))


def save_range_curve(conn: psycopg.Connection[Any], survey: Survey, km: int, found: RangeCurve | None) -> None:
    """Replace the range curve that was found on the lining of a kilometre; None takes it away.

    Its deviation is NULL beyond the ranges present, where it goes on by its slope.
    """
    conn.execute("DELETE FROM tunnel.range_curve WHERE survey_id = %s AND km = %s", (survey.id, km))
    if found is not None:
        sigma = [s if there else None for s, there in zip(found.sigma_db.tolist(), found.present.tolist(), strict=True)]
        conn.execute(
            "INSERT INTO tunnel.range_curve (survey_id, km, range_m, intensity_db, sigma_db) VALUES (%s, %s, %s, %s, %s)",
            (survey.id, km, found.curve.range_m.tolist(), found.curve.intensity_db.tolist(), sigma),
        )
