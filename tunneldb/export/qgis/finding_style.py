"""Style of findings: by kind, with a halo around severe ones; findings that do not count are switched off."""

from __future__ import annotations

import uuid
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import replace

from tunneldb.export.qgis.catalogue import HALOS, SHAPES, Catalogue, Look
from tunneldb.finding_kind import DRY as DRY_KINDS
from tunneldb.finding_kind import REVIEW_COLOURS, rgb

COUNTS = 'coalesce("counted", true)'
"""Condition for findings to show: also new ones that are not saved yet."""

DRY = 'NOT "wet"'
"""Condition for findings without an outline or a number as a leak."""

_REVIEW = {review: ",".join(map(str, rgb(colour))) for review, colour in REVIEW_COLOURS.items()}
"""Colours of leaks by their review, as QGIS writes them."""

_WHITE, _GREY = "255,255,255,200", "110,110,110,255"
_UNKNOWN = Look("230,106,177")
Layer = tuple[str, dict[str, str]]
"""Layer of a symbol: its class and its properties."""


def finding_style(catalogue: Catalogue, geometry: str, *, in_space: bool, on_sheet: bool = False) -> list[ET.Element]:
    """Return the style of a layer of findings, optionally with a 3D view.

    On sheets leaks have outlines and numbers of their own: only severe ones are drawn here, and drips as points.
    """
    if on_sheet:
        return [_renderer(catalogue, geometry, on_sheet=True), _labeling(geometry, DRY)]
    drawn = [_renderer(catalogue, geometry), _labeling(geometry)]
    return [*drawn, _renderer_3d(catalogue, geometry)] if in_space else drawn


def finding_style_text(catalogue: Catalogue, geometry: str, *, in_space: bool) -> str:
    """Return the style of a layer of findings as the text of a style file."""
    root = ET.Element("qgis", styleCategories="Symbology|Labeling|Symbology3D", version="3.22.0")
    root.extend(finding_style(catalogue, geometry, in_space=in_space))
    return ET.tostring(root, encoding="unicode")


def _renderer(catalogue: Catalogue, geometry: str, *, on_sheet: bool = False) -> ET.Element:
    """Return the element ``renderer-v2`` of a layer of findings.

    Parameters
    ----------
    catalogue : Catalogue
        The owner's kinds and severities.
    geometry : str
        Point, Line or Polygon.
    on_sheet : bool
        True for a layer of the sheets, which has only visible findings.
    """
    root = ET.Element("renderer-v2", type="RuleRenderer", forceraster="0", enableorderby="0", symbollevels="0")
    rules = ET.SubElement(root, "rules", key=_key("root", geometry))
    symbols = ET.SubElement(root, "symbols")

    def rule(parent: ET.Element, label: str, condition: str, layers: Sequence[Layer], *, shown: bool = True) -> None:
        number = str(len(symbols))
        symbols.append(_symbol(number, geometry, layers))
        element = ET.SubElement(
            parent, "rule", key=_key(label, geometry), symbol=number, label=label, filter=condition
        )  # fmt: skip
        if not shown:
            element.set("checkstate", "0")

    severe = ET.SubElement(rules, "rule", key=_key("Severity", geometry), label="Severity", filter=COUNTS)
    for degree, colour in HALOS.items():
        rule(severe, f"{degree}, {catalogue.severities[degree]}", f'"severity" = {degree}', [_halo(geometry, colour)])
    kinds = ET.SubElement(rules, "rule", key=_key("Kind", geometry), label="Kind", filter=COUNTS)
    if on_sheet and geometry != "Point":
        kinds.set("filter", f"{COUNTS} AND {DRY}")
    for kind in catalogue.drawn_as(SHAPES[geometry]):
        quoted = kind.code.replace("'", "''")
        condition, layers = f"\"kind\" = '{quoted}'", _layers(geometry, kind.look)
        if kind.wet:
            for review in ("open", "confirmed"):
                look = replace(kind.look, colour=_REVIEW[review])
                rule(kinds, f"{kind.label}, {review}", f"{condition} AND \"review\" = '{review}'", _layers(geometry, look))
            continue
        if kind.code in DRY_KINDS and not on_sheet:
            rule(kinds, f"{kind.label}, as detected", f'{condition} AND NOT "manual"', layers, shown=False)
        else:
            rule(kinds, kind.label, condition, layers)
    rule(kinds, "Of another kind", "ELSE", _layers(geometry, _UNKNOWN))
    if on_sheet:
        return root
    rule(rules, "Does not count (rejected, merged …)", f"NOT {COUNTS}", [_pale(geometry)], shown=False)
    return root


