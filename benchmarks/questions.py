"""The questions of docs/cookbook.md on a synthetic tunnel of 25 km with 100,000 leaks and 60 million points: how fast they are.

    python -m benchmarks.questions                        # makes the database (minutes), asks, drops it
    python -m benchmarks.questions --dsn … --filled       # asks in one that benchmarks.synthetic has filled

Each question is put in a session of its own, first cold (plans and catalogue; the pages are in memory), then warm: the median
of five. Those that take longer than the limit are printed with their plan.
"""

from __future__ import annotations

import argparse
import os
import re
import statistics
import sys
import time
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from benchmarks.common import print_table, progress, save, scratch_database
from benchmarks.synthetic import Size, make
from tunneldb.database import connect, resolve_dsn

PAGE = Path(__file__).parents[1] / "docs" / "cookbook.md"
QUESTION = re.compile(r"^### (.+?)$(?:(?!^#).)*?^```sql\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SURVEY, LIMIT, WARM = "demo-2024", 50.0, 5


def questions(page: Path = PAGE) -> dict[str, str]:
    """Read the questions of a page, and the SQL under each; without those of several statements, which show the past."""
    return {title: query for title, query in QUESTION.findall(page.read_text("utf-8")) if not query.startswith("BEGIN;")}


def ask(dsn: str, query: str) -> dict[str, Any]:
    """Put a question in a session of its own; milliseconds by the clock of who asks, and the rows of the answer."""
    taken = []
    with connect(dsn) as connection:
        connection.execute("SELECT 1")
        for _ in range(1 + WARM):
            start = time.perf_counter()
            rows = connection.execute(query.encode(), prepare=False).fetchall()
            taken.append(1000 * (time.perf_counter() - start))
            connection.rollback()
    return {"first_ms": taken[0], "warm_ms": statistics.median(taken[1:]), "rows": len(rows)}


def explain(dsn: str, query: str) -> str:
    with connect(dsn) as connection:
        rows = connection.execute(b"EXPLAIN (ANALYZE, BUFFERS) " + query.encode()).fetchall()
    return "\n".join(row[0] for row in rows)


def counted(dsn: str) -> dict[str, int]:
    """Return the row counts of the database, by the planner's statistics."""
    with connect(dsn) as connection:
        rows = connection.execute(
            "SELECT CASE WHEN relname ~ '^point_' THEN 'point' ELSE relname END, sum(reltuples)::bigint FROM pg_class"
            " WHERE relnamespace = 'tunnel'::regnamespace AND relkind = 'r' AND reltuples > 0 GROUP BY 1 ORDER BY 1"
        ).fetchall()
    return dict(rows)


def measure(dsn: str, wanted: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Put all questions, or those whose heading holds one of some words."""
    found = {}
    for title, query in questions().items():
        if not wanted or any(word.lower() in title.lower() for word in wanted):
            progress(title)
            found[title] = ask(dsn, query)
    return found


def report(dsn: str, found: dict[str, dict[str, Any]]) -> None:
    """Print times, and the plans of what is slow."""
    rows = [(title, f"{one['first_ms']:.1f}", f"{one['warm_ms']:.1f}", one["rows"]) for title, one in found.items()]
    print_table("Questions", ("question", "first, ms", "warm, ms", "rows"), rows)
    slow = [title for title, one in found.items() if one["warm_ms"] >= LIMIT]
    print(f"\n{len(found) - len(slow)} of {len(found)} in less than {LIMIT:g} ms")
    for title in slow:
        print(f"\n{title}\n{explain(dsn, questions()[title])}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--km", type=int, default=Size.kilometres)
    parser.add_argument("--leaks", type=int, default=Size.leaks)
    parser.add_argument("--points", type=int, default=Size.points)
    parser.add_argument(
        "--filled", action="store_true", help="the database of --dsn is filled already, by benchmarks.synthetic"
    )
    parser.add_argument("--only", action="append", default=[], metavar="WORD", help="questions whose heading holds it")
    arguments = parser.parse_args()
    load = os.getloadavg()[0]
    with nullcontext(resolve_dsn(arguments.dsn)) if arguments.filled else scratch_database(arguments.dsn) as dsn:
        if not arguments.filled:
            with connect(dsn) as connection:
                make(connection, SURVEY, Size(arguments.km, arguments.leaks, arguments.points))
        found = measure(dsn, arguments.only)
        report(dsn, found)
        settings = {"load_average_before": load, "command": sys.argv[1:], "rows": counted(dsn)}
    print(f"\n{save('questions', settings | {'questions': found})}")


if __name__ == "__main__":
    main()
