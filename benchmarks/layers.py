"""Typed layers on a synthetic tunnel of 25 km with 100,000 leaks: what a rectangle of the map costs, and what making them does.

    python -m benchmarks.layers                        # makes the database (minutes), measures, drops it
    python -m benchmarks.layers --dsn … --filled       # measures in one that benchmarks.synthetic has filled

A rectangle of 100 m by 100 m about a leak in the middle is asked for, as a map asks for it, of the layer in tunnel_api, of
the typed one, and of the typed one with its survey's number and kilometre: the median of nine, taken in turn.
"""

from __future__ import annotations

import argparse
import statistics
import time
from contextlib import nullcontext
from typing import Any

import psycopg

from benchmarks.common import print_table, progress, save, scratch_database
from benchmarks.synthetic import Size, make
from tunneldb.database import connect, resolve_dsn

SURVEY, REPEATS, SCHEMA = "demo-2024", 9, "tunnel_25830"
BOX = (
    "(SELECT ST_Expand(map, 50) FROM tunnel.finding WHERE survey_id = 1 AND chainage_from > 12500"
    " ORDER BY chainage_from LIMIT 1)"
)
QUERIES = {
    "leak_map of tunnel_api": "SELECT id, geom FROM tunnel_api.leak_map WHERE geom && " + BOX,
    "leak_map, typed": f"SELECT id, geom FROM {SCHEMA}.leak_map WHERE geom && {BOX}",
    "leak_map, typed, with survey_id and chainage": (
        f"SELECT id, geom FROM {SCHEMA}.leak_map WHERE survey_id = 1 AND chainage_from BETWEEN 12300 AND 12700"
        f" AND geom && {BOX}"
    ),
    "cluster of tunnel_api": "SELECT id, geom FROM tunnel_api.cluster WHERE geom && " + BOX,
    "cluster, typed": f"SELECT id, geom FROM {SCHEMA}.cluster WHERE geom && {BOX}",
}


def milliseconds(conn: psycopg.Connection[Any], query: str) -> tuple[float, int]:
    """Time of a query by the clock of who asks, and the rows of its answer."""
    start = time.perf_counter()
    rows = conn.execute(query.encode(), prepare=False).fetchall()
    return 1000 * (time.perf_counter() - start), len(rows)


def measure(dsn: str, *, filled: bool) -> tuple[dict[str, list[float]], dict[str, int], dict[str, float]]:
    """Milliseconds of each query, its rows, and seconds that dropping and making the schema takes."""
    with connect(dsn) as conn:
        if not filled:
            make(conn, SURVEY, Size(points=1_000_000))
        progress("the layers are made")
        start = time.perf_counter()
        conn.execute(f"DROP SCHEMA IF EXISTS {SCHEMA} CASCADE")
        dropped = time.perf_counter()
        conn.execute("CALL tunnel_api.make_layers()")
        made = {"dropped": dropped - start, "made": time.perf_counter() - dropped}
        conn.commit()
        taken: dict[str, list[float]] = {title: [] for title in QUERIES}
        found: dict[str, int] = {}
        for _ in range(1 + REPEATS):
            for title, query in QUERIES.items():
                spent, found[title] = milliseconds(conn, query)
                taken[title].append(spent)
    return taken, found, made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--filled", action="store_true", help="the database of --dsn is filled already")
    arguments = parser.parse_args()
    with nullcontext(resolve_dsn(arguments.dsn)) if arguments.filled else scratch_database(arguments.dsn) as dsn:
        taken, found, made = measure(dsn, filled=arguments.filled)
    medians = {title: statistics.median(times[1:]) for title, times in taken.items()}
    print_table("A rectangle of 100 m", ("layer", "ms", "rows"), [(t, f"{ms:.1f}", found[t]) for t, ms in medians.items()])
    print_table("A schema of layers", ("", "s"), [(name, f"{value:.2f}") for name, value in made.items()])
    print(f"\n{save('layers', {'rectangle_ms': medians, 'rows': found, 'schema': made})}")


if __name__ == "__main__":
    main()
