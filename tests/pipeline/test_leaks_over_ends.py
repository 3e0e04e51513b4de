"""Leaks over the end of a kilometre: one leak, the same as if the kilometre ended elsewhere, whatever is done first."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import psycopg
import pytest
import shapely
from shapely.geometry import Polygon
from support.databases import Copies
from support.loaded_survey import SURVEY, add_survey

from tests.pipeline.test_detect import APPENDAGE, FLOOR, NAME, command, counts, outlines, parameters, prepare, share_of
from tunneldb.anomalies.background import relate as relating
from tunneldb.anomalies.background.level import BackgroundLevel
from tunneldb.anomalies.background.level_map import BackgroundMap, map_background
from tunneldb.anomalies.reconcile import Boundary, gather_boundary
from tunneldb.anomalies.regions import Region, RegionProperties
from tunneldb.pipeline import calibration as radiometry
from tunneldb.pipeline import detect as job
from tunneldb.radiometry.roughness import Roughness
from tunneldb.raster.floor import Floor
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import LiningImage
from tunneldb.raster.observation import Observer
from tunneldb.simulate import Simulation, generate, write
from tunneldb.simulate.lining.leaks import Leak
from tunneldb.stages.parameters import settings
from tunneldb.store.boundary_regions import load_boundary_regions, replace_boundary_regions
from tunneldb.store.scene import load_arcs
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey, get_survey

START, PLANE, LENGTH = 12_992.0, 13_000.0, 16.0
SHIFT = 480.0
"""So much lower is the chainage at which there is no end: a multiple of all that is laid out along the tunnel, m."""

ROUGHNESS = Roughness(14.0, True, False, 0.0, 0.0, 2, 0.0, 60.0)
PIXEL = 0.02


def ragged(chainage: float, arc: float, size: float) -> Polygon:
    """A wet patch with lobes, about 2 m long for a size of 1."""
    angle = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    radius = size * (1 + 0.3 * np.cos(3 * angle) + 0.15 * np.sin(7 * angle))
    return Polygon(np.column_stack([chainage + radius * np.cos(angle), arc + 0.5 * radius * np.sin(angle)]))


WET = [
    ragged(PLANE - 0.3, 1.5, 0.9),
    ragged(PLANE + 0.1, -2.0, 0.25),
    ragged(PLANE - 5, 1.0, 0.4),
    ragged(PLANE + 4, -1.0, 0.4),
]


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("border")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(generate, "place", lambda *_: [Leak(k, wet, wet.area, 3.0) for k, wet in enumerate(WET, 1)])
        write(Simulation(parameters("profiler", 1, start_chainage=START, length=LENGTH)), folder)
    return folder


@pytest.fixture(scope="module")
def prepared(copies: Copies, template: str, scan: Path) -> Iterator[str]:
    """A database of two kilometres up to their ground, to be copied."""

    def fill() -> None:
        prepare(scan, "profiler", start=START)
        command("run", NAME, "--to", "ground")

    with copies.prepared(template, fill) as name:
        yield name


@pytest.fixture
def sections(copies: Copies, prepared: str) -> Iterator[psycopg.Connection]:
    """Connection to a copy of two kilometres up to their ground."""
    with copies.connected(prepared) as conn:
        yield conn


def flat(grid: Grid, mean: float, spread: float) -> BackgroundMap:
    """Dry lining that is everywhere alike."""
    rings, bands = np.zeros(grid.columns, np.float32), np.zeros((grid.rows, grid.blocks), np.float32)
    smooth = np.zeros((-(-grid.rows // 25), grid.columns // 25), np.float32)
    level = BackgroundLevel(25, mean, rings, bands, smooth)
    return BackgroundMap(grid, level, np.full_like(smooth, spread), mean, spread, 1)


@pytest.fixture
def uncut(sections: psycopg.Connection, monkeypatch: pytest.MonkeyPatch) -> list[Polygon]:
    """The leaks with the same surface and points, but the end elsewhere; roughness and dry lining are one for all then."""
    conn = sections
    survey = get_survey(conn, NAME)
    there = load_surface(conn, survey)
    surface = replace(there, ends=there.ends - SHIFT, chainages=there.chainages - SHIFT)
    first, values = int(START - SHIFT), settings()
    inputs = job.load_inputs(conn, survey, 12, values)
    assert inputs.sample is not None
    floor = Floor.of(first, *load_arcs(conn, survey, int(START), int(START + LENGTH)))
    depth = values["lining.tolerance"], values["lining.recess"]
    grid = job.kilometre_grid(surface, 12, PIXEL)
    (points,) = conn.execute("SELECT points FROM tunnel.scan_file").fetchone()
    elsewhere = replace(
        inputs,
        observer=Observer.of(surface, 12, depth, inputs.observer.radiometer, floor, grid.halo * PIXEL),
        grid=grid,
        files=[replace(file, ranges=[(0, points)]) for file in inputs.files],
    )
    conn.rollback()

    def even(picture: LiningImage, *_: object) -> BackgroundMap:
        dry = map_background(picture)
        return flat(picture.grid, dry.mean, dry.spread)

    monkeypatch.setattr(radiometry, "roughness_of", lambda *_: ROUGHNESS)
    monkeypatch.setattr(relating, "map_background", even)
    result = job.compute_detection(elsewhere, inputs.sample, values, lambda grid, window: None, lambda share: None)
    dry = result.background
    monkeypatch.setattr(relating, "map_background", lambda picture, *_: flat(picture.grid, dry.mean, dry.spread))
    return [shapely.affinity.translate(anomaly.outline, SHIFT) for anomaly in result.anomalies.anomalies]


def assert_same(found: dict[int, Polygon], expected: list[Polygon]) -> None:
    assert len(found) == len(expected)
    for polygon in expected:
        best = max(found.values(), key=lambda other: polygon.intersection(other).area)
        assert best.area == pytest.approx(polygon.area, rel=0.001)
        assert polygon.hausdorff_distance(best) < 0.001


def over_end(conn: psycopg.Connection) -> dict[int, Polygon]:
    return {key: polygon for key, polygon in outlines(conn).items() if polygon.bounds[0] < PLANE < polygon.bounds[2]}


def test_leaks_over_the_end_are_what_they_are_elsewhere(sections: psycopg.Connection, uncut: list[Polygon], scan: Path) -> None:
    conn = sections
    assert len(uncut) >= len(WET)
    command("run", NAME, "--from", "detect")
    assert counts(conn)["leaks_over_ends"] == 2
    found = outlines(conn)
    assert_same(found, uncut)
    for wet in WET[:2]:
        (same,) = [polygon for polygon in over_end(conn).values() if polygon.intersects(wet)]
        assert same.intersection(wet).area / same.union(wet).area > 0.8
        assert share_of(scan, same, APPENDAGE) < 0.05
        assert share_of(scan, same, FLOOR) < 0.05
    assert conn.execute("SELECT count(*) FROM tunnel.finding WHERE features IS NULL OR model IS NULL").fetchone() == (0,)
    for km, west, east, share, area in conn.execute(
        "SELECT km, chainage_from, chainage_to, image_share, area / ST_Area(unrolled) FROM tunnel.finding"
    ):
        assert km == (west + east) / 2 // 1000
        assert 0.3 < share <= 1
        assert area == pytest.approx(1, abs=0.03)
    conn.rollback()
    # Doing both again, or only one, changes nothing; a review stays.
    (larger, _) = sorted(over_end(conn), key=lambda key: -found[key].area)
    conn.execute("UPDATE tunnel.finding SET review = 'confirmed' WHERE id = %s", [larger])
    conn.commit()
    for options in ([], ["--km", 12], ["--km", 13]):
        command("run", NAME, "--from", "detect", *options)
        again = outlines(conn)
        assert again.keys() == found.keys()
        assert all(again[key].equals(found[key]) for key in found)
        assert (counts(conn)["leaks_new"], counts(conn)["leaks_gone"]) == (0, 0)
    assert conn.execute("SELECT review FROM tunnel.finding WHERE id = %s", [larger]).fetchone() == ("confirmed",)
    conn.rollback()
    command("survey", "remove", NAME, "--yes")
    assert conn.execute("SELECT count(*) FROM tunnel.boundary_region").fetchone() == (0,)


@pytest.mark.parametrize(("first", "second"), [(12, 13), (13, 12)])
def test_a_half_that_was_found_first_becomes_the_whole(
    sections: psycopg.Connection, uncut: list[Polygon], first: int, second: int
) -> None:
    conn = sections
    command("run", NAME, "--from", "detect", "--km", first)
    halves = {
        key: polygon for key, polygon in outlines(conn).items() if polygon.distance(shapely.box(PLANE, -9, PLANE, 9)) < 0.02
    }
    # What the smaller leak has in kilometre 12 is too small for a leak of its own.
    assert len(halves) == {12: 1, 13: 2}[first]
    assert not over_end(conn)
    conn.execute("UPDATE tunnel.finding SET review = 'rejected', remark = 'old stain' WHERE id = ANY (%s)", [list(halves)])
    conn.commit()
    command("run", NAME, "--from", "detect", "--km", second)
    assert_same(outlines(conn), uncut)
    assert len(over_end(conn)) == 2
    assert halves.keys() <= over_end(conn).keys()
    kept = conn.execute("SELECT review, remark, detected FROM tunnel.finding WHERE id = ANY (%s)", [list(halves)]).fetchall()
    assert kept == [("rejected", "old stain", True)] * len(halves)


def test_pixels_of_two_sizes_are_not_put_together(sections: psycopg.Connection, uncut: list[Polygon]) -> None:
    conn = sections
    command("run", NAME, "--from", "detect")
    whole = over_end(conn)
    command("run", NAME, "--from", "detect", "--km", 12, "--set", "image.pixel=0.025")
    assert "to kilometre 13 are in two pieces" in counts(conn)["note"]
    assert not over_end(conn)
    assert len(outlines(conn)) == len(uncut) + 1  # the smaller leak has too little in kilometre 12 for one of its own
    command("run", NAME, "--from", "detect", "--km", 12)
    assert "in two pieces" not in counts(conn).get("note", "")
    assert_same(outlines(conn), uncut)
    assert over_end(conn).keys() == whole.keys()


def region(first: int, last: int, row: int = 0) -> Region:
    return Region(
        0.5,
        first,
        row,
        np.ones((2, last - first), bool),
        2 * (last - first),
        1.0,
        float(first),
        RegionProperties(perimeter=1.0),
    )


def boundary(conn: psycopg.Connection, survey: Survey, km: int, regions: list[Region]) -> Boundary:
    """Save the boundary regions of a kilometre, and gather what lies across its ends."""
    replaced = replace_boundary_regions(conn, survey, km, regions)
    return gather_boundary(km, lambda kms: load_boundary_regions(conn, survey, kms), replaced)


THROUGH = {
    12: [region(25_990, 26_000), region(25_500, 26_000, row=9)],
    13: [region(26_000, 28_000), region(26_000, 26_007, row=20)],
    14: [region(28_000, 28_020), region(28_000, 28_020, row=-9)],
}
"""A leak all along kilometre 13 and over both its ends, with others at the ends that go no further."""


@pytest.mark.parametrize("order", [*itertools.permutations(THROUGH), (13, 12, 13, 14, 14, 12), (12, 14, 12, 13, 13)])
def test_any_order_of_kilometres_puts_the_same_together(conn: psycopg.Connection, order: tuple[int, ...]) -> None:
    add_survey(conn)
    survey = get_survey(conn, SURVEY)
    for km in order:
        border = boundary(conn, survey, km, THROUGH[km])
        # What lies at the far end of a neighbour is none of its business.
        assert all(any(abs(part.km - km) <= 1 for part in cluster.parts) for cluster in border.clusters)
        assert km in {part.km for cluster in border.clusters for part in cluster.parts}
    seen = {}
    for km in THROUGH:
        for cluster in boundary(conn, survey, km, THROUGH[km]).clusters:
            made = cluster.region
            box = (made.column, made.row, made.stop, made.row + len(made.mask))
            assert seen.setdefault(box, made).mask.tolist() == made.mask.tolist()
            assert made.properties == RegionProperties(perimeter=float(len(cluster.parts)))
            assert (made.filled, made.darkening_max) == (
                made.mask.sum(),
                max(part.region.darkening_max for part in cluster.parts),
            )
    assert sorted(seen) == [
        (25_500, 9, 26_000, 11), (25_990, 0, 28_020, 2), (26_000, 20, 26_007, 22), (28_000, -9, 28_020, -7),
    ]  # fmt: skip


def test_what_a_kilometre_no_longer_shows_comes_apart(conn: psycopg.Connection) -> None:
    add_survey(conn)
    survey = get_survey(conn, SURVEY)
    for km, parts in THROUGH.items():
        boundary(conn, survey, km, parts)
    border = boundary(conn, survey, 13, [])
    boxes = [(cluster.region.column, cluster.region.stop) for cluster in border.clusters]
    assert sorted(boxes) == [(25_500, 26_000), (25_990, 26_000), (28_000, 28_020), (28_000, 28_020)]
