"""A site: a structure without an axis, its files recorded, and what needs an axis refused in one line."""

from __future__ import annotations

from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
from support.command import command

POINTS = 5000


@pytest.fixture
def plate(tmp_path: Path) -> Path:
    """A wall seen from one station, with amplitudes about 20 dB."""
    rng = np.random.default_rng(1)
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales, header.offsets = np.full(3, 1e-4), np.zeros(3)
    header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", np.float32))
    las = laspy.LasData(header)
    las.xyz = np.column_stack([rng.uniform(-1, 1, POINTS), np.full(POINTS, 5.0), rng.uniform(0, 2, POINTS)])
    las["Amplitude"] = rng.normal(20.0, 0.3, POINTS).astype(np.float32)
    las.point_source_id = np.full(POINTS, 7, np.uint16)
    las.write(tmp_path / "plate.laz")
    (tmp_path / "stations.csv").write_text("scan_id,x,y,z\n7,0,0,1.5\n")
    return tmp_path


def add(folder: Path, *kind: object) -> None:
    command("tunnel", "add", "hall", "--srid", 25829, "--site")
    kind = kind or ("--intensity", "Amplitude", "--intensity-kind", "amplitude", "--reference", "auto")
    command("survey", "add", "hall-1", "--tunnel", "hall", "--date", "2024-05-04", "--stations", folder / "stations.csv", *kind)


def test_files_of_a_site_are_recorded(plate: Path, conn: psycopg.Connection) -> None:
    add(plate)
    said = command("load", "hall-1", plate / "plate.laz").output
    assert "the points stay in the files: tunneldb members hall-1" in said
    assert "kept" not in said
    row = conn.execute("SELECT points, kept, chainage_from, extent, unposed FROM tunnel_api.file").fetchone()
    assert row is not None
    points, kept, chainage, extent, unposed = row
    assert (points, kept, chainage, unposed) == (POINTS, 0, None, 0)
    np.testing.assert_allclose(extent, [-1, 5, 0, 1, 5, 2], atol=0.01)
    assert conn.execute("SELECT site, geom FROM tunnel_api.tunnel").fetchone() == (True, None)
    conn.rollback()
    assert "unchanged" in command("load", "hall-1", plate / "plate.laz").output
    for verb in ("status", "tunnel list", "survey list"):
        assert "hall" in command(*verb.split()).output
    command("status", "hall-1")
    assert "has no file other.laz" in command("survey", "remove-file", "hall-1", "other.laz", code=2).output
    command("survey", "remove-file", "hall-1", "plate.laz")
    assert conn.execute("SELECT count(*) FROM tunnel_api.file").fetchone() == (0,)


@pytest.mark.parametrize(
    "verb",
    [
        "run hall-1",
        "leaks hall-1",
        "axis hall-1",
        "image hall-1 -o out",
        "batch hall-1 plate.laz",
        "spheres hall-1 --radius 0.1",
    ],
)
def test_what_needs_an_axis_says_so(plate: Path, conn: psycopg.Connection, verb: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(plate)
    add(plate)
    assert "which has no axis" in command(*verb.split(), code=2).output


def test_what_a_site_cannot_be(plate: Path, conn: psycopg.Connection) -> None:
    assert "--site" in command("tunnel", "add", "hall", "--srid", 25829, code=2).output
    assert "no axis" in command("tunnel", "add", "hall", "--srid", 25829, "--site", "--start-chainage", 5, code=2).output
    add(plate, "--intensity", "Amplitude", "--intensity-kind", "linear")
    (plate / "other.csv").write_text("scan_id,x,y,z\n8,0,0,1.5\n")
    command("survey", "set", "hall-1", "--stations", plate / "other.csv")
    assert "no station for scan_id 7" in command("load", "hall-1", plate / "plate.laz", code=2).output
    assert conn.execute("SELECT count(*) FROM tunnel_api.file").fetchone() == (0,)
