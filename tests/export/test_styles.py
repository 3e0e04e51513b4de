"""Styles of layers: the colours of reviews, and the columns that their expressions name."""

from __future__ import annotations

import ast
import re
import xml.etree.ElementTree as ET
from importlib import resources
from itertools import chain
from pathlib import Path

import psycopg
import pytest

from tunneldb.export.qgis.catalogue import LOOKS, Catalogue, Kind
from tunneldb.export.qgis.finding_style import finding_style
from tunneldb.export.qgis.layer import CHANGE_LAYERS, LAYERS, STRUCTURE_LAYERS
from tunneldb.export.qgis.styles import style_text
from tunneldb.finding_kind import REVIEW_COLOURS, rgb

REVIEWS = {review: ",".join(map(str, rgb(colour))) for review, colour in REVIEW_COLOURS.items()}


def outlines(root: ET.Element) -> dict[str, str]:
    """Colour of the outermost line of each category, or of a rule by its filter."""
    renderer = root.find("renderer-v2") if root.tag != "renderer-v2" else root
    assert renderer is not None
    colours = {
        symbol.get("name"): [
            option.get("value", "")
            for option in symbol.iter("Option")
            if option.get("name") in ("outline_color", "color", "line_color")
        ]
        for symbol in renderer.iter("symbol")
    }
    named = {
        entry.get("value") or entry.get("filter", ""): entry.get("symbol")
        for entry in chain(renderer.iter("category"), renderer.iter("rule"))
    }
    return {name: " ".join(colours[symbol]) for name, symbol in named.items() if symbol in colours}


@pytest.mark.parametrize("style", ["leak", "leak_3d", "leak_sheet", "spot", "spot_3d"])
def test_a_review_has_one_colour_in_all_styles(style: str) -> None:
    found = outlines(ET.fromstring(style_text(style)))
    assert found
    for name, colours in found.items():
        assert f"{REVIEWS[name.split()[-1]]},255" in colours, name


def test_a_review_has_that_colour_in_space() -> None:
    root = ET.fromstring(style_text("leak_3d"))
    for rule in root.iterfind("renderer-3d/rules/rule"):
        material = rule.find(".//material")
        review = rule.get("description", "").lower()
        assert material is not None
        if review in ("open", "confirmed"):
            assert material.get("diffuse") == f"{REVIEWS[review]},255"


@pytest.mark.parametrize("geometry", ["Polygon", "Line", "Point"])
def test_leaks_among_findings_have_the_colours_of_their_reviews(geometry: str) -> None:
    shapes = ("polygon", "line", "point")
    kinds = tuple(Kind(code, code, shapes, LOOKS[code], code in ("leak", "drip")) for code in ("leak", "drip", "crack"))
    catalogue = Catalogue(kinds, dict.fromkeys((1, 2, 3, 4), "x"), 50.0)
    flat, _, solid = finding_style(catalogue, geometry, in_space=True)
    for kind in ("leak", "drip"):
        for review in ("open", "confirmed"):
            condition = f"\"kind\" = '{kind}' AND \"review\" = '{review}'"
            assert f"{REVIEWS[review]},255" in outlines(flat)[condition]
            (rule,) = [rule for rule in solid.iter("rule") if condition in rule.get("filter", "")]
            assert f"{REVIEWS[review]},255" in ET.tostring(rule, encoding="unicode")
    assert f"{LOOKS['crack'].colour},255" in outlines(flat)["\"kind\" = 'crack'"]


def test_joints_and_dry_dark_areas_have_one_colour() -> None:
    found = outlines(ET.fromstring(style_text("dark")))
    assert all(f"{LOOKS[kind].colour},255" in found[kind] for kind in ("joint", "dark"))


def test_plugin_and_report_take_these_colours() -> None:
    plugin = Path(__file__).parents[2] / "qgis_plugin" / "tunneldb_review"
    (value,) = [
        node.value
        for node in ast.parse((plugin / "cutouts.py").read_text("utf-8")).body
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "REVIEW_COLOURS"
    ]
    assert ast.literal_eval(value) == REVIEW_COLOURS
    css = (resources.files("tunneldb.report") / "templates" / "report.css").read_text("utf-8")
    assert "in review_colours.items()" in css
    assert not re.search(r"--(open|confirmed|rejected): #", css)


def test_expressions_name_columns_of_their_view(conn: psycopg.Connection) -> None:
    for layer in (*LAYERS, *STRUCTURE_LAYERS, *CHANGE_LAYERS):
        if layer.shows_findings:
            continue
        root = ET.fromstring(style_text(layer.style))
        columns = {
            column.name for column in conn.execute(f"SELECT * FROM tunnel_api.{layer.view} LIMIT 0".encode()).description
        }
        columns |= {field.get("name") for field in root.iterfind("expressionfields/field")}
        texts = [root.findtext("mapTip") or "", root.findtext("previewExpression") or ""]
        texts = [*re.findall(r"\[%(.*?)%\]", texts[0]), texts[1]]
        named = {name for text in texts for name in re.findall(r'"(\w+)"', text)}
        assert named <= columns, (layer.id, named - columns)
