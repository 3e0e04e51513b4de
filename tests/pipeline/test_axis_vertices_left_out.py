"""An axis vertex that is out of place, or does not come to rest, holds up no kilometre: it is interpolated, and named."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psycopg
import pytest
from support.command import command

from tunneldb.simulate import Parameters, Simulation, write

NAME = "bend"
START, LENGTH = 1200.0, 90.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp(NAME)
    scene = Parameters(
        name=NAME, section="circular", length=LENGTH, start_chainage=START, radius=300.0, straight=0.0, scanner="profiler",
        density=60.0, leaks=0, appendages=False, niches=False,
    )  # fmt: skip
    write(Simulation(scene), folder)
    return folder


@pytest.fixture
def survey(folder: Path, conn: psycopg.Connection) -> Iterator[psycopg.Connection]:
    command("tunnel", "add", NAME, "--srid", 25830, "--axis", folder / f"{NAME}.axis.csv", "--start-chainage", START)
    command(
        "survey", "add", NAME, "--tunnel", NAME, "--date", "2024-05-04", "--trajectory", folder / f"{NAME}.trajectory.csv",
        "--intensity-kind", "none",
    )  # fmt: skip
    command("load", NAME, *sorted(folder.glob("*.laz")))
    return conn


def axis(conn: psycopg.Connection) -> dict[int, tuple[np.ndarray, str, str | None]]:
    rows = conn.execute("SELECT n, ST_X(geom), ST_Y(geom), ST_Z(geom), source, remark FROM tunnel_api.axis_vertex").fetchall()
    conn.rollback()
    return {n: (np.array(xyz), source, remark) for n, *xyz, source, remark in rows}


def said(conn: psycopg.Connection) -> str:
    ((text,),) = conn.execute("SELECT remark FROM tunnel_api.remark WHERE stage = 'axis'").fetchall()
    conn.rollback()
    return str(text)


def test_a_vertex_that_jumps_is_interpolated_and_named(survey: psycopg.Connection) -> None:
    command("run", NAME, "--to", "axis")
    before = axis(survey)
    assert not [remark for _, _, remark in before.values() if remark]
    # At 1+240 and at the last vertex the scanner saw something else, 4.6 m aside.
    jumping = (124, max(before))
    for n in jumping:
        along = before[n][0] - before[n - 1][0]
        right = np.array([along[1], -along[0]]) / np.hypot(along[0], along[1])
        survey.execute(
            "UPDATE tunnel.point SET geom = ST_Translate(geom, %s, %s, 0) WHERE chainage BETWEEN %s AND %s",
            [*(4.6 * right).tolist(), n * 10 - 2.6, n * 10 + 2.6],
        )
    survey.commit()
    refused = command("run", NAME, "--to", "axis", "--set", "axis.max_rejected=0", code=2).stderr
    advice = re.search(r"or interpolate more: tunneldb (run .*)$", refused.strip())
    assert advice, refused
    out = command(*advice[1].split(), "--to", "axis").output
    after = axis(survey)
    assert {n for n, (_, _, remark) in after.items() if remark} == set(jumping)
    for n in jumping:
        xyz, source, remark = after[n]
        assert source == "interpolated"
        assert remark is not None
        assert remark.startswith("lies ")
        # what is interpolated is the shift from the given axis, which is that of the neighbours to some centimetres
        assert np.linalg.norm(xyz - before[n][0]) < 0.05
    others = [np.linalg.norm(after[n][0] - before[n][0]) for n in before if n not in jumping]
    assert max(others) < 0.005
    for text in (said(survey), out, command("check", code=0).output):
        assert "the vertex at 1+240.000 lies" in text
        assert "1+290.000" in text


def test_a_vertex_that_never_rests_is_interpolated_and_named(survey: psycopg.Connection) -> None:
    # its points are found 5 cm to the right and to the left by turns
    survey.execute("CREATE SEQUENCE public.turn")
    (source,) = survey.execute("SELECT pg_get_functiondef('tunnel_internal.axis_shift'::regproc)").fetchone()
    assert "SELECT t.n, coalesce(s.shift, t.u)," in source
    by_turns = "CASE t.n WHEN 126 THEN 0.1 * mod(nextval('public.turn'), 2) - 0.05 ELSE 0 END"
    survey.execute(source.replace("coalesce(s.shift, t.u),", f"coalesce(s.shift, t.u) + {by_turns},"))
    survey.commit()
    command("run", NAME, "--to", "axis")
    found = axis(survey)
    assert {n: source for n, (_, source, _) in found.items() if source != "measured"} == {126: "interpolated"}
    assert "the vertex at 1+260.000 still moves by 0.01" in said(survey)


def test_a_kilometre_whose_vertices_do_not_rest_is_refused_by_their_names(survey: psycopg.Connection) -> None:
    refused = command("run", NAME, "--to", "axis", "--set", "axis.tolerance=1e-5", "--set", "axis.max_iterations=1", code=2)
    line = refused.stderr.strip().splitlines()[-1]
    assert line.startswith("tunneldb: the axis of kilometre 1 was not found")
    assert "the vertex at 1+2" in line
    advice = re.search(r"or allow more passes: tunneldb (run .*)$", line)
    assert advice, line
    command(*advice[1].split(), "--to", "axis")
