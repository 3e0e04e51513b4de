"""Portals and open cuts: no sections there, and it is said where."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg
from click.testing import CliRunner
from support.loaded_survey import LENGTH, ORIGIN, START, SURVEY, add_survey, load, write
from support.real_scans import real_scan

from tunneldb.cli.main import main
from tunneldb.pointcloud.selection import FilterSettings

PORTAL = 40.0  # m from the beginning; behind it walls 5 m high stand apart by the tunnel's width
HALF, WALL = 3.0, 5.0


def scene() -> np.ndarray:
    """A box 6 m wide and 4 m high up to the portal; an open cut from there on."""
    rng = np.random.default_rng(0)
    parts = []
    for low, high, top, roof in ((0.0, PORTAL, 2.0, True), (PORTAL, LENGTH, WALL - 2.0, False)):
        count = int(150 * (high - low))
        across = rng.uniform(-HALF, HALF, 6 * count)
        walls = [(np.full(6 * count, side), rng.uniform(-2.0, top, 6 * count)) for side in (-HALF, HALF)]
        levels = [(across, np.full(6 * count, level)) for level in ((-2.0, 2.0) if roof else (-2.0,))]
        parts += [[rng.uniform(low, high, 6 * count), *places] for places in walls + levels]
    xyz = np.concatenate([np.column_stack(part) for part in parts])
    return np.round(ORIGIN + xyz + rng.normal(0, 0.003, xyz.shape), 3)


def test_an_open_cut_has_no_sections_and_is_told(conn: psycopg.Connection, tmp_path: Path) -> None:
    add_survey(conn)
    load(conn, [write(tmp_path / "a.laz", scene())], FilterSettings(density=60.0))
    out = CliRunner().invoke(main, ["run", SURVEY, "--to", "sections"], catch_exceptions=False)
    assert out.exit_code == 0, out.output
    sections = np.array([row[0] for row in conn.execute("SELECT chainage FROM tunnel.section ORDER BY 1").fetchall()])
    assert sections.min() < START + 5.0
    assert START + PORTAL - 5.0 < sections.max() < START + PORTAL + 2.6  # slabs reach 2.5 m
    radii = [row[0] for row in conn.execute("SELECT radius FROM tunnel.section").fetchall()]
    assert np.max(radii) < np.hypot(HALF, 2.0) + 0.1
    ((note,),) = conn.execute("SELECT remark FROM tunnel_api.remark WHERE stage = 'sections'").fetchall()
    ((length,),) = conn.execute(
        "SELECT (counts ->> 'open')::float8 FROM tunnel.run WHERE stage = 'sections' AND counts ? 'open'"
    ).fetchall()
    assert note.startswith("no roof between 1+01")
    assert " and 1+030.000: " in note
    assert "no roof between" in out.output
    assert abs(length - (LENGTH - PORTAL)) < 5.0


def test_a_real_portal_has_no_section_beyond_the_scan(conn: psycopg.Connection, tmp_path: Path) -> None:
    """The last plane of a segment may lie beyond the last point: what its slab would show is the portal's face."""
    scan = str(real_scan("ringo.laz"))
    axis = ["--axis", "auto", "--axis-out", str(tmp_path / "axis.csv"), scan]
    for words in (
        ["tunnel", "add", "ringo", "--srid", "3794", *axis],
        ["survey", "add", "r", "--tunnel", "ringo", "--date", "2024-05-04", "--no-poses", "--intensity-kind", "none"],
        ["load", "r", scan],
        ["run", "r", "--to", "sections"],
    ):
        assert CliRunner().invoke(main, words, catch_exceptions=False).exit_code == 0
    widest = np.array([max(radius) for (radius,) in conn.execute("SELECT radius FROM tunnel.section").fetchall()])
    assert len(widest) == 24
    assert widest.max() < 1.1 * np.median(widest)
