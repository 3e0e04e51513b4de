"""Files of the simulator, read by other libraries."""

import json
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pyproj
import pytest
import shapely
from click.testing import CliRunner

from tunneldb.cli.main import main
from tunneldb.errors import UserError
from tunneldb.simulate import PRESETS, Files, Parameters, Simulation, simulate, write
from tunneldb.simulate import output as output_module
from tunneldb.simulate import scanner as scanner_module

pytestmark = pytest.mark.slow

SMALL = Parameters(**{**PRESETS["small"], "profile_spacing": 0.4})


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    return write(Simulation(SMALL), tmp_path_factory.mktemp("out"))


def test_laz_has_what_the_manual_says(files: Files) -> None:
    las = laspy.read(files.clouds[0])
    cloud = simulate(SMALL)
    assert las.header.version == "1.4"
    assert las.header.point_format.id == 6
    assert las.header.parse_crs() == pyproj.CRS.from_epsg(25830)
    assert len(las.points) == len(cloud) == files.points
    np.testing.assert_allclose(las.xyz, cloud.xyz, atol=0.00013)
    np.testing.assert_array_equal(las["Amplitude"], cloud.amplitude)
    np.testing.assert_array_equal(las["Reflectance"], cloud.reflectance)
    np.testing.assert_array_equal(las.intensity, cloud.intensity)
    np.testing.assert_array_equal(las.point_source_id, cloud.scan_id)
    np.testing.assert_array_equal(las.gps_time, cloud.time)
    assert np.all(np.asarray(las.return_number) == 1)


def test_truth_is_in_file_order(files: Files) -> None:
    truth = np.load(files.truth[0])
    cloud = simulate(SMALL)
    assert set(truth.files) == {"chainage", "arc", "offset", "class", "leak"}
    np.testing.assert_array_equal(truth["chainage"], cloud.chainage)
    np.testing.assert_array_equal(truth["arc"], cloud.arc)
    np.testing.assert_array_equal(truth["offset"], cloud.offset)
    np.testing.assert_array_equal(truth["class"], cloud.klass)
    np.testing.assert_array_equal(truth["leak"], cloud.leak)
    # Stored coordinates are rounded to a quarter of a millimetre.
    unrolled = Simulation(SMALL).tunnel.unroll(laspy.read(files.clouds[0]).xyz)
    np.testing.assert_allclose(unrolled.chainage, truth["chainage"], atol=0.0003)
    np.testing.assert_allclose(unrolled.offset, truth["offset"], atol=0.0003)


def rows(path: Path) -> tuple[str, np.ndarray]:
    return path.read_text().split("\n", 1)[0], np.loadtxt(path, delimiter=",", skiprows=1)


def test_sidecars(files: Files) -> None:
    simulation = Simulation(SMALL)
    line = simulation.tunnel.line
    header, axis = rows(files.axis)
    assert header == "x,y,z"
    np.testing.assert_allclose(axis, line.position(np.array([0.0, 20.0, 40.0])), atol=1e-4)
    header, trajectory = rows(files.poses)
    assert header == "time,x,y,z"
    time = laspy.read(files.clouds[0]).gps_time
    assert trajectory[0, 0] < time.min()
    assert trajectory[-1, 0] > time.max()
    header, reference = rows(files.reference)
    assert header == "range_m,intensity_db"
    assert reference[-1, 0] >= SMALL.max_range
    features = json.loads(files.leaks.read_text())["features"]
    for feature, leak in zip(features, simulation.leaks, strict=True):
        assert feature["properties"]["id"] == leak.id
        assert shapely.geometry.shape(feature["geometry"]).area == pytest.approx(leak.area)
        assert feature["properties"]["area"] == pytest.approx(leak.area, abs=1e-5)
    record = json.loads(files.parameters.read_text())
    assert record["points"] == files.points
    origin = tuple(record["parameters"].pop("origin"))
    lists = {k: tuple(v) if isinstance(v, list) else v for k, v in record["parameters"].items()}
    assert Parameters(**lists, origin=origin) == SMALL


