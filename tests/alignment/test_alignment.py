"""Design alignments: elements against closed formulas and another library, published files against their own figures."""

from __future__ import annotations

import itertools
import math
import re
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import fresnel

from tunneldb.alignment.design import Design, StationPiece
from tunneldb.alignment.elements import PlanElement, ProfileElement, clothoid_from_chord
from tunneldb.alignment.given import read_given
from tunneldb.alignment.landxml import LandXml
from tunneldb.alignment.profile import Pvi, profile_elements
from tunneldb.errors import UserError
from tunneldb.geometry.alignment import Alignment

DATA = Path(__file__).parents[1] / "data"
FOOT = 1200 / 3937


def landxml(name: str) -> Design:
    return LandXml(DATA / name).design(0, 0)


@pytest.mark.parametrize(("length", "radius"), [(62.5, 250.0), (100.0, -40.0), (400.0, 22.0)])
def test_a_clothoid_is_fresnels(length: float, radius: float) -> None:
    element = PlanElement("clothoid", length, 500_000.0, 4_640_000.0, 0.3, 0.0, 1 / radius)
    scale = math.sqrt(math.pi * length * abs(radius))
    along = np.linspace(0.0, length, 101)
    sine, cosine = fresnel(along / scale)
    x, y = scale * cosine, math.copysign(scale, radius) * sine
    c, s = math.cos(0.3), math.sin(0.3)
    expected = np.column_stack([500_000 + c * x - s * y, 4_640_000 + s * x + c * y])
    np.testing.assert_allclose(element.position(along), expected, rtol=0, atol=1e-8)


def test_a_clothoid_between_arcs_is_a_piece_of_one() -> None:
    """R 140 to R 160, as in the Japanese sample: the piece of a clothoid of A 200 between these radii, reversed."""
    whole = PlanElement("clothoid", 200**2 / 140, 0.0, 0.0, 0.0, 0.0, -1 / 140)
    far, near = 200**2 / 140, 200**2 / 160
    piece, excess = clothoid_from_chord((0.0, 0.0), (1.0, 0.0), far - near, 1 / 140, 1 / 160)
    a, b = whole.position(np.array([far])), whole.position(np.array([near]))
    assert np.linalg.norm(piece.end) == pytest.approx(float(np.linalg.norm(a - b)), abs=1e-9)
    assert excess == pytest.approx(1.0 - np.linalg.norm(a - b), abs=1e-9)


def test_an_arc_stays_on_its_circle() -> None:
    arc = PlanElement("arc", 500.0, 10.0, 20.0, 1.0, -0.01, -0.01)
    centre = np.array([10.0 + 100 * math.sin(1.0), 20.0 - 100 * math.cos(1.0)])
    points = arc.position(np.linspace(0, 500, 200))
    np.testing.assert_allclose(np.hypot(*(points - centre).T), 100.0, atol=1e-10)
    turned = np.unwrap(np.arctan2(*(points - centre).T[::-1]))
    np.testing.assert_allclose(turned[0] - turned, np.linspace(0, 5, 200), atol=1e-10)


def test_a_circle_in_profile_is_one() -> None:
    (grade, circle, after) = profile_elements([Pvi(0, 50), Pvi(100, 53, radius=800), Pvi(300, 43)], Path("f"))
    assert (grade.kind, circle.kind, after.kind) == ("grade", "circle", "grade")
    at = np.linspace(circle.distance, circle.distance + circle.length, 50)
    # 800 m below its beginning, at right angles to the grade of 3 %
    centre = np.array([circle.distance + 800 * 0.03 / math.hypot(1, 0.03), circle.z - 800 / math.hypot(1, 0.03)])
    np.testing.assert_allclose(np.hypot(at - centre[0], circle.height(at) - centre[1]), 800.0, atol=1e-9)
    assert after.z == pytest.approx(float(circle.height(at[-1:])[0]), abs=1e-9)
    assert after.grade_from == pytest.approx(-0.05)


