"""The stage detect through the real commands, on simulated tunnels whose leaks are known."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psycopg
import pytest
import shapely
from click.testing import CliRunner
from support.command import command
from support.databases import Copies

from tunneldb.anomalies.evidence import standard_model
from tunneldb.anomalies.features import NAMES
from tunneldb.anomalies.learning import Adjustment
from tunneldb.cli.main import main
from tunneldb.pipeline import detect as job
from tunneldb.simulate import Parameters, Simulation, generate, write
from tunneldb.simulate.lining.leaks import Leak
from tunneldb.stages.parameters import settings
from tunneldb.store.learned import apply_learned
from tunneldb.store.survey import get_survey

NAME = "wet"
START = 12_310.0
SMALLEST = 0.1
APPENDAGE, FLOOR = (2,), (1, 5)  # the floor with its rails
SECTIONS = {1: "circular", 2: "horseshoe", 3: "box"}


def parameters(scanner: str, seed: int, **others: object) -> Parameters:
    return Parameters(
        **{
            "name": NAME,
            "section": SECTIONS[seed],
            "seed": seed,
            "start_chainage": START,
            "length": 24.0,
            "slope": 4.0,
            "scanner": scanner,
            "station_spacing": 12.0,
            "angular_step": 0.25,
            "profile_spacing": 0.025,
            "profile_points": 1000,
            "leaks": 6,
            "leak_area": (0.08, 1.5),
            "roughness": 14.0,
            **others,
        }
    )


def prepare(folder: Path, scanner: str, kind: str = "amplitude", start: float = START) -> str:
    dimension = {"amplitude": "Amplitude", "reflectance": "Reflectance", "linear": "intensity", "none": None}[kind]
    poses = ["--stations", folder / f"{NAME}.stations.csv"]
    if scanner == "profiler":
        poses = ["--trajectory", folder / f"{NAME}.trajectory.csv"]
    command("tunnel", "add", NAME, "--srid", 25830, "--axis", folder / f"{NAME}.axis.csv", "--start-chainage", start)
    command(
        "survey", "add", NAME, "--tunnel", NAME, "--date", "2024-05-04", *poses, "--intensity-kind", kind,
        *(["--intensity", dimension] if dimension else []),
        *(["--reference", folder / f"{NAME}.reference.csv"] if kind in ("amplitude", "linear") else []),
    )  # fmt: skip
    return command("load", NAME, *sorted(folder.glob("*.laz"))).output


def outlines(conn: psycopg.Connection) -> dict[int, shapely.Polygon]:
    rows = conn.execute("SELECT id, ST_AsBinary(unrolled) FROM tunnel.finding WHERE detected ORDER BY id").fetchall()
    conn.rollback()
    return {key: shapely.from_wkb(bytes(wkb)) for key, wkb in rows}


def counts(conn: psycopg.Connection) -> dict[str, object]:
    row = conn.execute("SELECT counts FROM tunnel.run WHERE stage = 'detect' ORDER BY id DESC LIMIT 1").fetchone()
    conn.rollback()
    return row[0]


def share_of(folder: Path, polygon: shapely.Polygon, wanted: tuple[int, ...]) -> float:
    """Share of the points within a polygon that are of any of some classes."""
    (path,) = folder.glob("*.truth.npz")
    truth = np.load(path)
    inside = shapely.contains_xy(polygon, truth["chainage"], truth["arc"])
    return float(np.isin(truth["class"][inside], wanted).mean())


@pytest.mark.parametrize("scanner", ["static", "profiler"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_leaks_are_found(conn: psycopg.Connection, tmp_path: Path, scanner: str, seed: int) -> None:
    """Area F1 and IoU of leaks of 0.1 m² and more, none on an appendage or the floor; Table 1; geometries."""
    simulation = Simulation(parameters(scanner, seed))
    write(simulation, tmp_path)
    prepare(tmp_path, scanner)
    command("run", NAME)
    found = outlines(conn)

    large = shapely.union_all([leak.polygon for leak in simulation.leaks if leak.area >= SMALLEST])
    small = shapely.union_all([leak.polygon for leak in simulation.leaks if leak.area < SMALLEST])
    judged = [p for p in found.values() if p.intersects(large) or not p.intersects(small)]
    detected = shapely.union_all(judged)
    common = detected.intersection(large).area
    assert 2 * common / (detected.area + large.area) >= 0.90
    assert common / detected.union(large).area >= 0.80
    for polygon in found.values():
        assert polygon.is_valid
        assert polygon.area >= 0.045
        assert share_of(tmp_path, polygon, APPENDAGE) < 0.05
        assert share_of(tmp_path, polygon, FLOOR) < 0.05

    _check_radiometry(conn, simulation, scanner)
    _check_statistics(conn, simulation)


@pytest.mark.parametrize(("scanner", "ballast"), [("profiler", 0.0), ("static", 0.02)])
def test_leaks_at_the_foot_of_the_wall_are_found(
    conn: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, scanner: str, ballast: float
) -> None:
    """Down to the ground, which is darker than they are; and no leak where there is none."""
    made = parameters(scanner, 2, length=16.0, ballast=ballast, niches=False)
    foot = Simulation(made).tunnel.section.floor_arc
    wet = [
        shapely.box(START + 4.0, -foot, START + 5.0, -foot + 0.5),
        shapely.box(START + 7.0, foot - 0.6, START + 7.8, foot),
        shapely.box(START + 11.0, -foot, START + 12.0, -foot + 0.25),
    ]
    monkeypatch.setattr(generate, "place", lambda *_: [Leak(k, leak, leak.area, 3.0) for k, leak in enumerate(wet, 1)])
    simulation = Simulation(made)
    write(simulation, tmp_path)
    prepare(tmp_path, scanner)
    command("run", NAME)
    _check_radiometry(conn, simulation, scanner)  # which the rounded sections at the foot do not spoil
    found = list(outlines(conn).values())
    assert len(found) == len(wet)
    for leak in wet:
        (same,) = (polygon for polygon in found if polygon.intersects(leak))
        assert same.intersection(leak).area / leak.area > 0.62  # the lowest is 0.25 m high
        assert same.difference(leak.buffer(0.05)).area < 0.01
        assert abs(abs(same.bounds[1] if leak.bounds[1] < 0 else same.bounds[3]) - foot) < 0.09


def _check_radiometry(conn: psycopg.Connection, simulation: Simulation, scanner: str) -> None:
    row = conn.execute(
        "SELECT sigma_raw, sigma_lambert, sigma_oren_nayar, roughness, threshold, dry_mean, dry_sigma FROM tunnel.radiometry"
    ).fetchone()
    raw, lambert, oren_nayar, roughness, threshold, mean, sigma = row
    noise = simulation.parameters.intensity_noise
    assert oren_nayar <= 1.1 * noise
    assert oren_nayar <= lambert + 0.02
    assert oren_nayar < raw
    assert threshold == pytest.approx(mean - 3 * sigma)
    report = counts(conn)
    assert report["roughness_determined"] == (roughness is not None)
    if scanner == "static":
        assert roughness is not None
    if roughness is not None:
        assert roughness == pytest.approx(simulation.parameters.roughness, abs=3.0)


def _check_statistics(conn: psycopg.Connection, simulation: Simulation) -> None:
    rows = conn.execute(
        "SELECT ST_AsBinary(unrolled), ST_AsBinary(surface), clock, area, darkening_mean, darkening_max,"
        " image_share FROM tunnel.finding"
    ).fetchall()
    conn.rollback()
    for unrolled, surface, clock, area, mean, greatest, share in rows:
        outline = shapely.from_wkb(bytes(unrolled))
        centre = outline.representative_point()
        chainage, arc = np.array([centre.x]), np.array([centre.y])
        assert area == pytest.approx(outline.area * simulation.tunnel.area_factor(chainage, arc)[0], rel=0.02)
        u, w = simulation.tunnel.section.point(arc)[0][0]
        hours = np.degrees(np.arctan2(u, w)) / 30 % 12
        # The survey finds the axis midway between crown and floor, the simulation has it in the circle.
        assert min(abs(clock - hours), 12 - abs(clock - hours)) < 0.5
        assert 0 < clock <= 12
        back = simulation.tunnel.unroll(shapely.get_coordinates(shapely.from_wkb(bytes(surface)), include_z=True))
        assert np.abs(back.offset).max() < 0.03
        west, south, east, north = outline.bounds
        assert west - 0.03 < back.chainage.min() < back.chainage.max() < east + 0.03
        assert south - 0.04 < back.arc.min() < back.arc.max() < north + 0.04
        assert 0.3 < share <= 1
        true = [leak.drop for leak in simulation.leaks if leak.polygon.intersects(outline)]
        assert mean == pytest.approx(np.mean(true), rel=0.15)
        assert greatest >= mean


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> tuple[Simulation, Path]:
    """A short tunnel with a profiler, for what doesn't need many points."""
    folder = tmp_path_factory.mktemp("short")
    simulation = Simulation(
        parameters("profiler", 2, length=12.0, profile_spacing=0.025, profile_points=1000, leaks=4, leak_area=(0.15, 1.0))
    )
    write(simulation, folder)
    return simulation, folder