def test_static_writes_stations(tmp_path: Path) -> None:
    p = Parameters(length=30.0, angular_step=2.0, leaks=1)
    made = write(Simulation(p), tmp_path)
    header, stations = rows(made.poses)
    assert made.poses.name == "tunnel.stations.csv"
    assert header == "scan_id,x,y,z"
    assert set(stations[:, 0]) == set(np.unique(np.asarray(laspy.read(made.clouds[0]).point_source_id))) == {1, 2}


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    p = Parameters(length=30.0, angular_step=1.0, leaks=1, seed=7)
    one, two = (write(Simulation(p), tmp_path / d) for d in "ab")
    for a, b in zip(
        (*one.clouds, one.axis, one.leaks, one.parameters),
        (*two.clouds, two.axis, two.leaks, two.parameters),
        strict=True,
    ):
        assert a.read_bytes() == b.read_bytes()


def test_points_do_not_depend_on_threads_and_blocks_stay_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scanner_module, "RAYS", 20_000)
    for case in ({"scanner": "profiler"}, {"scanner": "static"}, {"scanner": "profiler", "density": 200.0}):
        values: dict[str, Any] = {"length": 30.0, "angular_step": 1.0, "profile_spacing": 0.2, "leaks": 1, **case}
        simulation = Simulation(Parameters(**values))
        one = [c for _, c in simulation.blocks(workers=1)]
        many = [c for _, c in simulation.blocks(workers=4)]
        assert len(one) > 2
        assert max(len(c) for c in one) <= 20_000
        for a, b in zip(one, many, strict=True):
            np.testing.assert_array_equal(a.xyz, b.xyz)
            np.testing.assert_array_equal(a.amplitude, b.amplitude)


def test_threads_run_only_a_few_blocks_ahead(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scanner_module, "RAYS", 1_000)
    simulation = Simulation(Parameters(length=30.0, scanner="profiler", profile_spacing=0.1, leaks=1))
    made = 0
    make = simulation.make

    def counted(plan: Any) -> Any:
        nonlocal made
        made += 1
        return make(plan)

    monkeypatch.setattr(simulation, "make", counted)
    blocks = simulation.blocks(workers=2)
    next(blocks)
    assert made <= 5
    assert sum(1 for _ in blocks) + 1 == made > 100


@pytest.mark.parametrize("density", [None, 2.0])
def test_long_tunnels_make_a_file_a_kilometre(tmp_path: Path, density: float | None) -> None:
    p = Parameters(
        name="long",
        length=1500.0,
        radius=4000.0,
        scanner="profiler",
        start_chainage=511_746.75,
        density=density,
        profile_spacing=1.0,
        profile_points=36,
        leaks=3,
    )
    made = write(Simulation(p), tmp_path)
    assert [f.name for f in made.clouds] == ["long-km511.laz", "long-km512.laz", "long-km513.laz"]
    for km, path, truth_path in zip((511, 512, 513), made.clouds, made.truth, strict=True):
        truth = np.load(truth_path)
        assert laspy.open(path).header.point_count == truth["chainage"].size > 0
        lining = truth["chainage"][truth["class"] == 0]
        # A profile is a turn of a helix; the one that crosses the mark stays whole.
        assert lining.min() >= 1000.0 * km - 1e-6
        assert lining.max() <= 1000.0 * (km + 1) + 1.0


def test_without_truth_and_nothing_left_over(tmp_path: Path) -> None:
    write(Simulation(SMALL), tmp_path, truth=False)
    assert sorted(f.name for f in tmp_path.iterdir()) == [
        "small.axis.csv",
        "small.json",
        "small.laz",
        "small.reference.csv",
        "small.trajectory.csv",
        "small.truth.geojson",
        "small.truth.gpkg",
    ]


def test_truth_of_what_stands_free(tmp_path: Path) -> None:
    p = Parameters(**{**PRESETS["small"], "profile_spacing": 0.4}, people=1, spheres=3, catenary=True)
    made = write(Simulation(p), tmp_path)
    simulation, cloud = Simulation(p), simulate(p)
    truth = np.load(made.truth[0])
    np.testing.assert_array_equal(truth["thing"], cloud.thing)
    np.testing.assert_array_equal(truth["class"], cloud.klass)
    assert made.spheres == tmp_path / "small.spheres.csv"
    header, *lines = made.spheres.read_text().splitlines()
    assert header == "id,x,y,z,radius,kind"
    fields = [line.split(",") for line in lines]
    assert [(int(f[0]), float(f[4]), f[5]) for f in fields] == [
        (1, 0.0725, "tripod"), (2, 0.0725, "bracket"), (3, 0.0725, "touching"),
    ]  # fmt: skip
    centres = np.array([f[1:4] for f in fields], dtype=float)
    np.testing.assert_allclose(centres, [k.centre for k in simulation.spheres], atol=1e-5)
    record = json.loads(made.parameters.read_text())
    assert [k["kind"] for k in record["things"]] == [
        "sphere", "sphere", "sphere", "tripod", "bracket", "person", "catenary",
    ]  # fmt: skip
    assert [k["number"] for k in record["things"]] == list(range(1, 8))
    np.testing.assert_allclose([k["centre"] for k in record["spheres"]], centres, atol=1e-5)
    assert {v: k for k, v in record["classes"].items()}[record["things"][5]["class"]] == "object"


