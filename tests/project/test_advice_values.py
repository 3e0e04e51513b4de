"""Messages about single values: each test calls a function, does what the refusal says, and calls it again."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyogrio
import pytest
import shapely
from support.advice import advised

from tunneldb.cli.clearance import _widening
from tunneldb.cli.leaks import parse_clock
from tunneldb.cli.load import density_of
from tunneldb.cli.param_types import file_path
from tunneldb.cli.register import _speeds
from tunneldb.cli.rings import _chords
from tunneldb.database.home import prepare_home
from tunneldb.evaluate.truth import read_polygons
from tunneldb.export.figures import axis_deviation, intensity_dependence
from tunneldb.export.pointcloud import members
from tunneldb.export.tables import workbook
from tunneldb.measures.rings.surveyed_points import require_size
from tunneldb.pipeline.profile_file import read_profile
from tunneldb.pipeline.register import SonarInput
from tunneldb.pipeline.target_control import read_control
from tunneldb.pointcloud.sonar import read_sonar
from tunneldb.queue.batch import _require_files
from tunneldb.radiometry.intensity_kind import doubt
from tunneldb.radiometry.reference_curve import ReferenceCurve
from tunneldb.simulate import Parameters, Simulation
from tunneldb.simulate.canal.parameters import CanalParameters
from tunneldb.simulate.structure.parameters import StructureParameters
from tunneldb.simulate.tunnel.section import box, circular, horseshoe
from tunneldb.stages.parameters import settings
from tunneldb.stages.run import km_range, parse_km
from tunneldb.store.catalog import _require_name

NO_WIDENING = {
    "curve_widening": (0.0, 0.0), "bogie_distance": 0.0, "overhang": 0.0, "flexibility": 0.0, "speed": 0.0,
    "roll_height": 0.0, "allowance": 0.0,
}  # fmt: skip


def widened(**options: Any) -> None:
    _widening(NO_WIDENING | options)


def target(path: Path) -> None:
    members.check_target(Path("a.laz"), path)


def named(suffix: str) -> Path:
    return Path(f"out{suffix}")


CASES: list[tuple[Callable[..., Any], Any, str, Callable[[re.Match[str]], Any]]] = [
    (_chords, ("high",), r"as (300-60) in degrees", lambda found: (found[1],)),
    (_chords, ("high",), r"or (9:00-3:00),", lambda found: (found[1],)),
    (_chords, ("400-10",), r"there are 0 to (360) degrees", lambda found: (f"{found[1]}-10",)),
    (_chords, ("1:00-13:00",), r"or 0:00 to (12:00)", lambda found: (f"1:00-{found[1]}",)),
    (_speeds, "1447", r"as (1500=1447)", lambda found: found[1]),
    (density_of, "dense", r"points per m², (1) or more", lambda found: found[1]),
    (density_of, "0", r"or '(all)'", lambda found: found[1]),
    (km_range, "12+300", r"a kilometre or a range, (511) or", lambda found: found[1]),
    (km_range, "12,13", r"or (511-513)", lambda found: found[1]),
    (lambda km: parse_km(km, [511, 512]), "12", r"loaded: (\d+),", lambda found: found[1]),
    (axis_deviation.check_format, named(".xls"), r"as .*(\.png).* \(a figure\)", lambda found: named(found[1])),
    (axis_deviation.check_format, named(".xls"), r"or (\.csv) \(a table\)", lambda found: named(found[1])),
    (intensity_dependence.check_format, named(".jpg"), r"write the figure as .*(\.png)", lambda found: named(found[1])),
    (target, named(".xyz"), r"points as (\.laz)", lambda found: named(found[1])),
    (target, named(".xyz"), r"polygons as (\.gpkg)", lambda m: named(m[1])),
    (settings, ["axis.max_rejected=few"], r"--set (\S+)", lambda found: [found[1]]),
    (settings, ["axis.max_rejectd=0.5"], r"Did you mean '(\S+)'\?", lambda found: [f"{found[1]}=0.5"]),
    (settings, ["section.angle_step=7"], r"must divide (180) degrees", lambda m: [f"section.angle_step={int(m[1]) / 36}"]),
    (box, 50.0, r"give 1 to (40) m", lambda found: float(found[1])),
    (circular, 30.0, r"up to (20) m", lambda found: float(found[1])),
    (horseshoe, 30.0, r"up to (20) m", lambda found: float(found[1])),
    (lambda lean: horseshoe(inclination=lean), 40.0, r"give 0 to (30)", lambda found: float(found[1])),
    (file_path, "a\nb.laz", "rename it", lambda _: "ab.laz"),
    (parse_clock, "noon", r"as (10-2) or", lambda found: found[1]),
    (parse_clock, "noon", r"or (10:30-1:30)", lambda found: found[1]),
    (_require_name, "a" * 200, r"use at most (\d+)$", lambda found: "a" * int(found[1])),
    (_require_name, ".a", "begin with a letter or a digit", lambda _: "a"),
    (lambda curve: ReferenceCurve(*np.array(curve).T), [(1.0, 2.0), (2.0, np.nan), (3.0, 1.0)], r"^row (2) .* remove it",
     lambda found: np.delete([(1.0, 2.0), (2.0, np.nan), (3.0, 1.0)], int(found[1]) - 1, axis=0)),
    (lambda speeds: SonarInput((), Path("l.csv"), 1, 0.0, None, speeds), (1500.0, 14.47), r"give ASSUMED=MEASURED, as (\S+)",
     lambda found: _speeds(found[1])),
]  # fmt: skip


@pytest.mark.parametrize(("call", "wrong", "advice", "right"), CASES)
def test_a_value(call: Callable[[Any], Any], wrong: Any, advice: str, right: Callable[[re.Match[str]], Any]) -> None:
    found = advised(lambda: call(wrong), advice)
    call(right(found))


OPTIONS: list[tuple[Callable[..., Any], dict[str, Any], str, Callable[[re.Match[str]], dict[str, Any]]]] = [
    (widened, {"curve_widening": (36.0, 36.0), "overhang": 2.0}, "leave one out", lambda _: {"overhang": 2.0}),
    (widened, {"curve_widening": (36.0, 36.0), "overhang": 2.0}, "leave one out", lambda _: {"curve_widening": (36.0, 36.0)}),
    (widened, {"flexibility": 0.2}, "add --(speed)", lambda found: {"flexibility": 0.2, found[1]: 80.0}),
    (CanalParameters, {"towpath": "up"}, r"give (\w+), (\w+) or (\w+)", lambda found: {"towpath": found[2]}),
    (CanalParameters, {"sub_rays": 3}, r"give 1, 7, 13 or (\d+)", lambda found: {"sub_rays": int(found[1])}),
    (CanalParameters, {"radius": 5.0}, r"at least (\d+) m", lambda found: {"radius": -float(found[1])}),
    (CanalParameters, {"sonar_depth": (1.0, 0.5)}, "two ascending values from 0 on", lambda _: {"sonar_depth": (0.5, 1.0)}),
    (StructureParameters, {"contrast": (5.0, 3.0)}, "give two ascending values above 0", lambda _: {"contrast": (3.0, 5.0)}),
]  # fmt: skip


SHORT = {"length": 10.0, "straight": 2.0, "leaks": 0}
FULL = [
    ({"leaks": 30, "leak_area": (2.0, 3.0)}, "use fewer or smaller", {"leaks": 1, "leak_area": (0.2, 0.3)}),
    ({"halos": 150}, "no room .*; use fewer halos", {"halos": 1}),
    ({"patches": 200}, "use fewer patches", {"patches": 1}),
    ({"ring_leaks": 40}, "no room for ring leak .*; use fewer leaks", {"ring_leaks": 1}),
    ({"joint_leaks": 90, "lining": "cast"}, "use fewer leaks", {"joint_leaks": 1, "lining": "cast"}),
    ({"sheets": 60}, "use fewer", {"sheets": 1}),
    ({"spheres": 4, "sphere_radius": 0.5, "section": "box", "height": 2.5}, "use fewer or a longer", {"spheres": 1}),
    ({"people": 200}, "use fewer objects", {"people": 1}),
    ({"cable_leaks": 1, "appendages": False}, r"or add --(clutter)", {"cable_leaks": 1, "appendages": False, "clutter": 2}),
    ({"pocket_leaks": 1, "lining": "cast"}, "use lining segments", {"pocket_leaks": 1, "lining": "segments"}),
    ({"name": "a/b"}, "use letters, digits, - and _", {"name": "a-b"}),
    ({"section": "hexagon"}, r"use (circular), ", {"section": "circular"}),
    ({"scanner_offset": 3.9}, "change its height or offset", {"scanner_offset": 1.0}),
    ({"invert": 9.0}, "give a depth between 0 and", {"invert": 1.0}),
    ({"straight": 20.0}, "give 0 to less than the length, 10 m", {"straight": 9.0}),
    ({"density": 0.01}, "give 0.1 to 1000000", {"density": 0.1}),
    ({"seed": -1}, "give 0 or more", {"seed": 0}),
    ({"leak_area": (3.0, 2.0)}, "give two ascending numbers from 0.001", {"leak_area": (2.0, 3.0)}),
    ({"ovality": (0.1, 9.0), "lining": "segments"}, "give 0 to 5 %", {"ovality": (0.1, 5.0), "lining": "segments"}),
    ({"ring_shift": 0.01, "lining": "segments", "section": "horseshoe"}, "use circular",
     {"ring_shift": 0.01, "lining": "segments", "section": "circular"}),
    ({"joint_leaks": 1}, "use lining cast or segments", {"joint_leaks": 1, "lining": "cast"}),
    ({"segment_step": 0.01, "lining": "cast"}, "use lining segments", {"segment_step": 0.01, "lining": "segments"}),
    ({"grown_leaks": 1}, r"add --epoch 1", {"grown_leaks": 0, "epoch": 1}),
    ({"mesh": 0.01}, "give 0 for none, or 0.02 m and more", {"mesh": 0.02}),
    ({"radius": 30.0}, "give 50 m or more, or 0", {"radius": 50.0}),
    ({"length": 5.0}, "give 10 to 100000 m", {"length": 10.0}),
    ({"srid": 999999}, "give the EPSG code of a projected system", {"srid": 25830}),
    ({"srid": 4326}, "is not projected in metres: give one that is", {"srid": 25830}),
    ({"radius": 60.0, "straight": 9.0, "transition": 9.0}, "shorten them or lengthen the tunnel",
     {"radius": 60.0, "straight": 1.0, "transition": 2.0}),
    ({"section": "box", "width": 50.0}, "give 1 to 40 m", {"section": "box", "width": 40.0}),
    ({"clutter": 400}, "give 0 to 30 runs", {"clutter": 30, "length": 60.0}),
]  # fmt: skip


@pytest.mark.parametrize(("wrong", "advice", "right"), FULL)
def test_a_simulated_tunnel(wrong: dict[str, Any], advice: str, right: dict[str, Any]) -> None:
    advised(lambda: Simulation(Parameters(**(SHORT | wrong))), advice)
    Simulation(Parameters(**(SHORT | right)))


@pytest.mark.parametrize(("call", "wrong", "advice", "right"), OPTIONS)
def test_options(
    call: Callable[..., Any], wrong: dict[str, Any], advice: str, right: Callable[[re.Match[str]], dict[str, Any]]
) -> None:
    found = advised(lambda: call(**wrong), advice)
    call(**right(found))


@pytest.mark.parametrize(
    ("kind", "values"), [("linear", (-20.0, -5.0)), ("reflectance", (5.0, 30.0)), ("amplitude", (-20.0, -5.0))]
)
def test_no_doubt_is_left_by_the_kind_of_the_message(kind: str, values: tuple[float, float]) -> None:
    intensity = np.linspace(*values, 1000)
    said = doubt(kind, intensity)  # type: ignore[arg-type]
    assert said
    better = re.search(r"--intensity-kind (\w+)", said)
    assert better, said
    assert doubt(cast(Any, better[1]), intensity) is None


SQUARE, BOW = shapely.box(0, 0, 1, 1), shapely.Polygon([(0, 0), (1, 1), (1, 0), (0, 1)])


def layer(path: Path, shapes: list[bytes | None], name: str, *, append: bool = False) -> None:
    data = np.array(shapes, object)
    pyogrio.raw.write(path, data, [], [], geometry_type="Polygon", layer=name, crs=None, append=append)


@pytest.mark.filterwarnings("ignore:'crs' was not provided")
@pytest.mark.parametrize(
    ("second", "advice"),
    [
        (None, "leak (2) has no geometry; remove the row"),
        (shapely.to_wkb(shapely.Polygon([(0, 0), (np.nan, 1), (1, 1)])), "leak (2) .*; draw it again, or remove the row"),
    ],
)
def test_a_reference_leak_without_outline(second: bytes | None, advice: str, tmp_path: Path) -> None:
    path, rows = tmp_path / "a.gpkg", [shapely.to_wkb(SQUARE), second]

    def read() -> list[Any]:
        return read_polygons(path, cast(Any, None), None, "leak").shapes

    layer(path, rows, "leak")
    del rows[int(advised(read, advice)[1]) - 1]
    path.unlink()
    layer(path, rows, "leak")
    assert [shape.area for shape in read()] == [1.0]


@pytest.mark.filterwarnings("ignore:'crs' was not provided")
def test_a_layer_of_reference_leaks_is_chosen(tmp_path: Path) -> None:
    path = tmp_path / "a.gpkg"
    layer(path, [shapely.to_wkb(SQUARE)], "north")
    layer(path, [shapely.to_wkb(BOW)], "south", append=True)
    found = advised(lambda: read_polygons(path, cast(Any, None), None, "leak"), r"has the layers (\w+), .* by --layer")
    assert read_polygons(path, cast(Any, None), found[1], "leak").shapes == [SQUARE]


def test_control_points_are_written_once(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("id,x,y,z\nA,1,2,3\nB,2,2,3\nA,5,2,3\n")
    first = int(advised(lambda: read_control(path), r"duplicate \(line (\d+)\); write each point once")[1])
    lines = path.read_text().splitlines()
    del lines[first - 1]
    path.write_text("\n".join(lines))
    assert read_control(path).names == ["B", "A"]


def test_a_shorter_stretch_fits_a_sheet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workbook, "MAX_ROWS", 3)
    rows = [(k,) for k in range(3)]

    def write(count: int) -> None:
        workbook.write_workbook(tmp_path / "a.xlsx", [workbook.Sheet("s", (workbook.Column("n", 5.0),), rows[:count])], "s")

    advised(lambda: write(3), "or a shorter stretch")
    write(2)


@pytest.mark.parametrize(
    ("radius", "advice", "factor"), [(6.0, "is 6 m the radius?", 2.0), (1.5, "is 6 m twice the diameter?", 0.5)]
)
def test_the_diameter_of_rings_is_that_of_the_question(radius: float, advice: str, factor: float) -> None:
    radii = np.full(5, radius)
    advised(lambda: require_size(Path("a.csv"), radii, 6.0), re.escape(advice))
    require_size(Path("a.csv"), radii, factor * 6.0)


def test_the_layer_of_a_table_is_omitted(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("right,up\n-3,-3\n3,-3\n3,3\n-3,3\n-3,-3\n")
    advised(lambda: read_profile(path, layer="0"), "--drawing-layer is for a .dxf; omit it")
    assert read_profile(path).outline.area == pytest.approx(36.0)


def test_the_output_has_another_name(tmp_path: Path) -> None:
    source = tmp_path / "a.laz"
    source.write_bytes(b"")
    advised(lambda: members.check_target(source, source), "choose another name with -o")
    members.check_target(source, tmp_path / "b.laz")


def test_the_folder_of_the_server_is_another(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    advised(lambda: prepare_home(tmp_path / "file" / "home"), "set TUNNELDB_HOME to another")
    assert prepare_home(tmp_path / "home").folder == tmp_path / "home"


def test_points_of_a_profile_have_a_unit(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("-3 -3\n0 -3\n3 -3\n3 0\n3 3\n0 3\n-3 3\n-3 0\n")
    unit = advised(lambda: read_profile(path), r"say it by --unit (\w+)")[1]
    assert read_profile(path, unit=unit).outline.area == pytest.approx(36.0)


def test_raw_data_of_a_sonar_are_exported(tmp_path: Path) -> None:
    suffix = advised(lambda: read_sonar(tmp_path / "a.son"), r"export it from the maker's software as (\.xyz)")[1]
    path = tmp_path / f"a{suffix}"
    path.write_text("1 2 3\n4 5 6\n")
    assert len(read_sonar(path)[0]) == 2


def test_files_of_a_batch_have_names_of_their_own(tmp_path: Path) -> None:
    for name in ("a/1.laz", "b/1.laz", "b/2.laz"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"")
    advised(lambda: _require_files([tmp_path / "a/1.laz", tmp_path / "b/1.laz"]), "rename one")
    _require_files([tmp_path / "a/1.laz", tmp_path / "b/2.laz"])
