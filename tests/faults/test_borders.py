"""A tunnel comes out the same whether it is processed kilometre by kilometre, in parts or whole."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from faults.project import Project, register, state
from faults.scene import NAME, Scan, make, split
from faults.waiting import done, wait_for
from rasterio.io import MemoryFile

LAST = 2
MILLIMETRE, PER_MILLE = 1e-3, 1e-3


def by_kilometre(scan: Scan) -> np.ndarray:
    return (scan.chainage // 1000).astype(np.int64)


def in_parts(scan: Scan) -> np.ndarray:
    """Three files: the second is cut through a leak and spans a kilometre and more."""
    return np.searchsorted([1013.37, 1999.2], scan.chainage)


@pytest.fixture(scope="module")
def ways(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, dict[str, Any]]]:
    """What becomes of the same points: kilometres in a scrambled order, parts in another, and all at once."""
    scene = make(1, LAST)
    # Beyond the second plane nothing was scanned for 14 m, where a leak lay: the axis is placed by what lies around it.
    scan = scene.scan.part(~((scene.scan.chainage > 2004.0) & (scene.scan.chainage < 2018.0)))
    folder = {name: tmp_path_factory.mktemp(name) for name in ("kilometres", "parts", "whole")}
    kilometres = split(scan, folder["kilometres"], by_kilometre)
    parts = split(scan, folder["parts"], in_parts)
    (whole,) = split(scan, folder["whole"], lambda scan: np.zeros(len(scan.time), np.int64))
    points = scan.xyz[np.random.default_rng(3).integers(0, len(scan.xyz), 1000)]
    project = Project(scene)
    # The same worker through all: it registers anew when its database is away for a moment.
    worker = project.begin("--dsn", project.dsn, "worker", log="worker.log")
    try:
        # A project begins fresh: to make its database anew now would take it from a worker that does not yet know it.
        found = {"kilometres": _process(project, worker, points, [(kilometres[km], range(km, km + 1)) for km in (1, 0, 2)])}
        project.fresh()
        found["parts"] = _process(project, worker, points, [(parts[n], None) for n in (1, 2, 0)])
        project.fresh()
        found["whole"] = _process(project, worker, points, [(whole, None)])
        yield found
        project.call("stop", "--wait")
        assert worker.wait(60) == 0
    finally:
        worker.kill()
        worker.wait()
        project.close()


def _process(
    project: Project, worker: subprocess.Popen[bytes], points: np.ndarray, asked: list[tuple[Path, range | None]]
) -> dict[str, Any]:
    """Ask for files, within kilometres, one after the other, each when the one before is done."""
    for file, kilometres in asked:
        register(project, [file], kilometres)
        wait_for(project, lambda: done(project), worker)
    found = state(project)
    table, unrolled = project.home / "points.csv", project.home / "unrolled.csv"
    np.savetxt(table, points, fmt="%.4f", delimiter=",", header="x,y,z", comments="")
    project.call("unroll", NAME, table, "-o", unrolled)
    found["unrolled"] = np.genfromtxt(unrolled, delimiter=",", names=True)
    return found


WAYS = ("kilometres", "parts")


@pytest.mark.parametrize("way", WAYS)
def test_all_is_current(ways: dict[str, Any], way: str) -> None:
    assert {row[2:4] for row in ways[way]["status"]} == {("done", False)}
    assert ways[way]["jobs"] == ways[way]["incoming"] == []
    assert ways[way]["tables"] == ways["whole"]["tables"]


@pytest.mark.parametrize("way", WAYS)
def test_points_axis_and_sections_are_the_same(ways: dict[str, Any], way: str) -> None:
    one, other = ways[way], ways["whole"]
    (a, places), (b, others) = _points(one), _points(other)
    _, a, b = np.intersect1d(a, b, return_indices=True)
    # Noise is told within a file: a lone point at its end may be taken for some.
    assert len(a) >= (1 - PER_MILLE) * max(len(one["point"]), len(other["point"]))
    np.testing.assert_array_equal(places[a], others[b])
    for name, columns in {"axis_vertex": (2,), "segment": (2, 3, 8), "section": (3, 6, 7, 8)}.items():
        assert [row[:2] for row in one[name]] == [row[:2] for row in other[name]]
        for column in columns:
            a, b = (np.array([row[column] for row in found[name]]) for found in (one, other))
            np.testing.assert_allclose(a, b, rtol=0, atol=MILLIMETRE, err_msg=f"{name} {column}")
    assert [row[-1] for row in one["axis_vertex"]] == [row[-1] for row in other["axis_vertex"]]


@pytest.mark.parametrize("way", WAYS)
def test_ground_and_classes_are_the_same(ways: dict[str, Any], way: str) -> None:
    one, other = ways[way], ways["whole"]
    assert [row[:2] for row in one["ground"]] == [row[:2] for row in other["ground"]]
    (x, a), (y, b) = (_heights(found["ground"]) for found in (one, other))
    _, i, j = np.intersect1d(x, y, return_indices=True)
    assert len(i) >= (1 - PER_MILLE) * max(len(a), len(b))
    assert (np.abs(a[i] - b[j]) <= MILLIMETRE).mean() >= 1 - PER_MILLE
    arcs = [np.array([row[7:9] for row in found["ground"]], np.float64) for found in (one, other)]
    assert (np.abs(arcs[0] - arcs[1]) <= 2 * MILLIMETRE).mean() >= 1 - 10 * PER_MILLE
    _, i, j = np.intersect1d(_points(one)[0], _points(other)[0], return_indices=True)
    assert (one["point"]["class"][i] == other["point"]["class"][j]).mean() >= 1 - PER_MILLE


@pytest.mark.parametrize("way", WAYS)
def test_unrolling_is_the_same(ways: dict[str, Any], way: str) -> None:
    one, other = ways[way]["unrolled"], ways["whole"]["unrolled"]
    for name in ("chainage", "arc", "offset"):
        np.testing.assert_allclose(one[name], other[name], rtol=0, atol=MILLIMETRE)
    assert np.isfinite(one["arc"]).mean() > 0.95


@pytest.mark.parametrize("way", WAYS)
def test_images_are_the_same(ways: dict[str, Any], way: str) -> None:
    one, other = ways[way]["image"], ways["whole"]["image"]
    assert [row[:3] for row in one] == [row[:3] for row in other]
    for (km, kind, block, a), (_, _, _, b) in zip(one, other, strict=True):
        x, y = _raster(a), _raster(b)
        assert x.shape == y.shape
        # Pixels at the edge of a hole may fill by a point that lies a micrometre to the other side.
        alike = np.isnan(x) == np.isnan(y)
        assert alike.mean() >= 1 - PER_MILLE, (km, kind, block)
        step = MILLIMETRE if kind == "offset" else 0.02
        within = np.isclose(x, y, rtol=PER_MILLE, atol=step, equal_nan=True)
        assert within[alike].mean() >= 1 - PER_MILLE, (km, kind, block)


@pytest.mark.parametrize("way", WAYS)
def test_leaks_are_the_same_and_whole(ways: dict[str, Any], way: str) -> None:
    one, other = ways[way]["finding"], ways["whole"]["finding"]
    assert len(one) == len(other) == 2 * LAST - 1
    for a, b in zip(one, other, strict=True):
        assert a[0] == b[0]
        np.testing.assert_allclose(a[1:5], b[1:5], rtol=0, atol=MILLIMETRE)
        np.testing.assert_allclose(a[6:10], b[6:10], rtol=PER_MILLE)
    # The one across the second plane is one leak, of the size that it was made with.
    (across,) = [row for row in one if row[1] < 2000.0 < row[2]]
    assert across[6] == pytest.approx(np.pi * 2.2 * 0.9, rel=0.1)


def _points(found: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """What tells the points apart (time and coordinates to the micrometre), and where each is held to lie."""
    rows = found["point"]
    columns = [rows["time"].round(6), *(rows[axis].round(6) for axis in "xyz")]
    return np.rec.fromarrays(columns, names="t,x,y,z").view(np.ndarray), np.column_stack([rows["km"], rows["segment"]])


def _heights(ground: list[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Places of the ground, each a metre along and a column across, and the height there."""
    places = [(row[0], round(row[2] * 10) + k) for row in ground for k in range(len(row[3]))]
    heights = np.array([height for row in ground for height in row[3]])
    known = np.isfinite(heights)
    return np.rec.array(places, dtype="i8,i8").view(np.ndarray)[known], heights[known]


def _raster(tiff: bytes) -> np.ndarray:
    with MemoryFile(tiff) as file, file.open() as image:
        return image.read(1, masked=True).astype(float).filled(np.nan) * image.scales[0]
