"""Deviation of a survey's lining from its design, to and from the database."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Bool
from tunneldb.measures.deviation.compute import Step
from tunneldb.raster.geotiff import DEVIATION_KINDS, OVERVIEW, Raster, encode
from tunneldb.raster.grid import BLOCK
from tunneldb.raster.overview import Overview
from tunneldb.raster.state import shows_lining
from tunneldb.store.images import image_blocks, insert_image, load_kinds, save_overview
from tunneldb.store.survey import Survey


def layers_held(conn: psycopg.Connection[Any], survey: Survey) -> list[str]:
    """Return the layers that a survey was compared with, from inside."""
    query = (
        "SELECT l FROM unnest(%s::text[]) WITH ORDINALITY AS u (l, n)"
        " WHERE EXISTS (SELECT FROM tunnel.deviation_section d WHERE d.survey_id = %s AND d.layer = l) ORDER BY n"
    )
    return [layer for (layer,) in conn.execute(query, [list(DEVIATION_KINDS), survey.id])]


def load_offsets(conn: psycopg.Connection[Any], survey: Survey, km: int) -> Iterator[tuple[Raster, Bool | None]]:
    """Load the blocks of a kilometre's offset image in order, with the pixels (rows, columns) of lining; None if not stored."""
    for block in image_blocks(conn, survey, km, "offset"):
        images = load_kinds(conn, survey, km, block, ("offset", "state"))
        yield images["offset"], shows_lining(images["state"].values) if "state" in images else None


def replace_image(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str, blocks: Iterable[Raster]) -> None:
    """Replace the image of a kilometre's deviation from a layer; blocks that show nothing are left out."""
    kind = DEVIATION_KINDS[layer]
    conn.execute(
        "DELETE FROM tunnel.image WHERE survey_id = %s AND km = %s AND kind = ANY(%s)", [survey.id, km, [kind, OVERVIEW + kind]]
    )
    overview = Overview(kind)
    for raster in blocks:
        if np.isfinite(raster.values).any():
            insert_image(conn, survey, km, kind, round(raster.transform.c / BLOCK), encode(raster, kind))
            overview.add(raster)
    save_overview(conn, survey, km, overview)


def save_steps(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str, steps: Sequence[Step]) -> None:
    """Replace the steps of a layer in a kilometre."""
    conn.execute("DELETE FROM tunnel.deviation_section WHERE survey_id = %s AND km = %s AND layer = %s", [survey.id, km, layer])
    query = (
        "COPY tunnel.deviation_section (survey_id, km, layer, profile, chainage_from, chainage_to, design_length, seen_length,"
        " overbreak, underbreak, noise_area, over_right, over_up, under_right, under_up, sigma, shift_right, shift_up,"
        " deviation_mean, deviation_least, least_at, deviation_greatest, greatest_at, deviation) FROM STDIN"
    )
    with conn.cursor() as cursor, cursor.copy(query) as copy:
        for step in steps:
            one = step.figures
            copy.write_row(
                (
                    survey.id, km, layer, step.profile, step.low, step.high, one.design_length, one.seen_length, one.overbreak,
                    one.underbreak, one.noise_area, *one.over_by.tolist(), *one.under_by.tolist(),
                    *(float(value) if np.isfinite(value) else None for value in (
                        one.sigma, *one.shift, one.mean, *one.extreme(-1.0), *one.extreme(1.0)
                    )),
                    one.deviation.tolist(),
                )
            )  # fmt: skip
