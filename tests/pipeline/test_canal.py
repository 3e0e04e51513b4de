"""From a laser's and a sonar's files to closed sections, rasters, QGIS and report, against the simulator's truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg
import pytest
import rasterio
from support.command import command

from tunneldb.database import connect
from tunneldb.export.qgis import write_project
from tunneldb.simulate.canal import CanalParameters, CanalScene, simulate, write
from tunneldb.store.survey import get_survey

NAME = "canal"
LEVEL, DEPTH = 265.0, 2.5
pytestmark = pytest.mark.xdist_group("canal")


@pytest.fixture(scope="module")
def scene() -> CanalScene:
    coarse = CanalParameters(seed=21, length=30.0, laser_step=0.5, sonar_stations=2, sonar_step=1.0, sub_rays=7, batter=1.0)
    return simulate(coarse)


@pytest.fixture(scope="module")
def folder(scene: CanalScene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp(NAME)
    write(scene, made)
    return made


def sections(conn: psycopg.Connection) -> list[tuple[float, list[float]]]:
    rows = conn.execute("SELECT chainage, radius FROM tunnel.section ORDER BY chainage").fetchall()
    conn.rollback()
    return rows


def stale(conn: psycopg.Connection) -> dict[str, str]:
    rows = conn.execute("SELECT stage, reason FROM tunnel_api.stage_status WHERE stale").fetchall()
    conn.rollback()
    return dict(rows)


def test_a_canal_from_its_files_to_its_report(
    scene: CanalScene, folder: Path, conn: psycopg.Connection, tmp_path: Path
) -> None:
    sonar = [folder / f"canal.sonar-{k}.xyz" for k in (1, 2)]
    command("tunnel", "add", NAME, "--srid", 25832, "--axis", folder / "canal.axis.csv")
    stations = ["--stations", folder / "canal.stations.csv", "--intensity-kind", "none"]
    command("survey", "add", NAME, "--tunnel", NAME, "--date", "2026-05-04", *stations)
    command("load", NAME, folder / "canal.laz", "--density", 200)
    command("run", NAME)
    before = sections(conn)
    ladders = ["--ladders", folder / "canal.ladders.csv", "--up", "+z", "--water-level", LEVEL]
    command("register", NAME, *sonar, *ladders)
    assert not stale(conn)  # of poses alone nothing follows
    command("load", NAME, *sonar)
    assert stale(conn)["sections"] == "sonar scans loaded or registered since"
    assert "axis" not in stale(conn)
    command("run", NAME)
    assert not stale(conn)
    check_sections(scene, conn)
    check_bed(scene, conn, tmp_path)
    check_project(conn, tmp_path)
    command("report", NAME, "-o", tmp_path / "canal.html")
    page = (tmp_path / "canal.html").read_text("utf-8")
    assert '<section id="underwater">' in page
    assert "canal.sonar-2.xyz" in page
    assert page.count('aria-label="Closed section at') == len(closed(conn))
    command("register", NAME, *sonar, *ladders)
    assert stale(conn)["sections"] == "sonar scans loaded or registered since"
    command("run", NAME)
    assert not closed(conn)
    assert sections(conn) == before  # to the last digit


def closed(conn: psycopg.Connection) -> list[tuple[float, float, float, float]]:
    rows = conn.execute("SELECT chainage, unseen, wet_area, depth FROM tunnel_api.closed_section ORDER BY chainage").fetchall()
    conn.rollback()
    return rows


def check_sections(scene: CanalScene, conn: psycopg.Connection) -> None:
    """Areas of water are the truth's; sections lie on the surfaces above the water and below it."""
    across = np.arange(-3.25, 3.26, 0.05)
    known = [row for row in closed(conn) if row[2] is not None]
    assert len(known) >= 3
    for chainage, _, area, _ in known:
        bed = LEVEL - scene.bed_height(np.full(len(across), chainage), across)
        assert area == pytest.approx(bed.mean() * 6.6, rel=0.03)
    nodes = np.array(
        conn.execute(
            "SELECT ST_X(p.geom), ST_Y(p.geom), ST_Z(p.geom) FROM tunnel.section c"
            " CROSS JOIN LATERAL ST_DumpPoints(c.geom) p WHERE c.chainage BETWEEN 9 AND 21"
        ).fetchall()
    )
    off = np.abs(scene.distance(nodes))
    for part in (nodes[:, 2] > LEVEL, nodes[:, 2] < LEVEL):
        assert np.percentile(off[part], 90) < 0.06
        assert np.median(off[part]) < 0.02
    parts = conn.execute("SELECT part, sum(length) FROM tunnel_api.section_part GROUP BY part").fetchall()
    assert {part for part, _ in parts} >= {"lining", "submerged"}
    lines = conn.execute("SELECT side, ST_ZMin(geom), ST_ZMax(geom) FROM tunnel_api.waterline").fetchall()
    conn.rollback()
    assert {side for side, _, _ in lines} == {"left", "right"}
    for _, low, high in lines:
        assert (low, high) == pytest.approx((LEVEL, LEVEL))


def check_bed(scene: CanalScene, conn: psycopg.Connection, folder: Path) -> None:
    """Cells, volume and rasters of the bed are the truth's."""
    cells = np.array(conn.execute("SELECT chainage, across, height FROM tunnel_api.bed WHERE points >= 5").fetchall())
    along = np.linspace(-0.45, 0.45, 10)
    truth = np.mean([scene.bed_height(cells[:, 0] + step, cells[:, 1]) for step in along], axis=0)
    off = cells[:, 2] - truth
    assert abs(np.median(off)) < 0.01
    assert np.percentile(np.abs(off), 90) < 0.06
    row = conn.execute("SELECT * FROM tunnel_api.bed_volume(%s, 10, 20, 262.3)", [NAME]).fetchone()
    conn.rollback()
    assert row is not None
    above, below, sigma, seen, _ = row
    assert seen > 50.0
    inside = (cells[:, 0] > 10) & (cells[:, 0] < 20)
    assert above - below == pytest.approx((truth[inside] - 262.3).sum() * 0.1, abs=2.0 + 2 * sigma)
    command("image", NAME, "-o", folder)
    with rasterio.open(folder / "canal-km000-bed.tif") as image:
        assert image.crs.to_epsg() == 25832
        assert image.descriptions == ("height", "depth", "sigma")
        rows, columns = np.nonzero(np.isfinite(image.read(1)))
        east, north = image.xy(rows, columns)
        height, depth = image.read(1)[rows, columns], image.read(2)[rows, columns]
    assert np.allclose(height + depth, LEVEL, atol=1e-3)
    own = scene.line.stationed(scene.line.to_local(np.column_stack([east, north, height])))
    expected = scene.bed_height(own[:, 0] + 15.0, -own[:, 1])
    assert np.percentile(np.abs(height - expected), 80) < 0.08
    with rasterio.open(folder / "canal-km000-submerged.tif") as image:
        offset = image.read(1)
    assert abs(np.nanmedian(offset)) < 0.01
    assert np.isfinite(offset).sum() * 0.01 > 80.0  # m² of walls and bed


def check_project(conn: psycopg.Connection, folder: Path) -> None:
    images = sorted(folder.glob("*.tif"))
    with connect(conn.info.dsn) as other:
        write_project(other, get_survey(other, NAME), folder / "canal.qgs", images)
    text = (folder / "canal.qgs").read_text("utf-8")
    layers = ("sonar_scan", "sonar_ellipse", "ladder", "waterline", "section_part")
    for layer in (*layers, "canal-km000-bed", "canal-km000-submerged"):
        assert f"tunneldb_layer_{layer}" in text
