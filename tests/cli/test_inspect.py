"""`tunneldb inspect`: what it says of simulated scans is what they were made as, and what it says to type works."""

from __future__ import annotations

import json
import os
import shlex
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest
from click.testing import CliRunner
from pyproj import CRS

from tunneldb.cli.main import main
from tunneldb.pointcloud.reader import check_header, crs_note, read_header
from tunneldb.simulate import Parameters, Simulation, write

pytestmark = pytest.mark.slow


def inspected(*files: object, code: int = 0) -> dict[str, Any]:
    result = CliRunner().invoke(main, ["inspect", *map(str, files), "--json"])
    assert result.exit_code == code, result.output
    return json.loads(result.stdout)


@pytest.fixture(scope="module")
def tls(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("inspect")
    write(
        Simulation(Parameters(name="bend", length=24.0, scanner="static", angular_step=0.6, srid=3794, leaks=1, seed=3)), folder
    )
    return folder / "bend.laz"


def changed(source: Path, target: Path, scale: float = 1.0, crs: int | None = None, bare: bool = False) -> Path:
    """The same scan in another unit, without its coordinate system or with another, perhaps with nothing but coordinates."""
    las = laspy.read(source)
    header = laspy.LasHeader(point_format=0 if bare else 6, version="1.4")
    header.scales, header.offsets = [0.001] * 3, np.floor(las.xyz.min(axis=0) * scale)
    if crs is not None:
        header.add_crs(CRS(crs))
    out = laspy.LasData(header)
    out.x, out.y, out.z = (las.xyz * scale).T
    out.intensity = las.intensity
    if not bare:
        out.point_source_id = las.point_source_id
    out.write(target)
    return target


def test_stations_of_another_name_are_taken_where_there_is_one_table_of_them(tls: Path, tmp_path: Path) -> None:
    scan = tmp_path / "scan.laz"
    scan.symlink_to(tls)
    table = tls.with_name("bend.stations.csv").read_text()
    own, far = tmp_path / "positions-stations.csv", tmp_path / "far-stations.csv"
    own.write_text(table)
    far.write_text("scan_id,x,y,z\n" + "".join(f"{n},1000,1000,5\n" for n in range(1, 9)))  # in another place
    (tmp_path / "stations.csv").write_text("name,x\nA,1\n")  # another table
    said = inspected(scan)
    (added,) = [command for command in said["commands"] if "survey add" in command]
    assert f"--stations {own}" in added
    assert "survey add scan-1 --tunnel scan" in added
    assert any(doubt.startswith("positions-stations.csv has stations") for doubt in said["doubts"])
    (tmp_path / "again-stations.csv").write_text(table)  # which of the two?
    assert not any("-stations.csv" in command for command in inspected(scan)["commands"])


def test_what_a_scan_holds(tls: Path) -> None:
    said = inspected(tls)
    (look,) = said["files"]
    las = laspy.read(tls)
    assert (look["points"], look["srid"], look["unit"], look["profile_spacing"]) == (len(las), 3794, None, None)
    np.testing.assert_allclose([look["low"], look["high"]], [las.xyz.min(axis=0), las.xyz.max(axis=0)], atol=1e-9)
    numbers, counts = np.unique(las.point_source_id, return_counts=True)
    assert look["scans"] == dict(zip(map(str, numbers.tolist()), counts.tolist(), strict=True))
    assert look["times"] == [las.gps_time.min(), las.gps_time.max()]
    assert look["length"] == pytest.approx(24.0, abs=0.5)
    assert look["width"] == pytest.approx(8.0, abs=0.3)
    kinds = {one["name"]: one["guesses"][0]["kind"] for one in look["intensities"]}
    assert kinds == {"intensity": "linear", "Amplitude": "amplitude", "Reflectance": "reflectance"}
    by_name = {one["name"]: one["values"] for one in look["intensities"]}
    assert by_name["Amplitude"]["most"] == pytest.approx(las.Amplitude.max())
    assert by_name["Amplitude"]["median"] == pytest.approx(np.median(las.Amplitude))
    assert by_name["intensity"]["whole"]


def test_what_is_to_be_typed_next_are_commands(tls: Path) -> None:
    said = inspected(tls)
    assert [line for line in said["missing"] if "day" not in line] == []
    for line in said["commands"]:
        words = shlex.split(line.replace("YYYY-MM-DD", "2024-05-04"))
        assert words[0] == "tunneldb"
        command: Any = main
        context = None
        while words[1:] and hasattr(command, "get_command"):
            words = words[1:]
            command = command.get_command(context, words[0])
        command.make_context("x", words[1:])  # parses the options, and refuses those that are none
    tunnel, survey = said["commands"][1:3]
    assert f"--srid 3794 --axis {tls.parent}/bend.axis.csv" in tunnel
    assert f"--stations {tls.parent}/bend.stations.csv --intensity Reflectance --intensity-kind reflectance" in survey


def test_what_is_missing_is_said(tls: Path, tmp_path: Path) -> None:
    bare = changed(tls, tmp_path / "cloud.las", bare=True)
    said = inspected(bare)
    text = "\n".join(said["missing"])
    for word in ("axis", "EPSG code in place of SRID", "scanner positions", "YYYY-MM-DD"):
        assert word in text
    assert any("merged" in doubt and "--no-poses" in doubt for doubt in said["doubts"])
    assert f"--srid SRID --axis auto {bare}" in said["commands"][1]
    assert "--stations STATIONS.csv --intensity intensity --intensity-kind linear --reference auto" in said["commands"][2]
    assert any("intensity is guessed to be 16-bit counts" in doubt for doubt in said["doubts"])


def test_feet_are_noticed(tls: Path, tmp_path: Path) -> None:
    (look,) = inspected(changed(tls, tmp_path / "a.las", 1 / 0.3048))["files"]
    assert "looks like feet" in look["unit"]
    assert inspected(changed(tls, tmp_path / "b.las"))["files"][0]["unit"] is None
    (named,) = inspected(changed(tls, tmp_path / "c.las", 1.0, crs=2263))["files"]
    assert named["unit"].endswith("(NAD83 / New York Long Island (ftUS)), not metres; convert them by --unit us-ft")


def test_millimetres_are_noticed_and_the_advised_unit_works(tls: Path, tmp_path: Path) -> None:
    path = changed(tls, tmp_path / "a.las", 1000.0)
    said = inspected(path)
    (doubt,) = said["doubts"]
    assert doubt.startswith("a.las: looks like millimetres: in millimetres the tunnel is 8.0 m wide")
    (advised,) = said["commands"]
    assert advised == f"tunneldb inspect {path} --unit mm"
    again = inspected(*shlex.split(advised)[2:])
    assert again["files"][0]["unit"] is None
    assert again["commands"][1].endswith(" --unit mm")


def test_tables_beside_a_scan_are_compared_with_its_points(tls: Path, tmp_path: Path) -> None:
    scan = tmp_path / "scan.laz"
    scan.symlink_to(tls)
    stations = np.loadtxt(tls.with_name("bend.stations.csv"), delimiter=",", skiprows=1)
    axis = np.loadtxt(tls.with_name("bend.axis.csv"), delimiter=",", skiprows=1)
    for shift, stretch in ((0.0, 1.0), (3000.0, 3.2808)):
        np.savetxt(tmp_path / "scan.axis.csv", axis + shift, "%.4f", ",", header="x,y,z", comments="")
        origin = stations[:1, 1:]
        places = np.column_stack([stations[:, 0], origin + (stations[:, 1:] - origin) * stretch + shift / 100.0])
        np.savetxt(tmp_path / "scan.stations.csv", places, "%.4f", ",", header="scan_id,x,y,z", comments="")
        doubts = "\n".join(inspected(scan)["doubts"])
        assert ("the axis is not near the points" in doubts) == bool(shift)
        assert ("scan.laz: scans were measured from other places" in doubts or "stations lie" in doubts) == bool(shift)


def test_a_ptx_brings_its_stations(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    lines = []
    for number in range(2):
        angle, along = rng.uniform(-np.pi, np.pi, 4000), rng.uniform(-10.0, 10.0, 4000)
        lines += ["40", "100", f"{10 * number} 0 0", "1 0 0", "0 1 0", "0 0 1"]
        lines += ["1 0 0 0", "0 1 0 0", "0 0 1 0", f"{500_010 + 10 * number} 4000000 300 1"]
        lines += [f"{x:.4f} {3 * np.sin(a):.4f} {3 * np.cos(a):.4f} {0.5:.3f}" for x, a in zip(along, angle, strict=True)]
    path = tmp_path / "site.ptx"
    path.write_text("\n".join(lines))
    said = inspected(path)
    assert [scan["position"] for scan in said["files"][0]["poses"]] == [[500_010.0, 4e6, 300.0], [500_020.0, 4e6, 300.0]]
    assert f"--stations {path} --intensity-kind none" in said["commands"][2]  # an intensity that is the same everywhere is none


def test_lengths_that_are_said_to_be_degrees_are_not_believed(tls: Path, tmp_path: Path) -> None:
    """A tunnel can't be added in degrees, nor a file loaded that says it is in them: that it says so counts for nothing."""
    path = changed(tls, tmp_path / "a.las", crs=4326)
    said = inspected(path)
    assert said["files"][0]["srid"] is None
    assert "--srid SRID" in said["commands"][1]
    assert any("EPSG:4326 (WGS 84) is in degrees, but x = " in doubt for doubt in said["doubts"])
    header = read_header(path)
    check_header(header, None, 25830, needs_time=False)
    assert "cannot be read (EPSG:4326 (WGS 84) is in degrees" in str(crs_note(header, 25830))


def test_what_is_in_feet_is_inspected_in_metres_next(tls: Path, tmp_path: Path) -> None:
    """The advice is followed, and its next commands have the metric code of the projection and the unit."""
    said = inspected(changed(tls, tmp_path / "a.las", 3937.0 / 1200.0, crs=2263))
    assert said["commands"] == [f"tunneldb inspect {tmp_path}/a.las --unit us-ft"]
    (look,) = (converted := inspected(*shlex.split(said["commands"][0])[2:]))["files"]
    assert (look["srid"], look["width"]) == (32118, pytest.approx(8.0, abs=0.3))
    assert "--srid 32118 --axis auto" in converted["commands"][1]
    assert converted["commands"][3].endswith("a.las --unit us-ft")


def test_degrees_are_to_be_transformed_first(tls: Path, tmp_path: Path) -> None:
    said = inspected(changed(tls, tmp_path / "a.las", 1e-5, crs=4326))
    assert said["commands"] == [f"tunneldb inspect {tmp_path}/TRANSFORMED-a.las"]
    assert any("projected coordinate system in metres" in line for line in said["missing"])


@pytest.mark.parametrize(
    ("size", "says"),
    [((200.0, 60.0, 1.5), "open country or a street"), ((3.0, 4.0, 3.5), "a room or a single place")],
)
def test_what_is_no_tunnel_is_doubted_first(tmp_path: Path, size: tuple[float, float, float], says: str) -> None:
    """And no axis is sought in it: that would be refused."""
    rng = np.random.default_rng(2)
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [0.001] * 3, [0, 0, 0]
    las = laspy.LasData(header)
    count = 40_000
    xyz = rng.uniform([0, 0, 0], size, (count, 3))
    if size[2] > 2.0:  # on the walls
        side = rng.integers(0, 2, count)
        xyz[np.arange(count), side] = rng.integers(0, 2, count) * np.array(size)[side]
    las.x, las.y, las.z = xyz.T
    las.write(tmp_path / "a.las")
    said = inspected(tmp_path / "a.las")
    assert says in said["doubts"][0]
    assert "--axis AXIS.csv" in said["commands"][1]
    assert said["commands"][2].endswith("--no-poses --intensity-kind none")  # without intensity nobody needs to know
    text = CliRunner().invoke(main, ["inspect", str(tmp_path / "a.las")]).stdout
    assert text.index("Doubtful:") < text.index("Missing:") < text.index("Next:")


def test_files_are_concluded_from_together(tls: Path, tmp_path: Path) -> None:
    for name in ("km-1.laz", "km-2.laz"):
        os.link(tls, tmp_path / name)
    (tmp_path / "km-3.laz").write_bytes(b"LASF")
    other = changed(tls, tmp_path / "other.las", crs=25830)
    said = inspected(*tmp_path.glob("km-*.laz"), code=1)
    assert len(said["files"]) == 2
    assert "km-3.laz" in said["unreadable"][0]
    assert "tunnel add km " in said["commands"][1]
    both = inspected(tmp_path / "km-1.laz", other)
    assert any("different coordinate systems" in doubt for doubt in both["doubts"])
    assert "--intensity intensity " in both["commands"][2]  # which is what they have in common
    assert inspected(tmp_path / "km-3.laz", code=2)["ok"] is False


def test_a_scan_with_few_points_is_doubted(tls: Path, tmp_path: Path) -> None:
    las, whole = laspy.read(tls), inspected(tls)
    las[np.random.default_rng(1).random(len(las.points)) < 60.0 / whole["files"][0]["density"][1]].write(tmp_path / "few.laz")
    few = inspected(tmp_path / "few.laz")
    assert few["files"][0]["density"][1] == pytest.approx(60.0, rel=0.2)
    (doubt,) = (line for line in few["doubts"] if "points per m²" in line)
    assert "most leaks of 0.3 m² and 3 dB are not found" in doubt
    assert not any("points per m²" in line for line in whole["doubts"])
