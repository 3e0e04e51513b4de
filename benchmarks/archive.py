"""A survey into an archive and back: time, memory, and bytes beside those of the database and of the scan files.

    python -m benchmarks.archive ringo-2024 demo-2024    # surveys of the database; they are only read
    python -m benchmarks.archive --kilometres 1          # and rows of so many kilometres, 2.4 million points each, made in SQL

Each is exported, imported into a scratch database on the same server and, under another name, once more, where its rows get new
numbers; of rows made here, which are in that database, only the latter. Seconds by the clock and of the CPU, and the peak of
memory, are those of the command's own process, as the kernel counts them; the server's are not in them. Bytes of the database
are those of the view survey_size, after ANALYZE.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from pathlib import Path
from typing import Any

import psycopg

from benchmarks.common import print_table, progress, save, scratch_database
from benchmarks.files import watched
from benchmarks.synthetic import Size, make
from tunneldb.database import connect, resolve_dsn

POINTS, LEAKS = 2_400_000, 4_000
"""Of a kilometre of rows."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("surveys", nargs="*", help="surveys of the database to be archived")
    parser.add_argument("--dsn", help="database with the surveys, on whose server the scratch database is made")
    parser.add_argument("--kilometres", type=int, default=0, help="of a survey made in SQL, without scans and images; 0: none")
    arguments = parser.parse_args()
    source = resolve_dsn(arguments.dsn)
    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as temporary, scratch_database(source) as scratch:
        folder = Path(temporary)
        for survey in arguments.surveys:
            progress(survey)
            figures[survey] = measure(source, scratch, survey, folder)
        if kilometres := arguments.kilometres:
            size = Size(kilometres, LEAKS * kilometres, POINTS * kilometres, 300 * kilometres, 800 * kilometres)
            with connect(scratch) as connection:
                make(connection, "long-2024", size)
            rows = measure(scratch, scratch, "long-2024", folder)
            figures[f"{kilometres} km"] = rows | {"scan_bytes": None}  # its files are names
    report(figures)
    print(f"\n{save('archive', figures)}")


def measure(source: str, scratch: str, survey: str, folder: Path) -> dict[str, Any]:
    """Export a survey of one database and import it into another, by its own name if it is not there, and by another."""
    file = folder / f"{survey}.tdb"
    figures: dict[str, Any] = {"export": watched(("survey", "export", survey, "-o", file), source)}
    if source != scratch:
        figures["import"] = watched(("survey", "import", file), scratch)
    figures["import, new numbers"] = watched(("survey", "import", file, "--name", f"{survey}-copy"), scratch)
    with psycopg.connect(source, autocommit=True) as connection:
        connection.execute("ANALYZE")
        row = connection.execute(
            """
            SELECT s.points, (SELECT sum(z.bytes)::bigint FROM tunnel_api.survey_size z WHERE z.survey_id = s.id),
                   (SELECT sum(f.bytes)::bigint FROM tunnel_api.file f WHERE f.survey_id = s.id)
              FROM tunnel_api.survey s WHERE s.name = %s
            """,
            [survey],
        ).fetchone()
    assert row is not None
    sizes = dict(zip(("points", "database_bytes", "scan_bytes"), row, strict=True))
    return figures | sizes | {"archive_bytes": file.stat().st_size}


def report(figures: dict[str, Any]) -> None:
    """Print what took how long, and the sizes."""
    steps = [
        (survey, step, value["seconds"], value["cpu"], value["peak"] / 1e6)
        for survey, found in figures.items()
        for step, value in found.items()
        if isinstance(value, dict)
    ]
    print_table("Archives", ["survey", "command", "seconds", "CPU", "peak, MB"], steps)
    sizes = [
        (
            survey, found["points"], (found["scan_bytes"] or math.nan) / 1e6, found["database_bytes"] / 1e6,
            found["archive_bytes"] / 1e6, found["archive_bytes"] / found["database_bytes"],
            found["archive_bytes"] / (found["scan_bytes"] or math.nan),
        )
        for survey, found in figures.items()
    ]  # fmt: skip
    header = ["survey", "points", "scans, MB", "database, MB", "archive, MB", "of database", "of scans"]
    print_table("Sizes", header, sizes)


if __name__ == "__main__":
    main()
