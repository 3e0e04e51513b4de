"""Dark regions cut by the ends of kilometres: kept in the database, and put together whichever kilometre is done first."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg

from tunneldb.anomalies.regions import Region, RegionProperties, merge_regions, touching_groups
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.store.survey import Survey

LOCK = -3
"""First key of the advisory lock, the survey being the second: anomalies over ends of kilometres are written one by one."""


@dataclass(frozen=True)
class Part:
    """A region that an end of its kilometre cuts.

    Attributes
    ----------
    id : int
        Key of its row.
    km : int
        Kilometre.
    anomaly : int or None
        Key of the anomaly that it is a part of.
    region : Region
        Its pixels.
    """

    id: int
    km: int
    anomaly: int | None
    region: Region

    def reaches(self, plane: int) -> bool:
        """Tell whether it reaches the beginning of kilometre ``plane``, from either side."""
        column = round(plane * KILOMETRE / self.region.pixel)
        return column in (self.region.column, self.region.stop)


@dataclass(frozen=True)
class Cluster:
    """Parts that touch one another, from one kilometre or several, and the region that they make."""

    parts: Sequence[Part]
    region: Region


@dataclass(frozen=True)
class Border:
    """What lies over the ends of a kilometre.

    Attributes
    ----------
    clusters : sequence of Cluster
        Those with a part in the kilometre or at its ends, in order of chainage.
    anomalies : set of int
        Anomalies that they, and the parts that the kilometre had before, were written as.
    first, last : int
        Kilometres over which they lie.
    other_pixels : list of int
        Neighbours with parts at its ends whose pixels are of another size, so that nothing can be put together.
    """

    clusters: Sequence[Cluster]
    anomalies: set[int]
    first: int
    last: int
    other_pixels: list[int]


def replace_parts(conn: psycopg.Connection[Any], survey: Survey, km: int, cut: Sequence[Region]) -> Border:
    """Put new parts in the place of a kilometre's, and gather what lies over its ends now.

    Nobody else does so for this survey until the transaction ends.
    """
    conn.execute("SELECT pg_advisory_xact_lock(%s, %s)", (LOCK, survey.id))
    before = conn.execute(
        "DELETE FROM tunnel.anomaly_part WHERE survey_id = %s AND km = %s RETURNING anomaly_id", (survey.id, km)
    ).fetchall()
    with conn.cursor() as cursor:
        cursor.executemany(
            "INSERT INTO tunnel.anomaly_part (survey_id, km, pixel, box, mask, filled, drop_sum, drop_max, traits)"
            " VALUES (%s, %s, %s, %s, %b, %s, %s, %s, %s)",
            [_row(survey, km, region) for region in cut],
        )
    parts = _load(conn, survey, range(km - 1, km + 2))
    first, last = km - 1, km + 1
    while True:
        touched = [group for group in _groups(parts) if any(_at(part, km) for part in group)]
        more = [
            *([first - 1] if any(part.km == first and part.reaches(first) for group in touched for part in group) else []),
            *([last + 1] if any(part.km == last and part.reaches(last + 1) for group in touched for part in group) else []),
        ]
        if not more:
            break
        parts += _load(conn, survey, more)
        first, last = min(first, *more), max(last, *more)
    anomalies = {part.anomaly for group in touched for part in group} | {row[0] for row in before}
    pixel = {part.region.pixel for part in parts if part.km == km}
    return Border(
        [Cluster(group, merge_regions([part.region for part in group])) for group in touched],
        {key for key in anomalies if key is not None},
        first,
        last,
        sorted({p.km for p in parts if p.km != km and _at(p, km) and pixel and p.region.pixel not in pixel}),
    )


def link(conn: psycopg.Connection[Any], cluster: Cluster, anomaly: int | None) -> None:
    """Note which anomaly the parts of a cluster were written as."""
    keys = [part.id for part in cluster.parts]
    conn.execute("UPDATE tunnel.anomaly_part SET anomaly_id = %s WHERE id = ANY (%s)", (anomaly, keys))


def _at(part: Part, km: int) -> bool:
    """Tell whether a part lies in a kilometre or reaches one of its ends from without."""
    return part.km == km or (part.km == km - 1 and part.reaches(km)) or (part.km == km + 1 and part.reaches(km + 1))


def _groups(parts: Sequence[Part]) -> list[list[Part]]:
    return [[parts[k] for k in group] for group in touching_groups([part.region for part in parts])]


def _row(survey: Survey, km: int, region: Region) -> tuple[Any, ...]:
    rows, columns = region.mask.shape
    box = [region.column, region.row, columns, rows]
    return (
        survey.id, km, region.pixel, box, np.packbits(region.mask).tobytes(), region.filled, region.drop_sum, region.drop_max,
        list(region.properties),
    )  # fmt: skip


def _load(conn: psycopg.Connection[Any], survey: Survey, kilometres: Iterable[int]) -> list[Part]:
    rows = conn.execute(
        "SELECT id, km, anomaly_id, pixel, box, mask, filled, drop_sum, drop_max, traits FROM tunnel.anomaly_part"
        " WHERE survey_id = %s AND km = ANY (%s) ORDER BY id",
        (survey.id, list(kilometres)),
        binary=True,
    )
    parts = []
    for key, km, anomaly, pixel, (column, row, columns, height), bits, filled, total, most, traits in rows:
        mask = np.unpackbits(np.frombuffer(bits, np.uint8), count=height * columns).astype(np.bool_).reshape(height, columns)
        region = Region(pixel, column, row, mask, filled, total, most, RegionProperties(*traits))
        parts.append(Part(key, km, anomaly, region))
    return parts