@pytest.fixture(scope="module")
def prepared(copies: Copies, template: str, scan: tuple[Simulation, Path]) -> Iterator[str]:
    """A database of the short tunnel through all stages, to be copied."""

    def fill() -> None:
        prepare(scan[1], "profiler")
        command("run", NAME)

    with copies.prepared(template, fill) as name:
        yield name


@pytest.fixture
def detected(copies: Copies, prepared: str) -> Iterator[psycopg.Connection]:
    """Connection to a copy of the short tunnel through all stages."""
    with copies.connected(prepared) as conn:
        yield conn


def test_a_rerun_gives_the_same_however_long_the_trajectory_and_reviews_survive(detected: psycopg.Connection) -> None:
    conn = detected
    conn.execute(
        "INSERT INTO tunnel.pose SELECT p.survey_id, p.time + 1.5 * n * s.seconds, p.geom FROM tunnel.pose p,"
        " (SELECT max(time) - min(time) AS seconds FROM tunnel.pose) s, generate_series(-100, 100) n WHERE n <> 0"
    )
    before = outlines(conn)
    assert len(before) >= 3
    confirmed, rejected, *_ = before
    conn.execute("UPDATE tunnel.finding SET review = 'confirmed', reviewed_by = 'ines' WHERE id = %s", [confirmed])
    conn.execute("UPDATE tunnel.finding SET review = 'rejected', remark = 'stain' WHERE id = %s", [rejected])
    # A reviewed leak and an unreviewed one where there is none any more.
    ghosts = []
    for chainage, review in ((START + 3, "confirmed"), (START + 5, "open")):
        ghosts.append(
            conn.execute(
                "INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, area,"
                " darkening_mean, darkening_max, image_share, unrolled, map, surface, review)"
                " SELECT survey_id, km, %(c)s, %(c)s + 0.1, 0, 0.1, 12,"
                " 0.01, 1, 1, 1, ST_MakeEnvelope(%(c)s, 0, %(c)s + 0.1, 0.1, 0), map, surface, %(review)s"
                " FROM tunnel.finding LIMIT 1 RETURNING id",
                {"c": chainage, "review": review},
            ).fetchone()[0]
        )
    images = conn.execute("SELECT kind, block, md5(tiff) FROM tunnel.image ORDER BY 1, 2").fetchall()
    radiometry = conn.execute("SELECT * FROM tunnel.radiometry").fetchall()
    conn.execute("UPDATE tunnel.finding SET features = NULL")  # as of a version that did not store them
    conn.commit()
    refused = CliRunner().invoke(main, ["learn", NAME])
    assert refused.exit_code == 2
    (advice,) = re.findall(r"3 reviewed findings have no features: run detect again: tunneldb ([^;]+)", refused.output)
    command(*advice.split())
    assert "2 reviews: 1 confirmed leak, 1 rejected" in command("learn", NAME).stdout
    after = outlines(conn)
    assert after.keys() == before.keys()
    assert all(after[key].equals(before[key]) for key in before)
    reviews = dict(conn.execute("SELECT id, review FROM tunnel.finding WHERE review <> 'open'").fetchall())
    assert reviews == {confirmed: "confirmed", rejected: "rejected", ghosts[0]: "confirmed"}
    state = conn.execute(
        "SELECT detected, reviewed_by, remark FROM tunnel.finding WHERE id = ANY (%s) ORDER BY id", [list(reviews)]
    )
    assert state.fetchall() == [(True, "ines", None), (True, None, "stain"), (False, None, None)]
    assert conn.execute("SELECT kind, block, md5(tiff) FROM tunnel.image ORDER BY 1, 2").fetchall() == images
    assert conn.execute("SELECT * FROM tunnel.radiometry").fetchall() == radiometry
    report = counts(conn)
    assert (report["leaks_again"], report["leaks_new"], report["leaks_kept_for_review"], report["leaks_gone"]) == (
        len(before), 0, 1, 1,
    )  # fmt: skip