def test_parabolas_touch_both_grades() -> None:
    for point in (Pvi(100, 53, 30, 30), Pvi(100, 53, 20, 60)):
        elements = profile_elements([Pvi(0, 50), point, Pvi(300, 43)], Path("f"))
        for low, high in itertools.pairwise(elements):
            meet = np.array([high.distance])
            assert low.height(meet)[0] == pytest.approx(high.z, abs=1e-12)
            assert low.grade_to == pytest.approx(high.grade_from, abs=1e-12)
        assert elements[0].length == pytest.approx(100 - point.before)
        assert elements[-1].grade_to == pytest.approx(-0.05)
    assert len(elements) == 4


@pytest.mark.parametrize("name", ["j-landxml.xml", "indot-twin-branch.xml"])
def test_published_landxml_leads_to_its_own_points(name: str) -> None:
    """Each element, from its beginning, its curvature and its length, arrives at the end that the file states."""
    text = (DATA / name).read_text()
    unit = FOOT if "USSurveyFoot" in text else 1.0
    ends = np.array([[float(v) for v in end.split()] for end in re.findall(r"<End[^>]*>([^<]*)<", text)]) * unit
    design = landxml(name)
    assert len(ends) == len(design.plan)
    found = np.array([element.end for element in design.plan])
    np.testing.assert_allclose(found, ends[:, 1::-1], rtol=0, atol=2e-7)
    if name == "j-landxml.xml":  # its points have the heights of its profile
        np.testing.assert_allclose(design.height(design.distances[1:]), ends[:, 2], rtol=0, atol=1e-6)


def test_published_landxml_passes_through_its_stakes() -> None:
    design = landxml("j-landxml.xml")
    stakes = [(-80.0, -16557.18940240, -5842.61479868), (-60.0, -16547.08500975, -5825.35498266)]
    for station, x, y in stakes:
        assert design.position(np.array([station - design.start]))[0, :2] == pytest.approx((x, y), abs=1e-6)
    assert design.start == -90.0
    assert design.pieces == (
        StationPiece(0.0, -90.0),
        StationPiece(pytest.approx(379.62528129), 290.0),
        StationPiece(pytest.approx(765.50790516), 675.0),
    )


def test_feet_are_turned_into_metres() -> None:
    design = landxml("indot-twin-branch.xml")
    assert design.plan[1].curvature_from == pytest.approx(1 / (2600 * FOOT), rel=1e-9)
    assert design.start == pytest.approx(2103.72056 * FOOT)
    # height in the middle of the crest at 3990 ft: that of the intersection less L (g1 - g2) / 8
    grades = (808.327 - 783.524) / (3990 - 3150), (714.4791875 - 808.327) / (4932.5 - 3990)
    crest = 808.327 - 400 * (grades[0] - grades[1]) / 8
    at = np.array([(3990 - 2103.72056) * FOOT])
    assert design.height(at)[0] == pytest.approx(crest * FOOT, abs=1e-6)
    assert any("0.3048006" in note for note in design.notes)


def test_ifc_and_landxml_of_one_road_agree() -> None:
    ifc = pytest.importorskip("tunneldb.alignment.ifc").Ifc(DATA / "indot-twin-branch.ifc").design(0, 0)
    at = np.linspace(0.0, ifc.distances[-1], 400)
    np.testing.assert_allclose(ifc.position(at), landxml("indot-twin-branch.xml").position(at), rtol=0, atol=1e-6)


@pytest.mark.parametrize("name", ["aplitop-3.ifc", "indot-twin-branch.ifc"])
def test_ifcopenshell_draws_the_same_line(name: str) -> None:
    ifcopenshell = pytest.importorskip("ifcopenshell")
    import ifcopenshell.api.alignment as api

    from tunneldb.alignment.ifc import Ifc

    file = ifcopenshell.open(DATA / name)
    (alignment,) = file.by_type("IfcAlignment")
    api.create_representation(file, alignment)
    curve = api.get_curve(alignment)
    design = Ifc(DATA / name).design(0, 0)
    at = np.linspace(1.0, design.reach[1] - 1.0, 40)
    drawn = np.array([api.evaluate_representation(curve, distance)[3, :3] for distance in at])
    np.testing.assert_allclose(design.position(at), drawn, rtol=0, atol=2e-6)


