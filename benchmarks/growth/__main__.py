"""A survey by itself, and the same among a thousand: CPU time of each view, and of commands, and how many times more it is.

    python -m benchmarks.growth                                # makes a database of 1000 surveys and 25 000 km: 5 GB
    python -m benchmarks.growth --surveys 100 --only status    # less of it, and only what has that in its name
    python -m benchmarks.growth --alone DSN --among DSN        # two databases that are there, made by this program

CPU time is that of the backend, so that what else the machine does counts little; the server must run on this machine.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path

import psycopg

from benchmarks.common import print_table, progress, save, scratch_database
from benchmarks.growth.commands import Run, ask_commands
from benchmarks.growth.database import note_shape, surround
from benchmarks.growth.views import LEAST_MS, Asked, ask_all
from benchmarks.synthetic import Size, make

SURVEY = "demo-2024"
SIZE = Size(leaks=2000, points=25_000, dry=1000, drawn=2000)
"""What the sample holds: little, so that what others cost shows."""

Side = tuple[list[Asked], list[Run]]
"""CPU time in one of the two databases: of the views and of the commands."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server on which a database is made and dropped; default: the embedded one")
    parser.add_argument("--surveys", type=int, default=1000)
    parser.add_argument(
        "--only", default="", help="views and commands with one of these words in their names, parted by commas"
    )
    parser.add_argument("--alone", help="database that holds the sample alone")
    parser.add_argument("--among", help="the same with the other surveys")
    asked = parser.parse_args()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        if asked.alone and asked.among:
            sides = [_measure(dsn, asked.only, folder) for dsn in (asked.alone, asked.among)]
        else:
            dsn = stack.enter_context(scratch_database(asked.dsn))
            with psycopg.connect(dsn) as connection:
                sample = make(connection, SURVEY, SIZE)
                note_shape(connection, sample, SIZE.kilometres)
            alone = _measure(dsn, asked.only, folder)
            with psycopg.connect(dsn) as connection:
                surround(connection, sample, asked.surveys, SIZE.kilometres)
            sides = [alone, _measure(dsn, asked.only, folder)]
        _tell(*sides)  # before the database is dropped, which takes minutes


def _tell(alone: Side, among: Side) -> None:
    """Print the tables and save them."""
    (views, verbs), (views_among, verbs_among) = alone, among
    _print_views(views, views_among)
    _print_commands(verbs, verbs_among)
    figures = {
        "views": [[asdict(one), asdict(other)] for one, other in zip(views, views_among, strict=True)],
        "verbs": [[asdict(one), asdict(other)] for one, other in zip(verbs, verbs_among, strict=True)],
    }
    save("growth", figures)


def _measure(dsn: str, only: str, folder: Path) -> Side:
    progress(f"views of {SURVEY}")
    views = ask_all(dsn, SURVEY, only)
    progress(f"verbs on {SURVEY}")
    return views, ask_commands(dsn, SURVEY, folder, only)


def _print_views(alone: Sequence[Asked], among: Sequence[Asked]) -> None:
    rows = []
    for one, other in zip(alone, among, strict=True):
        small = max(one.again, other.again) < LEAST_MS
        ratio = "" if small else f"{other.again / one.again:.2f}"
        rows.append([one.name, one.rows, one.first, other.first, one.again, other.again, ratio])
    rows.sort(key=lambda row: -float(str(row[-1]) or 0))
    header = ["view", "rows", "first alone, ms", "first among", "alone, ms", "among, ms", "ratio"]
    print_table("CPU time of the backend, for one survey", header, rows)


def _print_commands(alone: Sequence[Run], among: Sequence[Run]) -> None:
    rows = [
        [one.name, one.program, other.program, one.backends, other.backends, other.total / one.total]
        for one, other in zip(alone, among, strict=True)
    ]
    header = ["command", "program alone, s", "among", "server alone, s", "among", "ratio of both"]
    print_table("CPU time of commands", header, rows)


if __name__ == "__main__":
    main()
