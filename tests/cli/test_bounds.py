"""Numbers and stretches beyond what there is: refused in one line, before anything is made or measured."""

from __future__ import annotations

from pathlib import Path

import psycopg
import pytest
from click.testing import CliRunner

from tunneldb.cli.main import main


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.mark.parametrize("verb", ["simulate", "simulate-canal", "simulate-structure"])
@pytest.mark.parametrize("seed", ["-1", str(10**30)])
def test_a_seed_that_no_file_holds(tmp_path: Path, verb: str, seed: str) -> None:
    result = CliRunner().invoke(main, [verb, str(tmp_path / "made"), "--seed", seed])
    assert result.exit_code == 2
    assert f"{seed} is not in the range" in result.stderr
    assert not (tmp_path / "made").exists()


def test_a_stretch_that_begins_where_the_survey_ends(example: str, conn: psycopg.Connection) -> None:
    row = conn.execute(
        "SELECT chainage_from, chainage_to FROM tunnel_api.survey_ends((SELECT id FROM tunnel.survey))"
    ).fetchone()
    conn.rollback()
    assert row is not None
    runs = "SELECT count(*) FROM tunnel.run"
    before = conn.execute(runs).fetchone()
    for verb in ("deviation", "evenness"):
        for stretch in (["--to", str(row[0])], ["--from", str(row[1])]):
            result = CliRunner().invoke(main, [verb, example, *stretch])
            assert result.exit_code == 2
            assert f"has nothing there: it reaches from chainage {row[0]:.3f} to {row[1]:.3f} m" in result.stderr
    conn.rollback()
    assert conn.execute(runs).fetchone() == before
    assert CliRunner().invoke(main, ["deviation", example, "--to", str(row[0] + 20.0)]).exit_code == 0
