"""Numbers and stretches beyond what there is: refused in one line, before anything is made or measured."""

from __future__ import annotations

import os
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
            assert f"has no data there: it extends from chainage {row[0]:.3f} to {row[1]:.3f} m" in result.stderr
    conn.rollback()
    assert conn.execute(runs).fetchone() == before
    assert CliRunner().invoke(main, ["deviation", example, "--to", str(row[0] + 20.0)]).exit_code == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("tunnel", "add", "new", "--srid", "25830", "--axis", "PIPE"), "is a pipe, not a file"),
        (("tunnel", "add", "new", "--srid", "25830", "--axis", "/dev/zero"), "/dev/zero is a device, not a file"),
        (
            ("tunnel", "add", "new", "--srid", "25830", "--axis", "AXIS", "--spacing", "1e-8"),
            "must divide 1000 m and be 0.1 m or more",
        ),
        (("inspect", "/proc/kmsg"), "/proc/kmsg is in a folder of the kernel, not a file on disk"),
        (("profile", "add", "demo", "lining", "PIPE"), "is a pipe, not a file"),
        (("survey", "set", "demo-2024", "--reference", "PIPE"), "is a pipe, not a file"),
        (("deviation", "demo-2024", "--axis-sigma", "1e-300"), "--axis-sigma 1e-300: that is no number which can be meant"),
    ],
)
def test_what_is_no_file_or_no_number_is_refused_before_it_is_read(
    example: str, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    axis = tmp_path / "axis.csv"
    axis.write_text("x,y,z\n272000,4765000,500\n272100,4765000,500\n")
    given = {"PIPE": str(pipe), "AXIS": str(axis)}
    result = CliRunner().invoke(main, [given.get(word, word) for word in words])
    assert result.exit_code == 2
    assert said in result.stderr