@pytest.mark.parametrize("name", ["aplitop-3.ifc", "j-landxml.xml", "indot-twin-branch.xml"])
def test_the_line_follows_the_design_to_a_millimetre(name: str) -> None:
    """Also between its vertices, and as the stations that are set on it."""
    given = read_given(DATA / name)
    design = given.design
    assert design is not None
    low, high = design.reach
    vertices = np.linspace(low, high, len(given.xyz))
    middles = (vertices[1:] + vertices[:-1]) / 2
    chords = (given.xyz[1:] + given.xyz[:-1]) / 2
    assert np.linalg.norm(chords - design.position(middles), axis=1).max() < 0.001
    line = Alignment.from_polyline(given.xyz, given.start)
    assert line.end == pytest.approx(given.start + high - low, abs=1e-5)
    inside = (line.number * 10.0 >= line.start) & (line.number * 10.0 <= line.end)
    stations = design.position(line.number[inside] * 10.0 - design.start)
    np.testing.assert_allclose(line.vertices[inside], stations, rtol=0, atol=1e-4)


def test_stations_on_straights_do_not_swing_where_an_arc_begins() -> None:
    plan = [PlanElement("line", 700.0, 0.0, 0.0, 0.0)]
    plan.append(PlanElement("arc", 300.0, 700.0, 0.0, 0.0, 1 / 300, 1 / 300))
    design = Design("", tuple(plan), (ProfileElement("grade", 0.0, 1000.0, 5.0, 0.02, 0.02),))
    line = Alignment.from_polyline(design.polyline(), 0.0)
    np.testing.assert_allclose(line.vertices, design.position(line.number * 10.0), rtol=0, atol=0.0005)


def test_the_axis_ends_with_the_shorter_of_plan_and_profile() -> None:
    plan = (PlanElement("line", 100.0, 0.0, 0.0, 0.0),)
    short = Design("", plan, (ProfileElement("grade", 20.0, 50.0, 5.0, 0.02, 0.02),), start=1000.0)
    assert short.chainages == (1020.0, 1070.0)
    rounded = Design("", plan, (ProfileElement("grade", 0.003, 99.99, 5.0, 0.02, 0.02),))
    assert rounded.chainages == (0.0, 100.0)
    np.testing.assert_allclose(rounded.height(np.array([0.0, 100.0])), [5.0 - 0.003 * 0.02, 5.0 + 99.997 * 0.02], atol=1e-12)


def edited(tmp_path: Path, name: str, *changes: tuple[str, str]) -> Path:
    """A published file with pieces of its text replaced."""
    text = (DATA / name).read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / name
    path.write_text(text)
    return path


