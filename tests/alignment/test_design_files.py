"""LandXML and IFC as programs write them: units, names and headers."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import ifcopenshell
import numpy as np
import pytest
from support.axis_files import J_LANDXML, plan_length, written

from tunneldb.alignment.given import read_given
from tunneldb.errors import UserError


def test_a_landxml_says_its_unit_or_is_asked(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    bare = J_LANDXML.read_text()
    begin, end = bare.index("<Units"), bare.index("</Units>") + len("</Units>")
    path.write_text(bare[:begin] + bare[end:])
    with pytest.raises(UserError, match=r"states no unit of lengths .* --axis-unit"):
        read_given(path)

    assert read_given(path, unit="foot").design is not None
    in_metres = plan_length(read_given(path, unit="meter"))
    assert plan_length(read_given(path, unit="foot")) == pytest.approx(0.3048 * in_metres, abs=0.001)
    assert read_given(path, unit="meter").notes[0].endswith("1 unit is 1 m, as given; the file states none")
    with pytest.raises(UserError, match="own direction"):
        read_given(path, unit="meter", reverse=True)


@pytest.mark.parametrize(
    ("written_as", "metres"), [("metre", 1.0), ("Meter", 1.0), ("feet", 0.3048), ("usSurveyFoot", 1200 / 3937)]
)
def test_units_of_a_landxml_have_several_spellings(written_as: str, metres: float, tmp_path: Path) -> None:
    bare = J_LANDXML.read_text()
    path = written(tmp_path / "a.xml", bare.replace('linearUnit="meter"', f'linearUnit="{written_as}"').encode())
    assert plan_length(read_given(path)) == pytest.approx(metres * plan_length(read_given(J_LANDXML)), abs=0.001)


def test_an_unknown_unit_of_a_landxml_is_given(tmp_path: Path) -> None:
    path = written(tmp_path / "a.xml", J_LANDXML.read_text().replace('linearUnit="meter"', 'linearUnit="ken"').encode())
    with pytest.raises(UserError, match=r"unknown unit.* 'ken'; give it by --axis-unit meter, foot, USSurveyFoot"):
        read_given(path)
    given = read_given(path, unit="meter")
    np.testing.assert_array_equal(given.xyz, read_given(J_LANDXML).xyz)
    assert given.notes[0].endswith("as given; the file states ken")


def test_alignments_of_one_name_are_numbered(tmp_path: Path) -> None:
    bare = J_LANDXML.read_text()
    begin, end = bare.index("<Alignment "), bare.index("</Alignment>") + len("</Alignment>")
    path = written(tmp_path / "a.xml", (bare[:end] + bare[begin:end] + bare[end:]).encode())
    with pytest.raises(
        UserError, match=r"holds 2 alignments: '(.*) \(1\)', '.* \(2\)'; choose one by --alignment NAME"
    ) as error:
        read_given(path)
    name = str(error.value).split("'")[3]
    np.testing.assert_array_equal(read_given(path, alignment=name).xyz, read_given(J_LANDXML).xyz)


IFC = J_LANDXML.with_name("indot-twin-branch.ifc")
HEADERS: dict[str, Callable[[str], str]] = {
    "description": lambda text: text.replace("FILE_DESCRIPTION((", "FILE_DESCRIPTION(('IFC4X3_ADD2','IFC4',", 1),
    "schema in a comment": lambda text: text.replace("HEADER;", "HEADER;\n/* made from FILE_SCHEMA(('IFC2X3')) */", 1),
    "schema in words": lambda text: text.replace("FILE_NAME('", "FILE_NAME('FILE_SCHEMA((''IFC2X3'')) it''s ", 1),
    "long comment": lambda text: text.replace("HEADER;", f"HEADER;\n/*{20_000 * ' '}*/", 1),
    "byte order mark": lambda text: "\xef\xbb\xbf" + text,
    "lower case": lambda text: re.sub(r"(FILE_SCHEMA\s*\(\(')(\w*)", lambda found: found[1] + found[2].lower(), text),
}  # fmt: skip


@pytest.mark.parametrize("kind", HEADERS)
def test_the_schema_of_an_ifc_is_that_of_its_header(kind: str, tmp_path: Path) -> None:
    text = IFC.read_text("latin-1")
    changed = HEADERS[kind](text)
    assert changed != text
    path = written(tmp_path / "a.ifc", changed.encode("latin-1"))
    np.testing.assert_array_equal(read_given(path).xyz, read_given(IFC).xyz)


def test_a_truncated_ifc_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "a.ifc", IFC.read_bytes()[:2500])
    with pytest.raises(UserError, match="is truncated: it does not end with END-ISO-10303-21; copy or export it again"):
        read_given(path)


def test_a_landxml_whose_height_lacks_its_decimal_point_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    bare = J_LANDXML.read_text()
    straight = re.sub(r" *<ParaCurve.*</ParaCurve>\n", "", bare)
    path.write_text(straight)
    assert read_given(path).xyz[:, 2].max() < 91.0
    path.write_text(straight.replace("995.94618316 75.38160000", "995.94618316 75381.60000"))
    with pytest.raises(UserError, match=r"a\.xml: at chainage .* its profile rises .* is a decimal point missing"):
        read_given(path)


def test_an_ifc_in_millimetres_is_that_in_metres(tmp_path: Path) -> None:
    source = IFC.with_name("aplitop-3.ifc")
    file = ifcopenshell.open(str(source))
    lengths = {
        "IfcAlignmentHorizontalSegment": ("StartRadiusOfCurvature", "EndRadiusOfCurvature", "SegmentLength"),
        "IfcAlignmentVerticalSegment": ("StartDistAlong", "HorizontalLength", "StartHeight", "RadiusOfCurvature"),
    }
    for kind, names in lengths.items():
        for entity in file.by_type(kind):
            for name in names:
                value = getattr(entity, name)
                setattr(entity, name, None if value is None else 1000.0 * value)
    for point in file.by_type("IfcCartesianPoint"):
        point.Coordinates = [1000.0 * value for value in point.Coordinates]
    next(unit for unit in file.by_type("IfcSIUnit") if unit.UnitType == "LENGTHUNIT").Prefix = "MILLI"
    file.write(str(tmp_path / "a.ifc"))
    given = read_given(tmp_path / "a.ifc")
    np.testing.assert_allclose(given.xyz, read_given(source).xyz, atol=1e-6)
    assert given.notes == ("lengths are converted to metres: 1 unit is 0.001 m",)


@pytest.mark.parametrize("length", ["1e9", "1e12", "1e300"])
def test_an_alignment_without_end_is_refused_before_it_is_divided(tmp_path: Path, length: str) -> None:
    path = tmp_path / "axis.xml"
    path.write_text(
        '<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2" version="1.2"><Units><Metric linearUnit="meter"/></Units>'
        f'<Alignments><Alignment name="a" length="{length}" staStart="0"><CoordGeom>'
        f'<Line length="{length}"><Start>0 0</Start><End>0 {length}</End></Line></CoordGeom><Profile><ProfAlign name="p">'
        f"<PVI>0 10</PVI><PVI>{length} 10</PVI></ProfAlign></Profile></Alignment></Alignments></LandXML>"
    )
    with pytest.raises(
        UserError, match=r"axis\.xml: .*(km long, as no tunnel is|is neither a position nor a length|is off by)"
    ):
        read_given(path)
