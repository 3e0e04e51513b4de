"""What the benchmarks share: a scratch database, the command line, a table on stdout and JSON aside."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psycopg
from psycopg import sql
from psycopg.conninfo import make_conninfo

from tunneldb.database import resolve_dsn

COMMAND = [sys.executable, "-c", "from tunneldb.cli.main import main; main()"]
RESULTS = Path(__file__).parent / "results"


@contextmanager
def scratch_database(dsn: str | None) -> Iterator[str]:
    """Create a database of our own on the server, with the schema, yield its DSN, and drop it."""
    server = resolve_dsn(dsn)
    name = f"tunneldb_benchmark_{os.getpid()}"
    with psycopg.connect(server, autocommit=True) as admin:
        admin.execute(sql.SQL("CREATE DATABASE {}").format(sql.Identifier(name)))
        try:
            scratch = make_conninfo(server, dbname=name)
            tunneldb("init", dsn=scratch)
            yield scratch
        finally:
            admin.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(sql.Identifier(name)))


def tunneldb(*arguments: object, dsn: str | None = None) -> float:
    """Run a command as its user would, in a process of its own; return its seconds."""
    command = [*COMMAND, *map(str, arguments)]
    environment = dict(os.environ) | ({"TUNNELDB_DSN": dsn} if dsn else {})
    start = time.perf_counter()
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"tunneldb {' '.join(map(str, arguments))}\n{done.stdout}{done.stderr}")
    return time.perf_counter() - start


def progress(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def print_table(title: str, header: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print rows in aligned columns, numbers to the right."""
    cells = [[_cell(value) for value in row] for row in rows]
    widths = [max(len(row[i]) for row in [list(header), *cells]) for i in range(len(header))]
    print(f"\n{title}")
    for row in [list(header), ["-" * width for width in widths], *cells]:
        padded = [text.rjust(width) for text, width in zip(row, widths, strict=True)]
        print("  ".join([row[0].ljust(widths[0]), *padded[1:]]))


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 100 else f"{value:,.0f}"
    return f"{value:,}" if isinstance(value, int) else str(value)


def save(name: str, figures: dict[str, Any]) -> Path:
    """Write figures as JSON into ``benchmarks/results``."""
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.json"
    machine = {"cpus": os.cpu_count(), "machine": platform.machine(), "python": platform.python_version()}
    stamp = time.strftime("%Y-%m-%dT%H:%M:%S")
    path.write_text(json.dumps({"finished": stamp, "machine": machine, **figures}, indent=2) + "\n")
    return path