def test_what_was_measured_is_stored_with_what_it_says(detected: psycopg.Connection) -> None:
    conn = detected
    survey, values = get_survey(conn, NAME), settings()
    inputs = job.load_inputs(conn, survey, int(START // 1000), values)
    assert inputs.sample is not None
    result = job.compute_detection(inputs, inputs.sample, values, lambda grid, window: None, lambda share: None)
    rows = conn.execute(
        "SELECT ST_AsBinary(a.unrolled), a.features, a.evidence, a.model, a.kind, a.confidence, l.names"
        "  FROM tunnel.finding a JOIN tunnel.feature_list l ON l.id = a.feature_list_id"
    ).fetchall()
    stored = {shapely.from_wkb(bytes(wkb)).wkb: rest for wkb, *rest in rows}
    assert len(stored) == len(rows) == len(result.anomalies.anomalies) >= 3
    for anomaly in result.anomalies.anomalies:
        features, evidence, model, kind, confidence, names = stored[anomaly.outline.wkb]
        assert names == [*NAMES, "outline"]
        assert np.array_equal(features[:-1], anomaly.verdict.features, equal_nan=True)
        assert features[-1] == anomaly.verdict.outline
        assert evidence == pytest.approx(anomaly.verdict.evidence, abs=1e-4)
        assert model == standard_model().version
        odds = standard_model().constant + sum(evidence.values())
        p = 1.0 / (1.0 + np.exp(-odds))
        assert confidence == pytest.approx(p if kind == "leak" else 1.0 - p, abs=1e-3)


def test_what_was_learned_judges_the_next_run_and_reviews_stay(detected: psycopg.Connection) -> None:
    conn = detected
    leaks = [key for (key,) in conn.execute("SELECT id FROM tunnel.finding WHERE kind = 'leak' ORDER BY id")]
    confirmed, rejected, renamed = leaks[:3]
    conn.execute("UPDATE tunnel_api.leak SET review = 'confirmed' WHERE id = %s", [confirmed])
    conn.execute("UPDATE tunnel_api.leak SET review = 'rejected' WHERE id = %s", [rejected])
    conn.execute("UPDATE tunnel_api.leak SET kind = 'joint' WHERE id = %s", [renamed])
    said = "SELECT id, review, kind, reviewed_by, reviewed_at FROM tunnel_api.finding WHERE id = ANY (%s) ORDER BY id"
    reviews = conn.execute(said, [leaks[:3]]).fetchall()
    before = conn.execute("SELECT id, kind, confidence, features, evidence FROM tunnel.finding ORDER BY id").fetchall()
    # The owner's leaks are said to be rarer by a factor of e^20: nothing is one.
    tunnel = get_survey(conn, NAME).tunnel_id
    adjustment = Adjustment("recalibrated", 0.5, -20.0)
    assert apply_learned(conn, tunnel, adjustment, [NAME], {"rejected": 40}, (0.7, 0.3), None) == 1
    conn.commit()
    command("run", NAME, "--stale")
    after = conn.execute("SELECT id, kind, confidence, features, evidence, model FROM tunnel.finding ORDER BY id").fetchall()
    assert [row[0] for row in after] == [row[0] for row in before]
    assert {kind for _, kind, *_ in after} <= {"joint", "dark"}
    assert {model for *_, model in after} == {f"{standard_model().version}+learned 1"}
    for was, now in zip(before, after, strict=True):
        assert np.array_equal(was[3], now[3], equal_nan=True)
        assert now[4] == pytest.approx({reason: 0.5 * value for reason, value in was[4].items()}, abs=1e-4)
    assert (counts(conn)["learned"], counts(conn)["model"]) == (1, f"{standard_model().version}+learned 1")
    # What was confirmed to be a leak is one still, whatever detection now takes it for.
    now_said = conn.execute(said, [leaks[:3]]).fetchall()
    assert [row for row in now_said if row[0] != rejected] == [row for row in reviews if row[0] != rejected]
    assert [row[1] for row in now_said if row[0] == rejected] == ["rejected"]
    conn.rollback()
    assert "nothing of" in command("run", NAME, "--stale").output
    command("learn", NAME, "--undo")
    command("run", NAME, "--stale")
    again = conn.execute("SELECT id, kind, confidence, features, evidence FROM tunnel.finding ORDER BY id").fetchall()
    assert [row[:3] for row in again] == [row[:3] for row in before]
    assert conn.execute(said, [leaks[:3]]).fetchall() == reviews


def test_dry_and_homogeneous_regions_that_the_user_drew(detected: psycopg.Connection, scan: tuple[Simulation, Path]) -> None:
    conn = detected
    wet = shapely.union_all([leak.polygon for leak in scan[0].leaks]).buffer(0.1)
    drawn = 0
    for chainage in np.arange(START + 1, START + 11, 0.7):
        patch = shapely.box(chainage, 0.5, chainage + 0.4, 1.2)
        if not patch.intersects(wet):
            for kind in ("dry", "homogeneous"):
                conn.execute(
                    "INSERT INTO tunnel.region (survey_id, kind, geom) SELECT id, %s, ST_GeomFromWKB(%s, 0) FROM tunnel.survey",
                    (kind, shapely.to_wkb(patch)),
                )
            drawn += 1
    conn.commit()
    before = outlines(conn)
    command("run", NAME, "--from", "detect")
    after = outlines(conn)
    assert drawn > 5
    assert counts(conn)["regions"] >= drawn
    assert shapely.union_all(list(before.values())).symmetric_difference(shapely.union_all(list(after.values()))).area < 0.05


def test_what_people_drew_is_measured_and_stays(detected: psycopg.Connection) -> None:
    conn = detected
    key, drop, held = conn.execute(
        "SELECT l.id, l.darkening_mean, l.image_share FROM tunnel_api.leak l JOIN tunnel_api.finding_unrolled f USING (id)"
        " WHERE l.counted AND l.area > 0.2 AND ST_GeometryType(ST_Buffer(f.geom, -0.05)) = 'ST_Polygon'"
        " ORDER BY l.area DESC LIMIT 1"
    ).fetchone()
    conn.execute(
        "UPDATE tunnel_api.finding_unrolled SET geom = ST_Buffer(geom, -0.05), review = 'confirmed' WHERE id = %s", [key]
    )
    (dry,) = conn.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom) "
        "SELECT %s, 'spall', ST_Translate(geom, 0, 0.01) FROM tunnel_api.finding_unrolled WHERE id = %s RETURNING id",
        [NAME, key],
    ).fetchone()
    (line,) = conn.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, width_mm, geom) SELECT %s, 'crack', 2, "
        "ST_MakeLine(ST_Point(chainage_from, arc_from), ST_Point(chainage_to, arc_to)) FROM tunnel_api.leak WHERE id = %s "
        "RETURNING id",
        [NAME, key],
    ).fetchone()
    conn.commit()
    kept = "SELECT id, unrolled, review, origin FROM tunnel_api.finding WHERE id = ANY (%s) ORDER BY id"
    before = conn.execute(kept, [[key, dry, line]]).fetchall()
    number = conn.execute("SELECT count(*), sum(area) FROM tunnel_api.leak WHERE counted").fetchone()
    conn.rollback()
    command("run", NAME, "--from", "sections")
    assert conn.execute(kept, [[key, dry, line]]).fetchall() == before
    figures = "SELECT darkening_mean, darkening_max, image_share, also_detected FROM tunnel_api.finding WHERE id = %s"
    mean, most, share, also = conn.execute(figures, [key]).fetchone()
    assert mean == pytest.approx(drop, rel=0.15)
    assert most > mean
    assert share == pytest.approx(held, abs=0.1)
    assert also
    assert conn.execute(figures, [dry]).fetchone()[0] == pytest.approx(mean, rel=0.2)
    assert 0 < conn.execute(figures, [line]).fetchone()[2] <= 1
    assert conn.execute("SELECT count(*), sum(area) FROM tunnel_api.leak WHERE counted").fetchone() == (
        number[0], pytest.approx(number[1], rel=1e-3),
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["reflectance", "linear"])
def test_other_kinds_of_intensity(conn: psycopg.Connection, scan: tuple[Simulation, Path], kind: str) -> None:
    prepare(scan[1], "profiler", kind)
    command("run", NAME)
    found = shapely.union_all(list(outlines(conn).values()))
    true = shapely.union_all([leak.polygon for leak in scan[0].leaks])
    assert found.intersection(true).area / found.union(true).area > 0.8