def test_full_disk_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(output_module, "_sidecars", full)
    with pytest.raises(UserError, match="No space left on device"):
        write(Simulation(SMALL), tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"length": 5.0}, "length is 5"),
        ({"length": float("nan")}, "length is nan"),
        ({"radius": 20.0}, "radius of the curve is 20"),
        ({"slope": 30.0}, "slope is 30"),
        ({"srid": 4326}, "not projected in metres"),
        ({"srid": 2227}, "not projected in metres"),
        ({"srid": 999999}, "SRID 999999 is unknown"),
        ({"name": "a/b"}, "is not valid in a file name"),
        ({"section": "egg"}, "section 'egg' is unknown"),
        ({"scanner": "drone"}, "scanner 'drone' is unknown"),
        ({"density": 0.0}, "density is 0"),
        ({"seed": -1}, "seed is -1"),
        ({"straight": 300.0}, "straight is 300"),
        ({"leak_area": (2.0, 1.0)}, "leak area is 2 to 1"),
        ({"invert": 5.0}, "invert is 5 m"),
        ({"section": "box", "height": 0.5}, "height of the box"),
        ({"section": "horseshoe", "wall_lean": 50.0}, "walls lean by 50"),
        ({"section": "horseshoe", "wall_lean": 30.0, "wall_height": 9.0}, "leave a floor"),
        ({"section": "horseshoe", "section_radius": 0.0}, "radius of the arch"),
        ({"section_radius": 50.0}, "radius of the section"),
        ({"ballast": 0.2}, "ballast is 0.2: give 0 to 0.05 m"),
        ({"spheres": -1}, "spheres is -1"),
        ({"people": 10**400}, "people is 100000000000…: give 0 to"),
        ({"sphere_radius": 0.0}, "sphere radius is 0: give 0.02 to 0.5 m"),
        ({"scanner_offset": 3.8}, "less than 0.5 m from the lining"),
    ],
)
def test_bad_parameters_are_the_users_errors(values: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        Parameters(**values)


def test_command_line(tmp_path: Path) -> None:
    out = str(tmp_path / "out")
    done = CliRunner().invoke(
        main,
        [
            "simulate",
            out,
            "--preset",
            "small",
            "--profile-spacing",
            "0.4",
            "--leak-area",
            "0.1",
            "1",
            "--s-curve",
            "--bollards",
            "2",
            "--ballast",
            "0.02",
            "--sleepers",
        ],
    )
    assert done.exit_code == 0, done.output
    assert "points, 3 leaks of" in done.output
    record = json.loads((tmp_path / "out" / "small.json").read_text())
    assert record["parameters"]["profile_spacing"] == 0.4
    assert record["parameters"]["leak_area"] == [0.1, 1.0]
    assert record["parameters"]["s_curve"] is True
    assert record["parameters"]["niches"] is True
    assert record["parameters"]["sleepers"] is True
    assert record["parameters"]["ballast"] == 0.02
    assert [k["kind"] for k in record["things"]] == ["bollard", "bollard"]


def test_command_line_says_what_is_wrong(tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["simulate", str(tmp_path), "--slope", "40"])
    assert done.exit_code == 2
    assert done.output == "tunneldb: slope is 40: give -20 to 20 %\n"


def test_every_parameter_has_an_option() -> None:
    text = CliRunner().invoke(main, ["simulate", "--help"]).output
    for name in Parameters.__dataclass_fields__:
        flag = {"appendages": "no-appendages", "niches": "no-niches"}.get(name, name.replace("_", "-"))
        assert f"--{flag}" in text
