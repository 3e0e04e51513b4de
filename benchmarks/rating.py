"""Ratings of 25 km with 100,000 findings by the example scheme of the documentation.

    python -m benchmarks.rating [--dsn DSN]

The tunnel is divided into rings of 2 m, stretches of 10 m, and these by zones. Seconds are those of the SQL function `rating`,
the best of five.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from tunneldb.database import connect

sys.path.append(str(Path(__file__).parent.parent / "tests"))
from support.long_survey import NAME, make_long_survey

SCHEME = Path(__file__).parent.parent / "docs" / "examples" / "rating-example.toml"
DIVISIONS = {
    "rings of 2 m": ("rings", "--length", "2"),
    "stretches of 10 m": ("stretches", "--length", "10"),
    "stretches of 10 m by zones": ("zones", "--length", "10", "--zones"),
}
REPEATS = 5


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rating", description=__doc__.splitlines()[0])
    parser.add_argument("--dsn", help="server; default: the embedded one")
    arguments = parser.parse_args()
    rows = []
    with scratch_database(arguments.dsn) as dsn:
        with connect(dsn) as conn:
            progress("25 km, 100,000 findings")
            make_long_survey(conn)
        tunneldb("rating", "add", SCHEME, dsn=dsn)
        with tempfile.TemporaryDirectory() as folder:
            one = Path(folder) / "one.csv"
            one.write_text("name,chainage_from,chainage_to\none,20000,20010\n")
            tunneldb("elements", "add", "long", "one", "--file", one, dsn=dsn)
        for title, (name, *words) in {**DIVISIONS, "one element of 10 m": ("one",)}.items():
            progress(title)
            if words:
                tunneldb("elements", "add", "long", name, *words, dsn=dsn)
            with connect(dsn) as conn:
                seconds = []
                for _ in range(REPEATS):
                    start = time.perf_counter()
                    rated = conn.execute("SELECT result FROM tunnel_api.rating(%s, %s, 'example')", [NAME, name]).fetchall()
                    seconds.append(time.perf_counter() - start)
            rows.append((title, len(rated), min(seconds)))
    save("rating", {title: {"elements": count, "seconds": seconds} for title, count, seconds in rows})
    print_table("rating", ("elements", "number", "s"), [(title, f"{count:,}", f"{s:.2f}") for title, count, s in rows])


if __name__ == "__main__":
    main()
