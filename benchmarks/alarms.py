"""Alarms of 25 km with 100,000 findings in each of two surveys, 12,500 rings and 16,667 sections of a comparison.

    python -m benchmarks.alarms [--dsn DSN]

Seconds are those of the SQL function `alarms`, the best of five: with one limit each, and with all four.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import psycopg

from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from tunneldb.database import connect

sys.path.append(str(Path(__file__).parent.parent / "tests"))
from support.long_survey import FINDINGS, KILOMETRES, NAME, make_long_survey

EARLIER = "long-2022"
RING, SECTION, CELL = 2.0, 1.5, 0.1
"""Lengths of a ring and of a section of the comparison, and side of its cells, m."""

LIMITS = {
    "ovality of rings of 2 m": ("ovality", "0.012", "0.0124"),
    "convergence of sections of 1.5 m": ("convergence", "0.01", "0.02"),
    "wet area of stretches of 10 m": ("wet_area", "3.5", "4", "--step", "10"),
    "growth of stretches of 10 m": ("growth", "1", "2", "--step", "10"),
}
REPEATS = 5

_EARLIER = """
INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform)
SELECT tunnel_id, %(earlier)s, '2022-05-04', intensity_dimension, intensity_kind, platform
FROM tunnel.survey WHERE name = %(name)s
"""

_COPY = """
INSERT INTO tunnel.{0} (survey_id, {1})
SELECT o.id, {2} FROM tunnel.{0} c JOIN tunnel.survey s ON s.id = c.survey_id, tunnel.survey o
 WHERE s.name = %(name)s AND o.name = %(earlier)s
"""

_SECTIONS = """
INSERT INTO tunnel.section (survey_id, km, segment, half, chainage, half_width, angle_step, radius, arc, geom, points,
    interpolated)
SELECT o.id, floor(n / 200), n / 2, 25 + 50 * (n %% 2), 5 * n + 2.5, 0.5, 5, c.radius, c.arc, c.geom, c.points, c.interpolated
FROM tunnel.survey o, generate_series(0, 200 * %(km)s - 1) AS n,
    LATERAL (SELECT * FROM tunnel.section ORDER BY id LIMIT 1) c
WHERE o.name = %(earlier)s
"""

_RINGS = """
INSERT INTO tunnel.ring (survey_id, km, number, chainage_from, chainage_to, origin, joint, seen_share, shape, radius, radius_se,
    ovality, ovality_se, design_diameter, diameter_from)
SELECT s.id, floor((n - 1) * %(ring)s / 1000), n, (n - 1) * %(ring)s, n * %(ring)s, 'length', 'given', 1, 'ellipse', 4, 0.0001,
    n / 1e6, 0.0001, 8, 'option'
FROM tunnel.survey s, generate_series(1, round(1000 * %(km)s / %(ring)s)::int) AS n
"""

_CHANGE = """
INSERT INTO tunnel.change_section (survey_id, old_survey_id, km, chainage_from, chainage_to, seen_old, seen_new, seen_both,
    change_rms, lod, cell, arc_from, change)
SELECT s.id, o.id, floor(n * %(section)s / 1000), n * %(section)s, (n + 1) * %(section)s, 30, 30, 30, 0.001, 0.002,
    %(cell)s, -12.6, a.change
FROM tunnel.survey s, tunnel.survey o, generate_series(0, floor(1000 * %(km)s / %(section)s)::int - 1) AS n,
    LATERAL (SELECT array_agg(0.000001 * (n %% 4000) ORDER BY i)::real[] AS change FROM generate_series(1, 252) AS i) a
WHERE s.name = %(name)s AND o.name = %(earlier)s
"""


def make_surveys(conn: psycopg.Connection) -> None:
    """Add an earlier survey with the same findings, rings of both, and their comparison."""
    values = {"name": NAME, "earlier": EARLIER, "km": KILOMETRES, "ring": RING, "section": SECTION, "cell": CELL}
    conn.execute(_EARLIER, values)
    for table in ("segment", "coverage", "finding"):
        columns = [
            name
            for (name,) in conn.execute(
                "SELECT attname FROM pg_attribute WHERE attrelid = format('tunnel.%%I', %s::text)::regclass AND attnum > 0"
                " AND NOT attisdropped AND attidentity = '' AND attgenerated = '' AND attname <> 'survey_id'",
                [table],
            )
        ]
        copied = ", ".join(f"c.{name}" for name in columns)
        conn.execute(_COPY.format(table, ", ".join(columns), copied), values)
    conn.execute(_SECTIONS, values)
    conn.execute(_RINGS, values)
    conn.execute(_CHANGE, values)
    conn.commit()
    conn.execute("ANALYZE")
    conn.commit()


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.alarms", description=__doc__.splitlines()[0])
    parser.add_argument("--dsn", help="server; default: the embedded one")
    arguments = parser.parse_args()
    rows = []
    with scratch_database(arguments.dsn) as dsn:
        with connect(dsn) as conn:
            progress(f"{KILOMETRES} km, two surveys with {FINDINGS:,} findings each")
            make_long_survey(conn)
            make_surveys(conn)
        for title, limit in LIMITS.items():
            progress(title)
            _add(dsn, *limit)
            rows.append((title, *_timed(dsn)))
            tunneldb("alarms", "remove", "long", limit[0], dsn=dsn)
        for limit in LIMITS.values():
            _add(dsn, *limit)
        rows.append(("all four limits", *_timed(dsn)))
    save("alarms", {title: {"rows": count, "seconds": seconds} for title, count, seconds in rows})
    print_table("alarms", ("limit", "rows", "s"), [(title, f"{count:,}", f"{s:.2f}") for title, count, s in rows])


def _add(dsn: str, quantity: str, warning: str, alarm: str, *words: str) -> None:
    given = ("--quantity", quantity, "--warning", warning, "--alarm", alarm, *words)
    tunneldb("alarms", "add", "long", quantity, *given, dsn=dsn)


def _timed(dsn: str) -> tuple[int, float]:
    seconds = []
    with connect(dsn) as conn:
        for _ in range(REPEATS):
            start = time.perf_counter()
            judged = conn.execute("SELECT level FROM tunnel_api.alarms('long')").fetchall()
            seconds.append(time.perf_counter() - start)
    return len(judged), min(seconds)


if __name__ == "__main__":
    main()
