"""A later survey of the example's tunnel, and what changed until then, row by row."""

from __future__ import annotations

import numpy as np
import psycopg
from affine import Affine

from tunneldb.measures.change.rows import save_images
from tunneldb.raster.geotiff import Raster
from tunneldb.store.survey import get_survey

LATER, EARLIER = "demo-2026", "demo-2022"
SECTION, GIRTH = 1.5, 20.0
"""Length of a section, m, and lining of it by metre, m."""

UNSEEN = (12360.0, 12369.0)
"""What the later survey did not see, m."""

LEAKS = {"grown": (1.0, 3.0), "new": (0.0, 0.4), "dry": (0.3, 0.0), "same": (0.8, 0.82)}
"""Area before and after of one leak each, m², every 20 m from 12+310 on."""

REGIONS = ((12320.0, 2.0, 0.004), (12410.0, 5.0, -0.006))
"""Regions of change: chainage, area in m², mean in m."""


IMAGE = np.where(np.arange(50).reshape(5, 10) % 10 < 5, 0.004, -0.002).astype(np.float32)
IMAGE[0, 0] = np.nan
"""Change of cells (rows, columns), m: inwards in the first half of each row, outwards in the other, one unseen."""


OVALER = 1.5
"""Ovality of each ring over that in the survey before."""


def add_change(conn: psycopg.Connection, survey: str) -> None:
    """A survey of 2026 that was compared with that of 2024; each section moved by 10 µm more than the one before."""
    (old, tunnel) = conn.execute("SELECT id, tunnel_id FROM tunnel.survey WHERE name = %s", (survey,)).fetchone()
    (new,) = conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform, reference)"
        " VALUES (%s, %s, '2026-05-04', 'Amplitude', 'amplitude', 'static', 'auto') RETURNING id",
        (tunnel, LATER),
    ).fetchone()
    given = {"new": new, "old": old, "area": SECTION * GIRTH, "low": UNSEEN[0], "high": UNSEEN[1], "length": SECTION}
    conn.execute(
        "INSERT INTO tunnel.change_section (survey_id, old_survey_id, km, chainage_from, chainage_to,"
        " seen_old, seen_new, seen_both,"
        " shift_right, shift_right_se, shift_up, shift_up_se, change_rms, lod, cell, arc_from, change)"
        " SELECT %(new)s, %(old)s, 12, c, c + %(length)s, %(area)s, v.seen, v.seen, 0.00001 * n, 0.0001, 0,"
        " 0.0001, 0.00002 * n,"
        " 0.002, 0.1, -10, '{0.001,NaN}' FROM generate_series(0, 99) AS n, LATERAL (SELECT 12300 + %(length)s * n AS c) q,"
        " LATERAL (SELECT CASE WHEN c >= %(low)s AND c < %(high)s THEN 0 ELSE %(area)s END AS seen) v",
        given,
    )
    box = "ST_MakeEnvelope(%(at)s, 0, %(at)s + 1, %(area)s, 0)"
    conn.execute(
        "INSERT INTO tunnel.ring (survey_id, km, number, chainage_from, chainage_to, origin, joint, seen_share, shape, radius,"
        " radius_se, ovality, ovality_se, design_diameter, diameter_from)"
        " SELECT %s, km, number, chainage_from, chainage_to, origin, joint, seen_share, shape, radius, radius_se, %s * ovality,"
        " ovality_se, design_diameter, diameter_from FROM tunnel.ring WHERE survey_id = %s",
        (new, OVALER, old),
    )
    on_map = "ST_MakeEnvelope(%(at)s, 0, %(at)s + 1, %(area)s, 25830)"
    for at, area, mean in REGIONS:
        conn.execute(
            "INSERT INTO tunnel.change_region (survey_id, old_survey_id, km, chainage_from, chainage_to,"
            " arc_from, arc_to, clock,"
            " area, change_mean, lod, change_extreme, unrolled, map, surface) VALUES (%(new)s, %(old)s, 12,"
            " %(at)s, %(at)s + 1, 0,"
            f" %(area)s, 1, %(area)s, %(mean)s, 0.001, %(mean)s, {box}, {on_map}, ST_Force3D({on_map}))",
            given | {"at": at, "area": area, "mean": mean},
        )
    for n, (state, (before, after)) in enumerate(LEAKS.items()):
        conn.execute(
            "INSERT INTO tunnel.leak_change (survey_id, old_survey_id, km, state, old_ids, new_ids, old_kinds,"
            " new_kinds, area_old,"
            " area_old_se, area_new, area_new_se, seen_old, seen_new, chainage_from, chainage_to, clock,"
            " unrolled, map, surface)"
            " VALUES (%(new)s, %(old)s, 12, %(state)s, %(ids)s, '{}', '{}', '{}', %(before)s, 0.03, %(after)s,"
            " 0.04, 1, 1, %(at)s,"
            f" %(at)s + 1, 1, ST_Multi({box}), ST_Multi({on_map}), ST_Force3D(ST_Multi({on_map})))",
            given | {"at": 12310 + 20 * n, "area": 1, "state": state, "before": before, "after": after, "ids": [n]},
        )


def add_earlier(conn: psycopg.Connection, survey: str) -> None:
    """The same the other way round: the survey of 2024 is the newer, the other of 2022; with an image, 10 cells wide by 5."""
    add_change(conn, survey)
    for table in ("change_section", "change_region", "leak_change"):
        conn.execute(f"UPDATE tunnel.{table} SET survey_id = old_survey_id, old_survey_id = survey_id")  # type: ignore[arg-type]
    conn.execute("UPDATE tunnel.survey SET name = %s, date = '2022-05-04' WHERE name = %s", (EARLIER, LATER))
    change = Raster(IMAGE, Affine(0.1, 0.0, 12320.0, 0.0, -0.1, 1.0))
    save_images(conn, get_survey(conn, EARLIER), get_survey(conn, survey), 12, change, change)


def add_change_run(conn: psycopg.Connection, survey: str) -> None:
    """The run of the ledger that made it."""
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage, parameters, versions, counts, started_at, finished_at, outcome)"
        " SELECT n.id, 12, 'compare', jsonb_build_object('old', o.id), '{}', '{}', now(), now(), 'done'"
        " FROM tunnel.survey n, tunnel.survey o WHERE (n.name, o.name) = (%s, %s)",
        (LATER, survey),
    )