ALIGNMENT = re.search(r"<Alignment .*</Alignment>", (DATA / "j-landxml.xml").read_text(), re.DOTALL)
assert ALIGNMENT is not None
SECOND = ALIGNMENT[0].replace('name="○○路線"', 'name="B"')
BROKEN = [
    (("</Alignments>", f"{SECOND}</Alignments>"), r"holds 2 alignments: '○○路線', 'B'; choose one by --alignment NAME"),
    (("<ProfAlign ", "<ProfSurf "), r"not a complete XML file"),
    (('spiType="clothoid"', 'spiType="bloss"'), r"spiral of type bloss; only clothoids"),
    (('length="62.50000000"', 'length="72.50000000"'), r"distance of its ends of the Spiral .* off by 9\.\d+ m"),
    (('rot="ccw" radius="250.00000000"', 'rot="ccw" radius="251.0"'), r"radius of the Curve .* off by 1\.000 m"),
    (('rot="ccw" radius="250', 'rot="left" radius="250'), r"rotation 'left'; it must be cw or ccw"),
    (("-5764.59435677 -16511.51399200 88.79745221</Start>", "-5764.5 -16511.5</Start>"), r"off by|ends 0\.\d+ m from"),
    (("<Start name=\"BP\">-5851", "<Start name=\"BP\">x-5851"), r"Start of a Line is 'x-5851.* not northing and easting"),
    (('linearUnit="meter"', 'linearUnit="fathom"'), r"unknown unit, 'fathom'; give it by --axis-unit"),
    (('staStart="-90.00000000"', 'staStart="minus"'), r"staStart of a Alignment is 'minus', not a number"),
    (("<PVI>-90.00000000 90.90600001</PVI>", "<PVI>-90</PVI>"), r"a PVI of the profile is '-90', not station and height"),
    (("<PVI>-90.00000000 ", "<PVI>390.00000000 "), r"the profile reverses"),
    (('<ParaCurve length="80.000000">', '<ParaCurve length="580.0">'), r"curves of the profile overlap by 20\.000 m"),
    (('<ParaCurve length="80.000000">', '<ParaCurve length="-80.0">'), r"length of a ParaCurve is '-80\.0'; it must not"),
    (('length="62.50000000" radiusStart="INF"', 'length="-62.5" radiusStart="INF"'), r"length of a Spiral is '-62\.5'; it"),
    (('length="62.50000000"', 'length="0"'), r"distance of its ends of the Spiral .* off by 62\.\d+ m"),
    (("<PVI>-90.00000000 90.90600001</PVI>", "<PVI>-90 NaN</PVI>"), r"a PVI of the profile is '-90 NaN', not station and"),
    (('<Start name="BP">-5851.24470669', '<Start name="BP">-INF'), r"Start of a Line is '-INF .*', not northing and easting"),
    (("<Center>-5611.00629049 -16712.04332769<", "<Center>-5709.42743874 -16482.23193203<"), r"radius of the Curve .* is off"),
    (("encoding='utf-8'", "encoding='Shift_JIS'"), r"cannot be read as XML: multi-byte encodings .*; save it as UTF-8"),
    (("encoding='utf-8'", "encoding='sjis-2004-x'"), r"cannot be read as XML: .*sjis-2004-x.*; save it as UTF-8"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "message"), BROKEN, ids=[message[:24] for _, message in BROKEN])