def _labeling(geometry: str, condition: str = COUNTS) -> ET.Element:
    """Return the element ``labeling``: the number, from 1:4000 on, of findings that count, or that meet a condition."""
    root = ET.Element("labeling", type="simple")
    settings = ET.SubElement(root, "settings", calloutType="simple")
    style = ET.SubElement(
        settings, "text-style", fieldName='"id"', isExpression="1", fontFamily="Sans Serif", namedStyle="Bold", fontWeight="75",
        fontSize="8", fontSizeUnit="Point", textColor="30,30,30,255", textOpacity="1", multilineHeight="1", allowHtml="0",
    )  # fmt: skip
    ET.SubElement(
        style, "text-buffer", bufferDraw="1", bufferSize="0.8", bufferSizeUnits="MM", bufferColor="255,255,255,230",
        bufferOpacity="1", bufferJoinStyle="128", bufferNoFill="1",
    )  # fmt: skip
    ET.SubElement(style, "background", shapeDraw="0")
    ET.SubElement(style, "shadow", shadowDraw="0")
    placement = {"Polygon": "8", "Line": "2", "Point": "1"}[geometry]  # outside; along; beside
    ET.SubElement(
        settings, "placement", placement=placement, dist="1.2", distUnits="MM", polygonPlacementFlags="3", placementFlags="10",
        quadOffset="5", xOffset="2.6", yOffset="0", offsetUnits="MM", priority="8",
    )  # fmt: skip
    ET.SubElement(
        settings, "rendering", scaleVisibility="1", scaleMin="0", scaleMax="4000", obstacle="1", obstacleFactor="1",
        displayAll="0", drawLabels="1", upsidedownLabels="0", fontLimitPixelSize="0", mergeLines="0", limitNumLabels="0",
        minFeatureSize="0",
    )  # fmt: skip
    shown = {"name": "", "properties": {"Show": {"active": True, "expression": condition, "type": 3}}, "type": "collection"}
    ET.SubElement(settings, "dd_properties").append(options(shown))
    return root


def _renderer_3d(catalogue: Catalogue, geometry: str) -> ET.Element:
    """Return the element ``renderer-3d``: findings that count, by kind."""
    root = ET.Element("renderer-3d", type="rulebased")
    ET.SubElement(root, "vector-layer-3d-tiling", {"show-bounding-boxes": "0", "zoom-levels-count": "3"})
    rules = ET.SubElement(root, "rules", key=_key("3d", geometry))
    for kind in catalogue.drawn_as(SHAPES[geometry]):
        quoted = kind.code.replace("'", "''")
        looks = {f" AND \"review\" = '{review}'": _REVIEW[review] for review in ("open", "confirmed")}
        for condition, colour in (looks if kind.wet else {"": kind.look.colour}).items():
            rule = ET.SubElement(
                rules, "rule", key=_key("3d" + kind.code + condition, geometry), description=kind.label,
                filter=f"\"counted\" AND \"kind\" = '{quoted}'{condition}",
            )  # fmt: skip
            rule.append(_solid(geometry, f"{colour},255"))
    return root


def options(value: object, name: str = "") -> ET.Element:
    """Return a value, which may be a dict or a list of values, as QGIS writes it: an element ``Option`` with its type."""
    named = {"name": name} if name else {}
    if isinstance(value, dict):
        element = ET.Element("Option", {"type": "Map"} | named)
        element.extend(options(part, key) for key, part in value.items())
        return element
    if isinstance(value, bool):
        return ET.Element("Option", {"type": "bool", "value": str(value).lower()} | named)
    if isinstance(value, (int, float)):
        return ET.Element("Option", {"type": "int" if isinstance(value, int) else "double", "value": str(value)} | named)
    if isinstance(value, str):
        return ET.Element("Option", {"type": "QString", "value": value} | named)
    assert isinstance(value, list)
    element = ET.Element("Option", {"type": "List"} | named)
    element.extend(options(part) for part in value)
    return element