def test_without_intensity_there_is_the_offset_image_only(conn: psycopg.Connection, scan: tuple[Simulation, Path]) -> None:
    prepare(scan[1], "profiler", "none")
    command("run", NAME)
    assert {row[0] for row in conn.execute("SELECT kind FROM tunnel.image")} == {"offset", "overview_offset"}
    assert not outlines(conn)
    assert "no intensity" in counts(conn)["note"]


def test_bad_input_is_one_line_and_changes_nothing(
    detected: psycopg.Connection, scan: tuple[Simulation, Path], tmp_path: Path
) -> None:
    conn = detected
    before = outlines(conn)

    def refused(*says: str) -> None:
        conn.commit()
        message = command("run", NAME, "--from", "detect", code=2).stderr.strip()
        assert message.splitlines()[-1].startswith("tunneldb: ")
        for text in says:
            assert text in message.splitlines()[-1]
        assert outlines(conn) == before

    # The floor is nearer to the scanner than any lining: the curve need not reach it.
    conn.execute("DELETE FROM tunnel.reference WHERE range_m < 2.5")
    conn.commit()
    command("run", NAME, "--from", "detect")
    assert outlines(conn).keys() == before.keys()

    (path,) = scan[1].glob("*.laz")
    conn.execute("UPDATE tunnel.scan_file SET path = %s", [str(tmp_path / "gone.laz")])
    refused("gone.laz", "gone since it was loaded")
    copy = tmp_path / "changed.laz"
    copy.write_bytes(path.read_bytes()[:-1] + b"!")
    conn.execute("UPDATE tunnel.scan_file SET path = %s", [str(copy)])
    refused("changed.laz", "changed since it was loaded")
    conn.execute("UPDATE tunnel.scan_file SET path = %s", [str(path)])
    conn.execute("DELETE FROM tunnel.reference WHERE range_m > 4")
    refused("covers 3 to 4 m", "% ")
    conn.execute("DELETE FROM tunnel.reference")
    refused("no reference curve")
    message = command("run", NAME, "--from", "detect", "--set", "image.pixel=0.03", code=2).stderr
    assert "image.pixel" in message
    conn.execute("DELETE FROM tunnel.section")
    refused("no sections")


def test_the_report_of_leaks_is_in_order_of_chainage(detected: psycopg.Connection) -> None:
    text = command("leaks", NAME, "--format", "geojson").stdout
    chainages = [feature["properties"]["chainage_from"] for feature in json.loads(text)["features"]]
    assert chainages == sorted(chainages)
    assert len(chainages) == len(outlines(detected))
