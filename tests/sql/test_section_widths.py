"""Sections whose slab is begun at once where it may be wide enough are those of trying each width, one after the other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import psycopg
import pytest
from support.real_scans import real_scan

from tests.pipeline.test_stages import NAME, START, command, prepare
from tunneldb.simulate import Parameters, Simulation, write

STEP = 5.0
CLASSES = 72
SETTINGS = [(0.15, 2.5, 5), (0.04, 0.5, 5), (0.15, 2.5, 40), (0.15, 0.25, 40), (0.5, 2.5, 5), (0.5, 2.5, 2), (0.3, 0.2, 5)]
"""half_width and max_half_width, m, and min_points: slabs that suffice at once, after some doubling, and never."""

Gathered = dict[tuple[int, int], tuple[Any, ...]]


def one_after_the_other(
    conn: psycopg.Connection, survey: int, km: int, narrowest: float, widest: float, least: int
) -> Gathered:
    """Width, points and radii of the sections, by the rule of section_gather without a short cut."""
    planes = conn.execute("SELECT segment, half FROM tunnel_internal.section_plane(%s, %s)", [survey, km]).fetchall()
    pending, found, slab = set(planes), Gathered(), min(narrowest, widest)
    while pending:
        classes: dict[tuple[int, int], dict[int, tuple[int, float]]] = {section: {} for section in pending}
        for segment, half, number, radius, points in conn.execute(
            "SELECT segment, half, class, radius, points FROM tunnel_internal.section_classes(%s, %s, %s, %s, %s)",
            [survey, km, slab, STEP, [segment * 100 + half for segment, half in pending]],
        ):
            if points >= least:
                classes[segment, half][number] = (points, radius)
        enough = least * (4 if slab < 4 * narrowest else 1)
        for section, held in classes.items():
            if sum(points >= enough for points, _ in held.values()) >= 0.9 * CLASSES or (slab >= widest and held):
                found[section] = slab, *zip(*(held.get(number, (0, None)) for number in range(CLASSES)), strict=True)
        if slab >= widest:
            break
        pending, slab = pending - found.keys(), min(2 * slab, widest)
    return found


def check(conn: psycopg.Connection, name: str) -> set[float]:
    """Compare both ways; returns the widths that were needed."""
    (survey, km), *_ = conn.execute(
        "SELECT g.survey_id, g.km FROM tunnel.segment g JOIN tunnel.survey s ON s.id = g.survey_id WHERE s.name = %s"
        " ORDER BY g.points DESC LIMIT 1",
        [name],
    ).fetchall()
    needed = set()
    for narrowest, widest, least in SETTINGS:
        rows = conn.execute(
            "SELECT segment, half, width, points, radius FROM tunnel_internal.section_gather(%s, %s, %s, %s, %s, %s)",
            [survey, km, STEP, narrowest, widest, least],
        ).fetchall()
        expected = one_after_the_other(conn, survey, km, narrowest, widest, least)
        assert {row[:2] for row in rows} == expected.keys()
        for segment, half, width, points, radius in rows:
            assert (width, tuple(points)) == expected[segment, half][:2]
            assert tuple(radius) == pytest.approx(expected[segment, half][2], abs=1e-12)
            needed.add(width / narrowest)
    return needed


def test_of_a_simulated_tunnel(conn: psycopg.Connection, tmp_path: Path) -> None:
    tunnel = Parameters(
        name=NAME, section="horseshoe", scanner="profiler", density=100.0, leaks=0, length=30.0, start_chainage=START,
        radius=300.0, straight=0.0,
    )  # fmt: skip
    write(Simulation(tunnel), tmp_path)
    prepare(tmp_path)
    command("run", NAME, "--to", "segments")
    assert check(conn, NAME) >= {1.0, 2.0, 4.0}


def test_of_a_real_tunnel(conn: psycopg.Connection) -> None:
    """Profiles half a metre apart."""
    command("tunnel", "add", "ringo", "--srid", 3794, "--axis", real_scan("ringo.axis.csv"), "--start-chainage", 511746.75)
    command("survey", "add", "r", "--tunnel", "ringo", "--date", "2024-05-04", "--no-poses", "--intensity-kind", "none")
    command("load", "r", real_scan("ringo.laz"))
    command("run", "r", "--to", "segments")
    assert max(check(conn, "r")) >= 4.0
