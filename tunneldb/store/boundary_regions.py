"""Dark regions that reach the ends of kilometres, to the database and back."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import psycopg

from tunneldb.anomalies.records import BoundaryRegion
from tunneldb.anomalies.regions import Region, RegionProperties
from tunneldb.store.survey import Survey

LOCK = -3
"""First key of the advisory lock; the survey is the second. Findings across kilometre boundaries are written one by one."""


def replace_boundary_regions(conn: psycopg.Connection[Any], survey: Survey, km: int, regions: Sequence[Region]) -> set[int]:
    """Replace the boundary regions of a kilometre; return the keys of the findings that the earlier ones belonged to.

    No other transaction can do so for this survey until this one ends.
    """
    what = f"the list of findings of {survey.name}"
    conn.execute("SELECT tunnel_internal.wait_lock(%s, %s, false, %s)", [LOCK, survey.id, what])
    before = conn.execute(
        "DELETE FROM tunnel.boundary_region WHERE survey_id = %s AND km = %s RETURNING finding_id", (survey.id, km)
    ).fetchall()
    with conn.cursor() as cursor:
        cursor.executemany(
            "INSERT INTO tunnel.boundary_region (survey_id, km, pixel, box, mask, filled, darkening_sum,"
            " darkening_max, properties)"
            " VALUES (%s, %s, %s, %s, %b, %s, %s, %s, %s)",
            [_row(survey, km, region) for region in regions],
        )
    return {finding for (finding,) in before if finding is not None}


def load_boundary_regions(conn: psycopg.Connection[Any], survey: Survey, kilometres: Iterable[int]) -> list[BoundaryRegion]:
    """Read the boundary regions of some kilometres."""
    rows = conn.execute(
        "SELECT id, km, finding_id, pixel, box, mask, filled, darkening_sum, darkening_max, properties"
        " FROM tunnel.boundary_region"
        " WHERE survey_id = %s AND km = ANY (%s) ORDER BY id",
        (survey.id, list(kilometres)),
        binary=True,
    )
    found = []
    for key, km, finding, pixel, (column, row, columns, height), bits, filled, total, most, properties in rows:
        mask = np.unpackbits(np.frombuffer(bits, np.uint8), count=height * columns).astype(np.bool_).reshape(height, columns)
        region = Region(pixel, column, row, mask, filled, total, most, RegionProperties(*properties))
        found.append(BoundaryRegion(key, km, finding, region))
    return found


def link_boundary_regions(conn: psycopg.Connection[Any], regions: Sequence[BoundaryRegion], finding: int | None) -> None:
    """Write which finding some boundary regions are parts of."""
    keys = [region.id for region in regions]
    conn.execute("UPDATE tunnel.boundary_region SET finding_id = %s WHERE id = ANY (%s)", (finding, keys))


def _row(survey: Survey, km: int, region: Region) -> tuple[Any, ...]:
    rows, columns = region.mask.shape
    box = [region.column, region.row, columns, rows]
    return (
        survey.id, km, region.pixel, box, np.packbits(region.mask).tobytes(), region.filled, region.darkening_sum,
        region.darkening_max,
        list(region.properties),
    )  # fmt: skip
