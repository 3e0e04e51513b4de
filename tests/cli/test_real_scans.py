"""Scans of real places from `inspect` to the report, by no other commands and options than it names; skipped without them."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from click.testing import CliRunner
from support.real_scans import real_scan

from tunneldb.cli.main import main
from tunneldb.pointcloud.reader import read_chunks

UNPOSED = "--no-poses in place of --stations, with intensity of kind reflectance or none"
"""What `inspect` says of scans of which nobody knows where the scanner stood."""


def run(*arguments: str) -> str:
    result = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def inspect(path: Path) -> dict[str, Any]:
    found = json.loads(CliRunner().invoke(main, ["inspect", str(path), "--json"]).stdout)
    assert found["ok"]
    return found


def test_a_room_with_a_pump_is_doubted_and_surveyed(dsn: str, tmp_path: Path) -> None:
    """A room of 3.8 m by 4.3 m, whose axis is drawn by hand through its middle."""
    found = inspect(real_scan("pump.e57"))
    assert any("is it a tunnel?" in doubt for doubt in found["doubts"])
    assert any(UNPOSED in doubt for doubt in found["doubts"])
    assert any("tunneldb members" in doubt and "linear -o pump-members.gpkg" in doubt for doubt in found["doubts"])
    axis = tmp_path / "axis.csv"
    axis.write_text("x,y,z\n-0.6,-5.2,-0.5\n-0.6,-0.9,-0.5\n")
    for command in found["commands"]:
        words = command.replace("SRID", "25832", 1).replace("AXIS.csv", str(axis)).replace("YYYY-MM-DD", "2017-09-25")
        before, stations, _ = words.partition("--stations")
        run(*shlex.split(f"{before} --no-poses --intensity-kind none" if stations else words)[1:])
    run("report", "pump-scan", "-o", str(tmp_path / "report.html"))
    text = (tmp_path / "report.html").read_text("utf-8")
    assert "Leaks were not searched for: the survey has no intensity" in text
    # Each point of the scan has a colour.
    run("image", "pump-scan", "-o", str(tmp_path / "images"))
    (tiff,) = (tmp_path / "images").glob("*-rgb.tif")
    with rasterio.open(tiff) as image:
        bands = image.read()
    with rasterio.open(next((tmp_path / "images").glob("*-offset.tif"))) as image:
        np.testing.assert_array_equal(bands[3] > 0, np.isfinite(image.read(1)))
    colours = np.concatenate([chunk.colour for chunk in read_chunks(real_scan("pump.e57"), None, colours=True)]) / 257.0
    pixels = bands[:3, bands[3] > 0].T
    np.testing.assert_allclose(pixels.mean(axis=0), colours.mean(axis=0), atol=12.0)
    np.testing.assert_allclose(np.percentile(pixels, 90, axis=0), np.percentile(colours, 90, axis=0), atol=25.0)


def test_the_pump_itself_has_faces_and_no_spot(tmp_path: Path) -> None:
    """Its scan has no pose: without a station it is refused, with one at the origin of its coordinates it is searched."""
    scan, stations = str(real_scan("pump.e57")), tmp_path / "stations.csv"
    options = ["--intensity", "intensity", "--intensity-kind", "linear", "-o", str(tmp_path / "pump.gpkg")]
    refused = CliRunner().invoke(main, ["members", scan, *options])
    assert refused.exit_code == 2
    assert "scan 1 (pumpA) has no pose" in refused.stderr
    stations.write_text("scan_id,x,y,z\n1506376252,0,0,0\n")
    said = run("members", scan, "--stations", str(stations), *options)
    assert "0 spots" in said
    assert int(said.split(" members of ")[1].split(" ")[0]) > 100


@pytest.mark.parametrize("separator", [",", "\t"])
def test_rings_of_single_points_are_refused_at_once(separator: str, tmp_path: Path) -> None:
    """Eight points a ring, measured by total station, are no scan: none has others near it."""
    path = tmp_path / "points.csv"
    path.write_text(real_scan("wriggle/points.csv").read_text().replace(",", separator))
    found = inspect(path)
    assert found["commands"] == []
    assert found["files"][0]["only_noise"] is True
    assert any("all points would be left out as noise" in doubt for doubt in found["doubts"])


def test_rocks_of_unknown_stations_are_no_structure(tmp_path: Path) -> None:
    scan, found = str(real_scan("lone-star.laz")), tmp_path / "found.gpkg"
    words = ["members", scan, "--intensity", "intensity", "--intensity-kind", "linear", "-o", str(found)]
    refused = CliRunner().invoke(main, words)
    assert refused.exit_code == 2
    assert "the scanner position is not in the file" in refused.stderr
    assert not found.exists()
    stations = tmp_path / "stations.csv"
    stations.write_text("scan_id,x,y,z\n0,515385,4918325,2330\n")
    assert "0 members of 0 faces" in run(*words, "--stations", str(stations))
