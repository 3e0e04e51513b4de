"""A merged cloud of which nobody knows where the scanner was: leaks are found as far as can be, and every result says so."""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
import shapely
from support.command import command

from tunneldb.simulate import Parameters, Simulation, write

pytestmark = pytest.mark.slow

SAID = "scanner positions are unknown"


@pytest.fixture
def cloud(tmp_path: Path) -> Path:
    """A profiler's scan of a round tunnel, without times and numbers of scans, and its truth."""
    write(
        Simulation(
            Parameters(
                name="t", length=20.0, scanner="profiler", profile_spacing=0.025, profile_points=1000, leaks=4,
                leak_area=(0.3, 1.0), seed=4,
            )
        ),
        tmp_path,
    )  # fmt: skip
    las = laspy.read(tmp_path / "t.laz")
    header = laspy.LasHeader(point_format=0, version="1.4")
    header.scales, header.offsets = las.header.scales, las.header.offsets
    header.add_extra_dim(laspy.ExtraBytesParams("Reflectance", "float32"))
    merged = laspy.LasData(header)
    order = np.random.default_rng(0).permutation(len(las))
    merged.x, merged.y, merged.z = las.xyz[order].T
    merged.Reflectance = las.Reflectance[order]
    merged.write(tmp_path / "merged.laz")
    return tmp_path


def test_leaks_of_a_merged_cloud(cloud: Path, conn: psycopg.Connection) -> None:
    command("tunnel", "add", "t", "--srid", 25830, "--axis", cloud / "t.axis.csv")
    add = ("survey", "add", "s", "--tunnel", "t", "--date", "2024-05-04", "--intensity", "Reflectance", "--intensity-kind")
    refused = command(*add, "amplitude", "--no-poses", code=2)
    assert "--no-poses needs --intensity-kind reflectance" in refused.stderr
    assert "exactly one of" in command(*add, "reflectance", code=2).stderr
    assert "exactly one of" in command(*add, "reflectance", "--no-poses", "--stations", cloud / "t.laz", code=2).stderr
    assert SAID in command(*add, "reflectance", "--no-poses").stderr
    assert conn.execute("SELECT platform FROM tunnel_api.survey").fetchone() == ("unknown",)
    conn.rollback()
    command("load", "s", cloud / "merged.laz")
    command("run", "s")

    table = command("leaks", "s")
    assert SAID in table.stderr
    said = json.loads(command("leaks", "s", "--json").stdout)
    assert said["note"].startswith(SAID)
    found = shapely.union_all([shapely.geometry.shape(leak["geometry"]) for leak in said["leaks"]])
    truth = json.loads((cloud / "t.truth.geojson").read_text())["features"]
    shapes = [shapely.geometry.shape(feature["geometry"]) for feature in truth]
    assert sum(found.intersection(shape).area > 0.5 * shape.area for shape in shapes) >= len(shapes) - 1
    (note,) = conn.execute("SELECT counts ->> 'note' FROM tunnel.run WHERE stage = 'detect' AND outcome = 'done'").fetchone()
    conn.rollback()
    assert SAID in note
    command("report", "s", "-o", cloud / "report.html")
    assert SAID[1:] in (cloud / "report.html").read_text("utf-8")
    assert "no scanner positions" in command("intensity", "s", code=2).stderr


def test_what_falls_with_range_is_not_set_either(cloud: Path, conn: psycopg.Connection) -> None:
    command("tunnel", "add", "t", "--srid", 25830, "--axis", cloud / "t.axis.csv")
    command("survey", "add", "s", "--tunnel", "t", "--date", "2024-05-04", "--no-poses", "--intensity-kind", "none")
    refused = command("survey", "set", "s", "--intensity-kind", "linear", "--intensity", "intensity", code=2)
    assert "cannot be corrected without scanner positions" in refused.stderr
    command("survey", "set", "s", "--trajectory", cloud / "t.trajectory.csv")
    assert conn.execute("SELECT platform FROM tunnel.survey").fetchone() == ("mobile",)