def _key(label: str, geometry: str) -> str:
    return f"{{{uuid.uuid5(uuid.NAMESPACE_OID, f'tunneldb finding {geometry} {label}')}}}"


def _symbol(name: str, geometry: str, layers: Sequence[Layer]) -> ET.Element:
    kind = {"Polygon": "fill", "Line": "line", "Point": "marker"}[geometry]
    symbol = ET.Element("symbol", name=name, type=kind, alpha="1", clip_to_extent="1", force_rhr="0")
    for what, properties in layers:
        layer = ET.SubElement(symbol, "layer", {"class": what, "enabled": "1", "locked": "0", "pass": "0"})
        layer.append(options(dict(properties)))
    return symbol


def _line(colour: str, width: float, pen: str = "solid") -> Layer:
    return "SimpleLine", {
        "line_color": colour, "line_width": str(width), "line_width_unit": "MM", "line_style": pen, "joinstyle": "round",
        "capstyle": "round" if pen == "solid" else "flat",
    }  # fmt: skip


def _marker(name: str, colour: str, size: float, edge: str, edge_width: float) -> Layer:
    return "SimpleMarker", {
        "name": name, "color": colour, "size": str(size), "size_unit": "MM", "outline_color": edge,
        "outline_width": str(edge_width), "outline_width_unit": "MM", "outline_style": "solid", "joinstyle": "round",
    }  # fmt: skip


def _layers(geometry: str, look: Look) -> list[Layer]:
    """Return the symbol of a kind, with a white rim for dark lining."""
    colour = f"{look.colour},255"
    if geometry == "Point":
        return [_marker(look.marker, colour, 3.6, "255,255,255,255", 0.4)]
    if geometry == "Line":
        return [_line(_WHITE, 1.5), _line(colour, 0.7, look.pen)]
    brush = f"{look.colour},{45 if look.fill == 'solid' else 150}"
    fill = {
        "color": brush, "style": look.fill, "outline_color": colour, "outline_style": "solid", "outline_width": "0.5",
        "outline_width_unit": "MM", "joinstyle": "round",
    }  # fmt: skip
    return [_line(_WHITE, 0.9), ("SimpleFill", fill)]


def _halo(geometry: str, colour: str) -> Layer:
    if geometry == "Point":
        return _marker("circle", f"{colour},150", 6.5, f"{colour},255", 0.2)
    return _line(f"{colour},170", 2.4 if geometry == "Line" else 2.0)


def _pale(geometry: str) -> Layer:
    return _marker("circle", "0,0,0,0", 2.6, _GREY, 0.3) if geometry == "Point" else _line(_GREY, 0.4, "dash")


def _solid(geometry: str, colour: str) -> ET.Element:
    """Return the symbol of a kind in space; points are spheres of 0.15 m."""
    if geometry == "Line":
        symbol = ET.Element("symbol", type="line", material_type="simpleline")
        ET.SubElement(
            symbol, "data", {
                "alt-clamping": "absolute", "alt-binding": "vertex", "offset": "0", "extrusion-height": "0",
                "simple-lines": "1", "width": "5",
            },
        )  # fmt: skip
        ET.SubElement(symbol, "material", ambient=colour)
        return symbol
    if geometry == "Point":
        symbol = ET.Element("symbol", type="point", shape="sphere", material_type="phong")
        ET.SubElement(symbol, "data", {"alt-clamping": "absolute"})
        ET.SubElement(symbol, "material", ambient=colour, diffuse=colour, specular="0,0,0,255", shininess="0")
        ET.SubElement(symbol, "shape-properties").append(options({"radius": 0.15}))
        ET.SubElement(symbol, "transform", matrix="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1")
        return symbol
    symbol = ET.Element("symbol", type="polygon", material_type="phong")
    ET.SubElement(
        symbol, "data", {
            "alt-clamping": "absolute", "alt-binding": "vertex", "height": "0", "extrusion-height": "0",
            "culling-mode": "no-culling", "invert-normals": "0", "add-back-faces": "1", "rendered-facade": "3",
        },
    )  # fmt: skip
    ET.SubElement(symbol, "material", ambient=colour, diffuse=colour, specular="0,0,0,255", shininess="0")
    ET.SubElement(symbol, "edges", enabled="1", width="2", color="40,40,40,255")
    return symbol
