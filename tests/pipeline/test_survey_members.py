"""Members and spots of a survey in the database: found again, numbered over surveys, reviewed, replaced."""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
import shapely
from support.command import command
from support.structure_scene import Pipe, Plate, Seen, scan

STATION = (0.0, 0.0, 1.5)
WALL = Plate((-1.5, 5.0, 0.0), (3.0, 0.0, 0.0), (0.0, 0.0, 3.0))
PIPE = Pipe((-1.4, 4.0, 0.4), (1.4, 4.0, 0.4), 0.15)
RUST = (-0.6, 1.5, 0.25)  # x, z and radius of a dark disc on the wall
WALL_COLOUR, RUST_COLOUR = (150, 152, 160), (120, 60, 30)
FLAKE = (0.7, 2.0, 0.2)  # of a bright one
WINDOW = (-0.4, 0.4, -0.35, 0.35)


def disc(seen: Seen, x: float, z: float, radius: float) -> np.ndarray:
    return (seen.surface == 0) & (np.hypot(seen.xyz[:, 0] - x, seen.xyz[:, 2] - z) < radius)


def write(path: Path, seed: int, flake: bool = True) -> None:
    """Scan the wall with its spots and the pipe before it: Lambert's law, noise of 0.3 dB."""
    seen = scan([WALL, PIPE], [STATION], step=0.0015, seed=seed, window=WINDOW)
    level = 20.0 + 10.0 * np.log10(seen.cosine) + np.random.default_rng(seed).normal(0.0, 0.3, len(seen.xyz))
    level[disc(seen, *RUST)] -= 4.0
    if flake:
        level[disc(seen, *FLAKE)] += 3.0
    header = laspy.LasHeader(version="1.4", point_format=7)
    header.scales = np.full(3, 1e-4)
    header.add_extra_dim(laspy.ExtraBytesParams("Reflectance", np.float32))
    las = laspy.LasData(header)
    las.xyz = seen.xyz
    las["Reflectance"] = level.astype(np.float32)
    # By colour the rust is brown, what is not the wall blue; the flake, and half of the rust, have no colour, so are black.
    colour = np.where((seen.surface == 0)[:, None], WALL_COLOUR, (0, 0, 250))
    colour[disc(seen, *RUST)] = RUST_COLOUR
    colour[disc(seen, *FLAKE) | (disc(seen, *RUST) & (seen.xyz[:, 0] > RUST[0]))] = 0
    las.red, las.green, las.blue = (colour * 257).T.astype(np.uint16)
    las.point_source_id = np.ones(len(seen.xyz), np.uint16)
    las.write(path)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("hall")
    write(folder / "first.laz", 1)
    write(folder / "second.laz", 2)
    write(folder / "mended.laz", 3, flake=False)
    (folder / "stations.csv").write_text(f"scan_id,x,y,z\n1,{','.join(map(str, STATION))}\n")
    return folder


def add(folder: Path, survey: str, date: str, file: str) -> None:
    command(
        "survey", "add", survey, "--tunnel", "hall", "--date", date, "--stations", folder / "stations.csv",
        "--intensity", "Reflectance", "--intensity-kind", "reflectance",
    )  # fmt: skip
    command("load", survey, folder / file)


def spots(conn: psycopg.Connection, survey: str) -> dict[str, tuple[int, int, float]]:
    """Id, number and area of the spots of a survey, by kind; there is one of each."""
    rows = conn.execute(
        "SELECT kind, id, number, area FROM tunnel_api.spot WHERE survey = %s AND detected", [survey]
    ).fetchall()
    conn.rollback()
    assert len({row[0] for row in rows}) == len(rows)
    return {row[0]: row[1:] for row in rows}