def test_a_broken_landxml_is_refused(tmp_path: Path, change: tuple[str, str], message: str) -> None:
    path = edited(tmp_path, "j-landxml.xml", change)
    with pytest.raises(UserError, match=message) as caught:
        read_given(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


BEND = '<Spiral length="62.50000000" radiusStart="INF"'
POINT = "-5764.59435677 -16511.51399200"
BEHIND = "-5764.59521982 -16511.51449725"  # 1 mm before it, on the line that leads there
EMPTY = {
    "spiral": f'<Spiral length="0" radiusEnd="250" rot="cw"><Start>{POINT}</Start><PI/><End>{POINT}</End></Spiral>',
    "centre": f'<Curve rot="cw"><Start>{POINT}</Start><Center>{POINT}</Center><End>{POINT}</End></Curve>',
    "behind": f'<Curve rot="cw"><Start>{POINT}</Start><Center>-5814.9 -16425.4</Center><End>{BEHIND}</End></Curve>',
}


@pytest.mark.parametrize("element", EMPTY.values(), ids=EMPTY)
def test_an_element_without_length_is_passed_over(tmp_path: Path, element: str) -> None:
    path = edited(tmp_path, "j-landxml.xml", (BEND, element + BEND))
    assert LandXml(path).design(0, 0).plan == landxml("j-landxml.xml").plan
    read_given(path)


def test_a_parabola_on_one_side_only_is_no_curve(tmp_path: Path) -> None:
    curve = '<ParaCurve length="80.000000">300.00000029 82.71600000</ParaCurve>'
    one_sided = '<UnsymParaCurve lengthIn="0" lengthOut="40">300.00000029 82.71600000</UnsymParaCurve>'
    design = LandXml(edited(tmp_path, "j-landxml.xml", (curve, one_sided))).design(0, 0)
    design.check()
    bent = LandXml(edited(tmp_path, "j-landxml.xml", (curve, "<PVI>300.00000029 82.71600000</PVI>"))).design(0, 0)
    assert design.profile == bent.profile


def test_no_profile_no_axis(tmp_path: Path) -> None:
    path = edited(tmp_path, "j-landxml.xml", ("<ProfAlign ", "<Nothing "), ("</ProfAlign>", "</Nothing>"))
    with pytest.raises(UserError, match="has no profile, but a tunnel's axis needs heights"):
        read_given(path)


def test_one_of_several_alignments(tmp_path: Path) -> None:
    path = edited(tmp_path, "j-landxml.xml", ("</Alignments>", f"{SECOND}</Alignments>"))
    assert read_given(path, alignment="B").source == "j-landxml.xml: B"
    with pytest.raises(UserError, match="holds no alignment 'C'; it has '○○路線', 'B'"):
        read_given(path, alignment="C")


def test_points_by_reference_and_other_encodings(tmp_path: Path) -> None:
    """A point may refer to a CgPoint; a file may be in UTF-16, as some programs write it."""
    start = '<Start name="BP">-5851.24470669 -16562.24159873 90.90600001</Start>'
    path = edited(
        tmp_path, "j-landxml.xml", (start, '<Start pntRef="BP (NO.-4-10)"/>'), ("encoding='utf-8'", "encoding='utf-16'")
    )
    path.write_bytes(path.read_text().encode("utf-16"))
    np.testing.assert_allclose(read_given(path).xyz, read_given(DATA / "j-landxml.xml").xyz, atol=1e-7)


def test_a_surface_of_any_size_is_passed_over(tmp_path: Path) -> None:
    surface = "<Surfaces><Surface><Pnts>" + '<P id="1">1 2 3</P>' * 1000 + "</Pnts></Surface></Surfaces>"
    path = edited(tmp_path, "j-landxml.xml", ("<Alignments>", f"{surface}<Alignments>"))
    assert len(read_given(path).xyz) == len(read_given(DATA / "j-landxml.xml").xyz)


def test_cross_sections_of_an_alignment_are_not_kept(tmp_path: Path) -> None:
    section = '<CrossSect sta="1"><CrossSectSurf>' + "<PntList2D>1 2</PntList2D>" * 20 + "</CrossSectSurf></CrossSect>"
    path = edited(tmp_path, "j-landxml.xml", ("</Alignment>", f"<CrossSects>{section * 2000}</CrossSects></Alignment>"))
    tracemalloc.start()
    try:
        file = LandXml(path)
        assert tracemalloc.get_traced_memory()[1] < path.stat().st_size
    finally:
        tracemalloc.stop()
    assert file.design(0, 0).plan == landxml("j-landxml.xml").plan


def test_start_chainage_moves_the_chainage_and_not_the_stations() -> None:
    given = read_given(DATA / "j-landxml.xml", start=5000.0)
    assert given.design is not None
    assert (given.start, given.design.pieces[0].station) == (5000.0, -90.0)


# --- IFC --------------------------------------------------------------------------------------------------------------


@pytest.fixture
def ifc() -> Any:
    pytest.importorskip("ifcopenshell")
    import ifcopenshell

    return ifcopenshell.open(DATA / "aplitop-3.ifc")


def written(file: Any, tmp_path: Path) -> Path:
    path = tmp_path / "alignment.ifc"
    file.write(str(path))
    return path


def referents(file: Any, *stations: tuple[float, float, bool | None]) -> None:
    """Give the alignment stationing by ifcopenshell's own function: distance along, station, increasing."""
    import ifcopenshell.api.alignment as api

    (alignment,) = file.by_type("IfcAlignment")
    api.create_representation(file, alignment)
    for distance, station, increasing in stations:
        api.add_stationing_referent(file, str(station), alignment, distance, station, has_increasing_station=increasing)


def test_referents_give_the_stations(ifc: Any, tmp_path: Path) -> None:
    referents(ifc, (0.0, 1000.0, None), (100.0, 1100.0, None), (200.0, 1250.0, None), (300.0, 1300.0, None))
    design = read_given(written(ifc, tmp_path)).design
    assert design is not None
    assert design.start == 1000.0
    # 100 m on is no equation; at 200 m stations jump ahead by 50 m, at 300 m back by 50 m
    assert design.pieces == (StationPiece(0.0, 1000.0), StationPiece(200.0, 1250.0), StationPiece(300.0, 1300.0))


def test_stations_that_only_begin_elsewhere_are_the_chainage(ifc: Any, tmp_path: Path) -> None:
    referents(ifc, (0.0, 12_300.0, None))
    design = read_given(written(ifc, tmp_path)).design
    assert design is not None
    assert (design.start, design.pieces) == (12_300.0, ())


def test_stations_that_run_backwards(ifc: Any, tmp_path: Path) -> None:
    referents(ifc, (0.0, 900.0, False))
    design = read_given(written(ifc, tmp_path)).design
    assert design is not None
    assert (design.start, design.pieces) == (0.0, (StationPiece(0.0, 900.0, -1),))


def test_map_conversion_and_placement_put_the_alignment_on_the_map(ifc: Any, tmp_path: Path) -> None:
    """Turned by 30° and shifted by the map conversion, after a shift by its placement; in kilometres of the map."""
    from tunneldb.alignment.ifc import Ifc

    plain = Ifc(DATA / "aplitop-3.ifc").design(0, 0)
    ifc.by_type("IfcAlignment")[0].ObjectPlacement.RelativePlacement.Location.Coordinates = (100.0, 20.0, 3.0)
    kilometre = ifc.createIfcSIUnit(None, "LENGTHUNIT", "KILO", "METRE")
    crs = ifc.createIfcProjectedCRS("EPSG:25830", None, None, None, None, None, kilometre)
    context = ifc.by_type("IfcGeometricRepresentationContext")[0]
    ifc.createIfcMapConversion(context, crs, 400.0, 4000.0, 0.5, math.cos(math.pi / 6), 0.5, 0.001)
    design = Ifc(written(ifc, tmp_path)).design(0, 0)
    at = np.linspace(0, 500, 40)
    x, y, z = (plain.position(at) + np.array([100.0, 20.0, 3.0])).T
    c, s = math.cos(math.pi / 6), 0.5
    expected = np.column_stack([400_000 + c * x - s * y, 4_000_000 + s * x + c * y, 500 + z])
    np.testing.assert_allclose(design.position(at), expected, rtol=0, atol=1e-5)
    assert "the file states its coordinate system as EPSG:25830" in design.notes


def test_a_scaled_map_is_refused(ifc: Any, tmp_path: Path) -> None:
    context = ifc.by_type("IfcGeometricRepresentationContext")[0]
    crs = ifc.createIfcProjectedCRS("EPSG:25830")
    ifc.createIfcMapConversion(context, crs, 0.0, 0.0, 0.0, 1.0, 0.0, 0.9996)
    with pytest.raises(UserError, match=r"scale 0\.9996, so map lengths differ from the alignment's"):
        read_given(written(ifc, tmp_path))


def test_other_curves_and_other_schemas_are_refused(ifc: Any, tmp_path: Path) -> None:
    ifc.by_type("IfcAlignmentHorizontalSegment")[2].PredefinedType = "BLOSSCURVE"
    path = written(ifc, tmp_path)
    with pytest.raises(UserError, match="segment of type BLOSSCURVE; supported are LINE, CIRCULARARC, CLOTHOID"):
        read_given(path)
    path.write_text(path.read_text().replace("IFC4X3_ADD2", "IFC2X3"))
    with pytest.raises(UserError, match=r"has the schema IFC2X3; alignments need IFC 4\.3"):
        read_given(path)
    path.write_text("ISO-10303-21;\nHEADER;\n")
    with pytest.raises(UserError, match="its header states no schema"):
        read_given(path)


def test_the_first_release_of_ifc_4_3_is_read(tmp_path: Path) -> None:
    pytest.importorskip("ifcopenshell")
    path = edited(tmp_path, "aplitop-3.ifc", ("IFC4X3_ADD2", "IFC4X3"))
    np.testing.assert_array_equal(read_given(path).xyz, read_given(DATA / "aplitop-3.ifc").xyz)
