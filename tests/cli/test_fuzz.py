"""Malformed files and hostile words: a right result, or exit code 2, one line, and nothing changed.

`make fuzz` for more than a glance, with a table.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from support.fuzz.run import Outcome, table
from support.fuzz.seeds import write_seeds

from tunneldb.cli.main import main
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import get_survey


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def test_what_is_wrong_is_said_in_one_line(conn: psycopg.Connection, dsn: str, tmp_path: Path) -> None:
    axis = np.array(
        conn.execute("SELECT ST_X(geom), ST_Y(geom), ST_Z(geom) FROM tunnel_api.axis_vertex ORDER BY n").fetchall(), dtype=float
    )
    write_seeds(tmp_path, axis, load_surface(conn, get_survey(conn, "demo-2024"), 12_000, 13_000))
    conn.rollback()
    stations = ["--date", "2024-05-04", "--stations", str(tmp_path / "stations.csv")]
    intensity = ["--intensity", "intensity", "--intensity-kind", "linear"]
    assert CliRunner().invoke(main, ["survey", "add", "scan-2024", "--tunnel", "demo", *stations, *intensity]).exit_code == 0
    cases, seconds, seed = (os.environ.get(name, given) for name, given in (("CASES", "150"), ("SECONDS", "25"), ("SEED", "1")))
    command = ["--cases", cases, "--seconds", seconds, "--seed", seed, "--seeds", str(tmp_path), "--json"]
    done = subprocess.run(
        [sys.executable, "-m", "support.fuzz.run", *command],
        env=os.environ | {"TUNNELDB_DSN": dsn, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[1]), *sys.path])},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    outcomes = [Outcome(**one) for one in json.loads(done.stdout)]
    wrong = [f"{one.command}: {one.said}{one.fault}" for one in outcomes if one.kind == "right" and one.code != 0]
    assert not wrong, "\n".join(wrong)
    print(table(outcomes))
    assert len(outcomes) >= 30
    assert {one.code for one in outcomes} >= {0, 2}
    faults = [f"{one.number}: {one.command} ({one.wrong}): {one.fault}" for one in outcomes if one.fault]
    assert not faults, "\n".join(faults)