def test_spots_of_a_site(files: Path, conn: psycopg.Connection, tmp_path: Path) -> None:
    command("tunnel", "add", "hall", "--srid", 25829, "--site")
    add(files, "hall-1", "2024-05-04", "first.laz")
    assert "have not been searched for" in command("spots", "hall-1", code=1).output
    command("members", "hall-1")
    found = spots(conn, "hall-1")
    assert set(found) == {"dark", "bright"}
    for kind, (x, z, radius) in (("dark", RUST), ("bright", FLAKE)):
        row = conn.execute(
            "SELECT public.ST_AsBinary(surface), area, member_kind, label FROM tunnel_api.spot WHERE kind = %s", [kind]
        ).fetchone()
        assert row is not None
        middle = shapely.get_coordinates(shapely.from_wkb(bytes(row[0])), include_z=True).mean(axis=0)
        np.testing.assert_allclose(middle, [x, 5.0, z], atol=0.03)
        assert row[1] == pytest.approx(np.pi * radius**2, rel=0.1)
        assert row[2:] == ("flat", None)
    colours = dict(conn.execute("SELECT kind, rgb FROM tunnel_api.spot_map").fetchall())
    # On the outline's pixels a few points of the wall are among those of the rust.
    np.testing.assert_allclose(colours["dark"], RUST_COLOUR, atol=6)
    assert colours["bright"] is None or np.abs(np.subtract(colours["bright"], WALL_COLOUR)).max() <= 1
    radius, seen = conn.execute(
        "SELECT f.radius, m.seen_share FROM tunnel_api.face f JOIN tunnel_api.member_statistics m"
        " ON m.survey_id = f.survey_id AND m.number = f.member WHERE f.kind = 'pipe'"
    ).fetchone()  # type: ignore[misc]
    assert radius == pytest.approx(PIPE.radius, abs=0.002)
    assert 0.0 < seen <= 1.0
    conn.rollback()

    # Found again, by the same file: the same rows, and what an inspector said of them.
    conn.execute("UPDATE tunnel_api.spot_3d SET review = 'confirmed', remark = 'rust' WHERE kind = 'dark'")
    conn.commit()
    with pytest.raises(psycopg.errors.FeatureNotSupported, match="only the review and the remark"):
        conn.execute("UPDATE tunnel_api.spot SET area = 1")
    conn.rollback()
    command("members", "hall-1")
    assert spots(conn, "hall-1") == found
    assert conn.execute("SELECT review, remark FROM tunnel_api.spot WHERE kind = 'dark'").fetchone() == ("confirmed", "rust")
    assert conn.execute("SELECT view, action, after ->> 'review' FROM tunnel_api.audit").fetchall() == [
        ("spot", "update", "confirmed")
    ]
    conn.rollback()

    # The next survey sees the same spots, under the same numbers; one that is gone leaves its number to nobody.
    add(files, "hall-2", "2025-05-04", "second.laz")
    command("members", "hall-2")
    again = spots(conn, "hall-2")
    assert {kind: row[1] for kind, row in again.items()} == {kind: row[1] for kind, row in found.items()}
    command("survey", "add", "hall-3", "--tunnel", "hall", "--date", "2026-05-04", "--stations", files / "stations.csv",
            "--intensity", "Reflectance", "--intensity-kind", "reflectance")  # fmt: skip
    command("load", "hall-3", files / "mended.laz")
    command("members", "hall-3")
    assert {kind: row[1] for kind, row in spots(conn, "hall-3").items()} == {"dark": found["dark"][1]}

    # What leaves the database is what is in it.
    for suffix in ("csv", "geojson", "gpkg"):
        command("spots", "hall-1", "-o", tmp_path / f"spots.{suffix}", "--geometry", "3d")
    told = json.loads(command("spots", "hall-1", "--json").output)
    assert told["count"] == 2
    assert told["area"] == pytest.approx(sum(row[2] for row in found.values()))
    assert "rust" in (tmp_path / "spots.csv").read_text()
    features = json.loads((tmp_path / "spots.geojson").read_text())["features"]
    assert {f["properties"]["number"] for f in features} == {row[1] for row in found.values()}
    written = {f["properties"]["kind"]: f["properties"]["rgb"] for f in features}
    assert written["dark"] == ", ".join(map(str, colours["dark"]))
    assert {spot["kind"]: spot["rgb"] for spot in told["spots"]} == colours

    # A reviewed spot that is not found again stays; files that changed make the list out of date.
    (tmp_path / "first.laz").write_bytes((files / "mended.laz").read_bytes())
    conn.execute("UPDATE tunnel_api.spot SET review = 'confirmed' WHERE survey = 'hall-1' AND kind = 'bright'")
    conn.commit()
    command("load", "hall-1", tmp_path / "first.laz")
    assert "have changed since" in command("spots", "hall-1", code=1).output
    command("members", "hall-1")
    assert set(spots(conn, "hall-1")) == {"dark"}
    assert "not found again" in command("spots", "hall-1").output


def test_members_of_what_has_no_intensity(files: Path, conn: psycopg.Connection) -> None:
    command("tunnel", "add", "hall", "--srid", 25829, "--site")
    command(
        "survey", "add", "hall-1", "--tunnel", "hall", "--date", "2024-05-04", "--stations", files / "stations.csv",
        "--intensity-kind", "none",
    )  # fmt: skip
    assert "no intensity" in command("members", "hall-1", code=2).output
    assert "have its own" not in command("members", "hall-1", "--intensity", "Amplitude", code=2).output
