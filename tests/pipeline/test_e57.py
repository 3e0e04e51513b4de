"""The same points from LAZ, from E57 and from PTX, with poses for stations, end in the same leaks."""

from __future__ import annotations

from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
import shapely
from scipy.spatial.transform import Rotation
from support.command import command

from tunneldb.simulate import Parameters, Simulation, write

pytest.importorskip("pye57")
from support import e57_files as e57

START = 12_992.0  # the kilometre changes in the middle


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tunnel scanned from two stations: one LAZ file, two E57 files of a scan each, and a PTX file of both scans."""
    path = tmp_path_factory.mktemp("e57")
    write(
        Simulation(
            Parameters(
                name="t", start_chainage=START, length=16.0, scanner="static", station_spacing=8.0, angular_step=0.4,
                leaks=6, leak_area=(0.2, 1.5), seed=1,
            )
        ),
        path,
    )  # fmt: skip
    (cloud,) = path.glob("*.laz")
    las = laspy.read(cloud)
    scans = np.asarray(las.point_source_id)
    for number, *place in np.loadtxt(path / "t.stations.csv", delimiter=",", skiprows=1):
        of_scan = scans == number
        turn = Rotation.from_euler("xyz", [0.1 * number, -0.2, 2.0 * number])
        xyz = turn.inv().apply(las.xyz[of_scan] - place)
        # As scanners write it: where there was no echo, a record that is marked.
        keep = np.random.default_rng(0).random(len(xyz)) < 0.9
        order = np.argsort(np.concatenate([np.arange(len(xyz)), np.flatnonzero(~keep) + 0.5]))
        empty = np.zeros((~keep).sum())
        fields = {
            name: np.concatenate([np.asarray(values, np.float64), empty])[order]
            for name, values in (
                ("cartesianX", xyz[:, 0]),
                ("cartesianY", xyz[:, 1]),
                ("cartesianZ", xyz[:, 2]),
                ("intensity", las.Amplitude[of_scan]),
                ("timeStamp", las.gps_time[of_scan]),
            )
        }
        fields["cartesianInvalidState"] = np.concatenate([np.zeros(len(xyz), int), empty.astype(int) + 2])[order]
        scan = e57.Scan(fields, place, turn.as_quat(scalar_first=True), f"{{{number}}}", start=0.0)
        e57.write(path / f"t-{number:.0f}.e57", [scan])
        with (path / "t.ptx").open("a") as file:
            matrix = np.vstack([turn.inv().as_matrix(), place])  # of points as rows
            file.write(f"{len(xyz)}\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n")
            np.savetxt(file, np.column_stack([matrix, [0, 0, 0, 1]]), "%.12f")
            np.savetxt(file, np.column_stack([xyz, las.Amplitude[of_scan]]), "%.6f")
    return path


def process(folder: Path, survey: str, stations: list[Path], dimension: str, files: list[Path]) -> None:
    command(
        "survey", "add", survey, "--tunnel", "t", "--date", "2024-05-04", *(a for p in stations for a in ("--stations", p)),
        "--reference", folder / "t.reference.csv", "--intensity-kind", "amplitude", "--intensity", dimension,
    )  # fmt: skip
    command("load", survey, *files)
    command("run", survey, "--set", "image.pixel=0.04")


def leaks(conn: psycopg.Connection, survey: str) -> list[tuple[shapely.Geometry, float]]:
    rows = conn.execute(
        "SELECT ST_AsBinary(l.unrolled), l.darkening_mean FROM tunnel.finding l JOIN tunnel.survey s ON s.id = l.survey_id "
        "WHERE s.name = %s AND l.detected ORDER BY l.chainage_from, l.arc_from",
        (survey,),
    ).fetchall()
    conn.rollback()
    return [(shapely.from_wkb(bytes(wkb)), drop) for wkb, drop in rows]


def test_same_leaks_as_from_laz(folder: Path, conn: psycopg.Connection) -> None:
    command("tunnel", "add", "t", "--srid", 25830, "--axis", folder / "t.axis.csv", "--start-chainage", START)
    process(folder, "las", [folder / "t.stations.csv"], "Amplitude", sorted(folder.glob("*.laz")))
    scans = sorted(folder.glob("*.e57"))
    process(folder, "e57", scans, "intensity", scans)
    process(folder, "ptx", [folder / "t.ptx"], "intensity", [folder / "t.ptx"])

    counts = conn.execute(
        "SELECT s.name, sum(f.points), sum(f.outside) FROM tunnel.scan_file f JOIN tunnel.survey s ON s.id = f.survey_id "
        "GROUP BY 1"
    ).fetchall()
    assert dict.fromkeys(("e57", "las", "ptx"), counts[0][1:]) == {name: (*rest,) for name, *rest in counts}

    expected = leaks(conn, "las")
    assert len(expected) >= 4
    for found in (leaks(conn, "e57"), leaks(conn, "ptx")):
        assert len(found) == len(expected)
        for (polygon, drop), (true, true_drop) in zip(found, expected, strict=True):
            assert polygon.intersection(true).area / polygon.union(true).area > 0.99
            assert drop == pytest.approx(true_drop, abs=0.02)


def test_scans_that_are_no_stations_are_told(folder: Path, conn: psycopg.Connection) -> None:
    command("tunnel", "add", "t", "--srid", 25830, "--axis", folder / "t.axis.csv", "--start-chainage", START)
    command(
        "survey", "add", "half", "--tunnel", "t", "--date", "2024-05-04", "--stations", folder / "t-1.e57",
        "--intensity-kind", "none",
    )  # fmt: skip
    result = command("load", "half", folder / "t-1.e57", folder / "t-2.e57", code=2)
    assert "t-2.e57: no station for scan_id" in result.stderr
    assert "--stations FILE.e57" in result.stderr
    assert conn.execute("SELECT count(*) FROM tunnel.scan_file").fetchone() == (0,)
