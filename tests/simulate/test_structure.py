"""Simulated structures: rays against closed formulas, points against their true faces, anomalies against their contrast."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pytest
from click.testing import CliRunner
from shapely.geometry import LineString, Polygon, box

from tunneldb.cli.main import main
from tunneldb.simulate.structure import StructureParameters, StructureScan, write_structure
from tunneldb.simulate.structure.anomalies import Anomaly, blob
from tunneldb.simulate.structure.cast import cast, view
from tunneldb.simulate.structure.generate import covered
from tunneldb.simulate.structure.members import i_section, l_section, profile, u_section
from tunneldb.simulate.structure.shapes import BEND, RECTANGLE, TUBE, Face, Structure, axes_about, surface

SMALL = StructureParameters(seed=5, stations=2, angular_step=0.2, width=4.0, misregistration=0.0, gain=0.0)
UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    return write_structure(StructureScan(SMALL), tmp_path_factory.mktemp("structure"))


@pytest.fixture(scope="module")
def points(files):
    return laspy.read(files.cloud)


@pytest.fixture(scope="module")
def truth(files):
    return json.loads(files.truth.read_text())


def rays(step: float, low: tuple[float, float], high: tuple[float, float]) -> np.ndarray:
    """Unit rays and the solid angle of each: azimuth and zenith in degrees."""
    azimuth, zenith = (np.radians(np.arange(low[k] + 0.5 * step, high[k], step)) for k in (0, 1))
    a, z = (grid.ravel() for grid in np.meshgrid(azimuth, zenith))
    solid = np.radians(step) ** 2 * np.sin(z)
    return np.column_stack([np.sin(a) * np.sin(z), np.cos(a) * np.sin(z), np.cos(z), solid])


@pytest.mark.slow
def test_a_rectangle_fills_its_solid_angle():
    half_a, half_b, away = 1.3, 0.7, 4.0
    rows = surface(RECTANGLE, np.array([0.0, away, 0.0]), UPRIGHT, half_a, half_b)[None]
    shot = rays(0.05, (-30.0, 70.0), (30.0, 110.0))
    far, which = cast(rows, view(rows, np.zeros(3)), np.zeros(3), np.ascontiguousarray(shot[:, :3]))
    # A right pyramid's solid angle, by its half sizes.
    exact = 4.0 * math.asin(half_a * half_b / math.sqrt((half_a**2 + away**2) * (half_b**2 + away**2)))
    assert shot[which == 0, 3].sum() == pytest.approx(exact, rel=0.003)
    assert (far[which == 0, None] * shot[which == 0, :3])[:, 1] == pytest.approx(away)


def test_a_tube_shows_its_outline_and_its_surface():
    radius, away = 0.2, 5.0
    rows = surface(TUBE, np.array([-3.0, away, 0.0]), axes_about(np.array([1.0, 0.0, 0.0])), radius, 6.0)[None]
    shot = rays(0.02, (-0.02, 80.0), (0.02, 100.0))
    far, which = cast(rows, view(rows, np.zeros(3)), np.zeros(3), np.ascontiguousarray(shot[:, :3]))
    zenith = np.degrees(np.arccos(shot[which == 0, 2]))
    half = math.degrees(math.asin(radius / away))
    assert zenith.min() == pytest.approx(90.0 - half, abs=0.02)
    assert zenith.max() == pytest.approx(90.0 + half, abs=0.02)
    met = far[which == 0, None] * shot[which == 0, :3]
    assert np.hypot(met[:, 1] - away, met[:, 2]) == pytest.approx(radius, abs=1e-9)


def test_an_elbow_is_a_torus_between_its_ends():
    major, minor = 0.3, 0.1
    rows = surface(BEND, np.array([0.0, 4.0, 0.0]), UPRIGHT, major, minor, 0.5 * math.pi)[None]
    shot = rays(0.05, (-8.0, 82.0), (8.0, 98.0))
    far, which = cast(rows, view(rows, np.zeros(3)), np.zeros(3), np.ascontiguousarray(shot[:, :3]))
    met = far[which == 0, None] * shot[which == 0, :3] - [0.0, 4.0, 0.0]
    ring = np.hypot(met[:, 0], met[:, 2]) - major
    assert len(met) > 500
    assert np.hypot(ring, met[:, 1]) == pytest.approx(minor, abs=1e-5)
    assert met[:, [0, 2]].min() > -1e-6


@pytest.mark.parametrize(
    ("section", "area"),
    [
        (i_section(0.2, 0.1, 0.006, 0.01), 2 * 0.1 * 0.01 + 0.18 * 0.006),
        (u_section(0.2, 0.1, 0.008), 2 * 0.1 * 0.008 + 0.184 * 0.008),
        (l_section(0.1, 0.1, 0.01), 0.1 * 0.01 + 0.09 * 0.01),
    ],
)
def test_profiles_are_closed_and_look_outward(section, area):
    structure = Structure()
    profile(structure, "profile", "bare steel", section, np.zeros(3), np.eye(3), 2.0)
    rows, _ = structure.table()
    normal, size = rows[:, 10:13], 4.0 * rows[:, 13] * rows[:, 14]
    assert (size[:, None] * normal).sum(axis=0) == pytest.approx(0.0, abs=1e-12)
    # Gauss: the flux of x/3 through a closed surface is the volume.
    assert (size * np.einsum("ij,ij->i", rows[:, 1:4], normal)).sum() / 3.0 == pytest.approx(2.0 * area)


def test_points_lie_on_their_faces_within_the_noise(files, points, truth):
    stations = np.loadtxt(files.stations, delimiter=",", skiprows=1)[:, 1:]
    ray = points.xyz - stations[np.asarray(points.point_source_id) - 1]
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    off, slants = [], []
    for face in truth["faces"]:
        mine = np.asarray(points["true_face"]) == face["id"]
        if face["kind"] == "bend" or not mine.any():
            continue
        local = (points.xyz[mine] - face["origin"]) @ np.array(face["axes"]).T
        if face["kind"] == "cylinder":
            length = np.hypot(local[:, 0], local[:, 1])
            gap = length - face["radius"]
            normal = (local * [1.0, 1.0, 0.0]) / length[:, None] @ np.array(face["axes"])
        else:
            gap, normal = local[:, 2], np.broadcast_to(face["axes"][2], (len(local), 3))
            if "size" in face:
                within = np.abs(local[:, :2]) - 0.5 * np.array(face["size"])
                assert np.percentile(within, 99) < 0.02
        cosine = np.abs(np.einsum("ij,ij->i", normal, ray[mine]))
        off.append(gap / np.maximum(cosine, 0.05))
        slants.append(np.degrees(np.arccos(np.minimum(cosine, 1.0))) - np.asarray(points["true_incidence"])[mine])
    spread = 1.4826 * np.median(np.abs(np.concatenate(off)))
    assert spread == pytest.approx(SMALL.range_noise, rel=0.05)
    assert np.percentile(np.abs(np.concatenate(slants)), 90) < 0.5
    member = {face["id"]: face["member"] for face in truth["faces"]} | {0: 0}
    assert [member[f] for f in np.asarray(points["true_face"])[::97]] == np.asarray(points["true_member"])[::97].tolist()


def test_what_is_put_in_is_seen_by_its_contrast(points, truth):
    plain = StructureScan(replace(SMALL, anomalies=0))
    level = np.concatenate([cloud.reflectance for cloud in plain.blocks()])
    change = np.asarray(points["Reflectance"]) - level
    number = np.asarray(points["true_anomaly"])
    assert (number > 0).sum() > 100
    assert np.abs(change[(number == 0)]).max() < max(abs(a["contrast"]) for a in truth["anomalies"])
    for anomaly in truth["anomalies"]:
        mine = number == anomaly["id"]
        assert mine.sum() == anomaly["points"]
        if mine.sum() >= 50 and anomaly["kind"] in ("stain", "flake"):
            assert np.median(change[mine]) == pytest.approx(anomaly["contrast"], abs=0.1)
        if "outline" in anomaly and mine.any():
            assert Polygon(anomaly["outline"]).area == pytest.approx(anomaly["area"], rel=0.02)


def test_a_crack_narrower_than_the_footprint_darkens_by_its_share():
    face = Face(1, 1, "plane", "concrete", surface(RECTANGLE, np.zeros(3), np.eye(3), 1.0, 1.0))
    line = LineString([(-0.5, 0.0), (0.5, 0.0)])
    crack = Anomaly(1, face, "crack", line.buffer(0.001, cap_style="flat"), -6.0, 0.002, line)
    share, inside = covered(crack, np.array([[0.0, 0.0], [0.0, 0.002], [0.0, 0.01]]), np.full(3, 0.004))
    assert share == pytest.approx([0.5, 0.25, 0.0])
    assert inside.tolist() == [True, False, False]


def test_outlines_have_the_area_asked_for():
    shape = blob(0.05, 2.0, 0.3, np.random.default_rng(1))
    assert shape.area == pytest.approx(0.05)
    stain = Anomaly(1, Face(1, 1, "plane", "concrete", np.zeros(17)), "stain", box(0, 0, 1, 1), -3.0)
    assert stain.level(np.array([1.0, 0.2])).tolist() == [-3.0, -3.0]


def test_mixed_pixels_belong_to_no_face(points):
    sharp = StructureScan(replace(SMALL, beam=0.0))
    wires = sum(int((cloud.face == 0).sum()) for cloud in sharp.blocks())
    assert (np.asarray(points["true_face"]) == 0).sum() > 1.3 * wires > 0


def test_a_seed_has_the_same_bytes_and_night_the_same_truth(files, points, tmp_path: Path):
    again = write_structure(StructureScan(SMALL), tmp_path)
    assert again.cloud.read_bytes() == files.cloud.read_bytes()
    assert again.truth.read_bytes() == files.truth.read_bytes()
    dark = write_structure(StructureScan(replace(SMALL, night=True, name="night")), tmp_path)
    night = laspy.read(dark.cloud)
    assert "red" not in night.point_format.dimension_names
    assert int(points.red.max()) > 0
    assert (np.asarray(night["true_anomaly"]) == np.asarray(points["true_anomaly"])).all()
    assert not np.array_equal(night["Amplitude"], points["Amplitude"])


def test_a_value_out_of_range_is_refused_in_one_line(tmp_path: Path):
    result = CliRunner().invoke(main, ["simulate-structure", str(tmp_path / "out"), "--stations", "9"])
    assert result.exit_code == 2
    assert "stations is 9: give 1 to 4 stations" in result.output
    assert not (tmp_path / "out").exists()
