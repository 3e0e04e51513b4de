"""Scan files of a survey written again with the classes that stage ground has found."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import laspy
import laspy.copc
import numpy as np
import psycopg
import pytest
from pyproj import Transformer
from support.command import output_of
from support.databases import Copies

from tunneldb.classification.classes import PointClass
from tunneldb.geometry.units import METRES
from tunneldb.simulate import Parameters, Simulation, write
from tunneldb.store.scan_files import checksum
from tunneldb.store.scene import load_scene
from tunneldb.store.survey import get_survey

NAME = "s"
START, LENGTH, BORDER = 980.0, 50.0, 1020.0  # a kilometre ends in the first file, and its margin too
FOOT = METRES["us-ft"]
FLOOR, LINING = 1, 0  # of the truth
FAR = 100.0  # m above the tunnel: points of nothing


@pytest.fixture(scope="module")
def scans(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, np.ndarray]]:
    """A folder with two files, of which the first lies in two kilometres, and the truth of their points."""
    folder = tmp_path_factory.mktemp("scans")
    simulation = Simulation(
        Parameters(
            name="whole", length=LENGTH, start_chainage=START, section="horseshoe", scanner="profiler", density=300.0,
            leaks=0, people=2, equipment=2, ballast=0.01,
        )
    )  # fmt: skip
    made = write(simulation, folder)
    las = laspy.read(made.clouds[0])
    truth = np.load(made.truth[0])
    first = truth["chainage"] < BORDER
    klass = {}
    for name, chosen in (("a.laz", first), ("b.las", ~first)):
        part = laspy.LasData(las.header, las.points[chosen].copy())
        # At the end of the first file points that belong to no tunnel.
        part.Z[-10:] += round(FAR / las.header.scales[2])
        part.write(folder / name)
        klass[name] = truth["class"][chosen]
    made.clouds[0].unlink()
    return folder, klass


@pytest.fixture(scope="module")
def loaded(copies: Copies, template: str, scans: tuple[Path, dict[str, np.ndarray]]) -> Iterator[str]:
    """Database in which both files are loaded, to be copied."""
    folder, _ = scans

    def fill() -> None:
        output_of("tunnel", "add", NAME, "--srid", 25830, "--axis", folder / "whole.axis.csv", "--start-chainage", START)
        output_of(
            "survey", "add", NAME, "--tunnel", NAME, "--date", "2024-05-04",
            "--trajectory", folder / "whole.trajectory.csv", "--intensity", "Amplitude", "--intensity-kind", "amplitude",
        )  # fmt: skip
        output_of("load", NAME, folder / "a.laz", folder / "b.las")

    with copies.prepared(template, fill) as name:
        yield name


@pytest.fixture(scope="module")
def classed(copies: Copies, loaded: str) -> Iterator[str]:
    """The same up to its ground."""
    with copies.prepared(loaded, lambda: output_of("run", NAME, "--to", "ground")) as name:
        yield name


def export(out: Path, *options: object, code: int = 0) -> str:
    return output_of("export", NAME, "--classified", "-o", out, *options, code=code)


@pytest.fixture
def conn(copies: Copies, classed: str) -> Iterator[psycopg.Connection]:
    """Connection to a copy up to its ground."""
    with copies.connected(classed) as connection:
        yield connection


def test_files_get_the_classes(conn: psycopg.Connection, scans: tuple[Path, dict[str, np.ndarray]], tmp_path: Path) -> None:
    folder = scans[0]
    text = export(tmp_path / "out")
    scene = load_scene(conn, get_survey(conn, NAME), 0, 1)
    total = np.zeros(256, int)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a.laz", "b.laz"]
    for name, klass in scans[1].items():
        before, after = laspy.read(folder / name), laspy.read((tmp_path / "out" / name).with_suffix(".laz"))
        np.testing.assert_array_equal(before.xyz, after.xyz)
        for dimension in set(before.point_format.dimension_names) - {"classification"}:
            np.testing.assert_array_equal(before[dimension], after[dimension], err_msg=dimension)
        found = np.asarray(after.classification)
        assert (found[-10:] == PointClass.UNASSIGNED).all()
        found, klass = found[:-10], klass[:-10]
        assert np.mean(found[klass == FLOOR] == PointClass.GROUND) > 0.98
        assert np.mean(found[klass == LINING] == PointClass.LINING) > 0.95
        assert np.mean(klass[found == PointClass.GROUND] == FLOOR) > 0.98
        np.testing.assert_array_equal(found, scene.classes(np.asarray(before.xyz))[:-10])
        total += np.bincount(after.classification, minlength=256)
    for klass in (PointClass.GROUND, PointClass.LINING, PointClass.UNASSIGNED):
        assert f"{total[klass]:,}".replace(",", " ") in text

    export(tmp_path / "second", "--km", 1)  # both files touch it
    assert len(list((tmp_path / "second").iterdir())) == 2
    assert (tmp_path / "second" / "a.laz").read_bytes() == (tmp_path / "out" / "a.laz").read_bytes()
    export(tmp_path / "first", "--km", 0)
    assert [path.name for path in (tmp_path / "first").iterdir()] == ["a.laz"]

    bytes_before = (folder / "a.laz").read_bytes()
    assert "is a loaded scan file" in export(folder, code=2)
    assert (folder / "a.laz").read_bytes() == bytes_before
    assert not (folder / "b.laz").exists()

    output_of("run", NAME, "--km", 1, "--from", "sections", "--to", "sections")
    text = export(tmp_path / "stale", code=2)
    assert "out of date" in text
    assert f"tunneldb run {NAME} --km 0-1 --from ground --to ground" in text
    assert not (tmp_path / "stale").exists()
    output_of("run", NAME, "--km", "0-1", "--from", "ground", "--to", "ground")
    export(tmp_path / "stale")


def test_a_converted_file_is_written_in_its_own_unit(
    conn: psycopg.Connection, scans: tuple[Path, dict[str, np.ndarray]], tmp_path: Path
) -> None:
    """And not as COPC, whose message says what to do instead."""
    export(tmp_path / "metres", "--km", 0)
    path = tmp_path / "a.laz"
    las = laspy.read(scans[0] / "a.laz")
    for scaled in (las.header, las.points):
        scaled.scales, scaled.offsets = scaled.scales / FOOT, scaled.offsets / FOOT
    las.write(path)
    conn.execute(
        "UPDATE tunnel.scan_file SET path = %s, bytes = %s, checksum = %s, unit = 'us-ft', height_unit = 'us-ft'"
        " WHERE name = 'a.laz'",
        [str(path), path.stat().st_size, checksum(path)],
    )
    conn.commit()
    assert "export without --copc" in export(tmp_path / "feet", "--km", 0, "--copc", code=2)
    assert "choose them by --km" in export(tmp_path / "feet", "--from", 0, code=2)
    assert "x and y in us-ft, z in us-ft, as in the scan file" in export(tmp_path / "feet", "--km", 0)
    metres, feet = (laspy.read(tmp_path / unit / "a.laz") for unit in ("metres", "feet"))
    np.testing.assert_allclose(feet.xyz * FOOT, metres.xyz, atol=1e-6)
    np.testing.assert_array_equal(feet.classification, metres.classification)


def test_without_ground_it_says_what_to_type(copies: Copies, loaded: str, tmp_path: Path) -> None:
    with copies.connected(loaded):
        _without_ground(tmp_path)


def _without_ground(tmp_path: Path) -> None:
    assert "scan files by --classified" in output_of("export", NAME, "-o", tmp_path / "out", code=2)
    text = export(tmp_path / "out", code=2)
    assert text.count("\n") == 1
    assert f"kilometres 0, 1 without ground: tunneldb run {NAME} --km 0-1 --from axis --to ground" in text
    assert not (tmp_path / "out").exists()
    output_of("run", NAME, "--to", "sections")
    output_of("run", NAME, "--km", 0, "--from", "ground", "--to", "ground")
    text = export(tmp_path / "out", "--km", 0, code=2)  # the file lies in both
    assert f"kilometre 1 without ground: tunneldb run {NAME} --km 1 --from ground --to ground" in text


@pytest.mark.usefixtures("conn")
def test_a_file_that_was_changed_is_refused(scans: tuple[Path, dict[str, np.ndarray]], tmp_path: Path) -> None:
    path = scans[0] / "b.las"
    data = path.read_bytes()
    try:
        path.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
        assert "changed since it was loaded" in export(tmp_path / "out", code=2)
        path.unlink()
        assert "gone since it was loaded" in export(tmp_path / "out", code=2)
    finally:
        path.write_bytes(data)
    assert [path.name for path in (tmp_path / "out").iterdir()] in ([], ["a.laz"])


def test_kilometres_as_copc_hold_the_same_points(conn: psycopg.Connection, tmp_path: Path) -> None:
    out = tmp_path / "out"
    export(out)
    export(tmp_path / "copc", "--copc")
    names = [f"{NAME}-km000.copc.laz", f"{NAME}-km001.copc.laz", f"{NAME}.vpc"]
    assert sorted(path.name for path in (tmp_path / "copc").iterdir()) == names
    whole = [laspy.read(out / name).points for name in ("a.laz", "b.laz")]
    array = np.concatenate([points.array for points in whole])
    virtual = json.loads((tmp_path / "copc" / names[2]).read_text())
    total, found = 0, []
    for name, item in zip(names, virtual["features"], strict=False):
        with laspy.CopcReader.open(tmp_path / "copc" / name) as reader:
            points = reader.query()
            levels = [len(reader.query(level=level)) for level in range(20)]
            low, high = reader.header.mins, reader.header.maxs
            step = reader.header.scales
            half = low + (np.rint((high - low) / 2 / step) + 0.2) * step  # which no point has
            part = reader.query(bounds=laspy.copc.Bounds(low, half))
            assert reader.header.parse_crs().to_epsg() == 25830
            centre, edge = reader.copc_info.center, reader.copc_info.halfsize
        xyz = np.column_stack([points.x, points.y, points.z])
        assert sum(levels) == len(points) == item["properties"]["pc:count"]
        assert len(part) == np.count_nonzero((xyz <= half).all(axis=1))
        np.testing.assert_allclose(xyz.min(axis=0), low)
        np.testing.assert_allclose(xyz.max(axis=0), high)
        np.testing.assert_allclose(item["properties"]["proj:bbox"], [*low, *high])
        assert (np.abs(xyz - centre) <= edge).all()
        statistics = {entry["name"]: entry for entry in item["properties"]["pc:statistics"]}
        assert statistics["Amplitude"]["average"] == pytest.approx(float(np.mean(points["Amplitude"], dtype=float)))
        assert statistics["Classification"]["maximum"] == points.classification.max()
        assert item["assets"]["data"]["href"] == f"./{name}"
        west, south, _, east, north, _ = item["bbox"]
        degrees = Transformer.from_crs(25830, 4326, always_xy=True).transform(*xyz[:, :2].T)
        for (least, greatest), values in zip(((west, east), (south, north)), degrees, strict=True):
            assert least - 1e-9 <= values.min() < least + 1e-4
            assert greatest - 1e-4 < values.max() <= greatest + 1e-9
        total += len(points)
        found.append(points)
    assert total == len(array)
    both = np.concatenate([points.array for points in found])
    order = ["gps_time", "X", "Y", "Z"]
    np.testing.assert_array_equal(np.sort(both, order=order), np.sort(array, order=order))

    again = (tmp_path / "copc" / names[0]).read_bytes()
    export(tmp_path / "copc", "--copc", "--km", 1)
    assert (tmp_path / "copc" / names[0]).read_bytes() == again
    assert json.loads((tmp_path / "copc" / names[2]).read_text())["features"] == virtual["features"]
    (tmp_path / "copc" / names[2]).write_text("[]")
    assert "is not a virtual point cloud: move it away" in export(tmp_path / "copc", "--copc", "--km", 1, code=2)
    (tmp_path / "copc" / names[2]).rename(tmp_path / names[2])
    export(tmp_path / "copc", "--copc", "--km", 1)
    assert "--copc goes with --classified" in output_of("export", NAME, "-o", tmp_path / "x", "--copc", code=2)

    # Where the other kilometre isn't loaded, its points wait for it.
    conn.execute(f"DROP TABLE tunnel.point_s{get_survey(conn, NAME).id}_km1")
    conn.commit()
    export(tmp_path / "alone", "--copc")
    assert sorted(path.name for path in (tmp_path / "alone").iterdir()) == [names[0], names[2]]
    with laspy.CopcReader.open(tmp_path / "alone" / names[0]) as reader:
        assert len(reader.query()) == len(found[0])
