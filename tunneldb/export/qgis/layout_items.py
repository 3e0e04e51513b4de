"""Items of a print layout, as QGIS writes them; lengths in mm on the page."""

from __future__ import annotations

import uuid
import xml.etree.ElementTree as ET
from collections.abc import Sequence

PAGE = (297.0, 210.0)
"""Page size A4, landscape, mm."""

GAP = 10.0
"""Distance between the pages of a layout, mm."""

FONT = "Sans Serif"

LABEL, MAP_ITEM, SCALE_BAR, FRAME, TABLE, PAGE_ITEM = 65641, 65639, 65646, 65647, 65649, 65638
"""QGIS' numbers of layout item types."""

CELL_MARGIN = 0.7
"""Margin of a cell of a table, mm."""

ROW = 4.1
"""Maximum height of a row with one line, mm; with DejaVu it is 3.9."""

Column = tuple[str, str, float, int]
"""Heading, expression, width in mm, alignment (1 left, 2 right)."""

Box = tuple[float, float, float, float]
"""Left, top, width and height on a page, mm."""


def cut(text: str, letters: int | str, more: str = "") -> str:
    """Return the expression of a text, shortened if there is not enough space, with a mark and a reference."""
    return (
        f"with_variable('said', coalesce(regexp_replace({text}, '\\\\s+', ' '), ''), "
        f"if(length(@said) > {letters}, left(@said, {letters} - 1) || '…{more}', @said))"
    )


def percent_expression(share: str) -> str:
    """Return an expression for a share in per cent with one decimal, without the sign; 100 only for all, 0 only for nothing."""
    return (
        f"if({share} >= 0.9995 and {share} < 1, '> 99.9', if({share} > 0 and {share} < 0.001, '< 0.1',"
        f" format_number(100 * {share}, 1)))"
    )


def key(layout: str, name: str) -> str:
    """Return the key of an item of a layout: the same in each project."""
    return f"{{{uuid.uuid5(uuid.NAMESPACE_OID, f'{layout} {name}')}}}"


def item(layout: str, kind: int, name: str, box: Box, page: int = 0, **more: str) -> ET.Element:
    """Return an item of a layout, on one of its pages."""
    x, y, width, height = box
    own = key(layout, name)
    element = ET.Element(
        "LayoutItem", type=str(kind), id=name, uuid=own, templateUuid=own, position=f"{x:g},{y + page * (PAGE[1] + GAP):g},mm",
        positionOnPage=f"{x:g},{y:g},mm", size=f"{width:g},{height:g},mm", referencePoint="0", visibility="1", opacity="1",
        outlineWidthM="0.2,mm",
    )  # fmt: skip
    element.attrib.update({"frame": "false", "background": "false", **more})
    ET.SubElement(element, "FrameColor", red="90", green="90", blue="90", alpha="255")
    ET.SubElement(element, "BackgroundColor", red="255", green="255", blue="255", alpha="255")
    return element


def label(
    layout: str, name: str, text: str, box: Box, size: float, *, page: int = 0, bold: bool = False,
    align: str = "left", colour: str = "20,20,20",
) -> ET.Element:  # fmt: skip
    """Return a text with expressions between ``[%`` and ``%]``; size in points, colour red, green and blue, 0 to 255."""
    element = item(
        layout, LABEL, name, box, page, labelText=text, htmlState="0", marginX="0", marginY="0",
        halign={"left": "1", "right": "2"}[align], valign="128",
    )  # fmt: skip
    ET.SubElement(element, "LabelFont", description=f"{FONT},{size:g},-1,5,{75 if bold else 50},0,0,0,0,0", style="")
    ET.SubElement(element, "FontColor", dict(zip(("red", "green", "blue"), colour.split(","), strict=True)), alpha="255")
    return element


def table(
    layout: str,
    frames: Sequence[ET.Element],
    source: tuple[str, str],
    columns: Sequence[Column],
    order: str,
    rows: int,
    condition: str,
    *,
    name: str,
    touching: bool = False,
    own: str = "table",
) -> ET.Element:
    """Return the table that goes on from frame to frame.

    Parameters
    ----------
    layout : str
        Name of the layout.
    frames : sequence of Element
        Its frames, whose key is the table's.
    source : (str, str)
        Id and data source of the layer whose rows it lists.
    columns : sequence of Column
    order : str
        Expression by which rows are sorted.
    rows : int
        Maximum number of rows.
    condition : str
        Expression: which rows.
    name : str
        Name of the layer.
    touching : bool
        True if only rows whose geometry touches that of the page are listed.
    own : str
        Name of the table in the layout, which determines its key.
    """
    own_key = key(layout, own)
    element = ET.Element(
        "LayoutMultiFrame", type=str(TABLE), uuid=own_key, templateUuid=own_key, source="0", vectorLayer=source[0],
        vectorLayerName=name, vectorLayerSource=source[1], vectorLayerProvider="postgres", maxFeatures=str(rows),
        filterToAtlasIntersection=str(int(touching)), filterFeatures="true", featureFilter=condition, resizeMode="0",
        headerMode="1",
        headerHAlignment="0", emptyTableMode="0", emptyTableMessage="", showEmptyRows="1", showUniqueRowsOnly="0",
        showOnlyVisibleFeatures="0", useConditionalStyling="0", wrapBehavior="1", wrapString="",
        cellMargin=str(CELL_MARGIN), showGrid="1", horizontalGrid="1", verticalGrid="0", gridStrokeWidth="0.1",
        gridColor="150,150,150,255", backgroundColor="255,255,255,0",
    )  # fmt: skip
    for frame in frames:
        ET.SubElement(element, "childFrame", uuid=frame.attrib["uuid"], templateUuid=frame.attrib["uuid"])
    ET.SubElement(element, "headerTextFormat").append(text_style(6.5, bold=True))
    ET.SubElement(element, "contentTextFormat").append(text_style(7.0))
    shown = ET.SubElement(element, "displayColumns")
    for heading, expression, width, align in columns:
        column(shown, heading, expression, width, align)
    column(ET.SubElement(element, "sortColumns"), "", order, 0, 1)
    return element


def column(parent: ET.Element, heading: str, expression: str, width: float, align: int) -> None:
    """Add a column to a table; width in mm, align as in `Column`."""
    ET.SubElement(
        parent, "column", heading=heading, attribute=expression, width=f"{width:g}", hAlignment=str(align), vAlignment="128",
        sortOrder="0", sortByRank="0",
    )  # fmt: skip


def text_style(size: float, *, bold: bool = False) -> ET.Element:
    """Return the style of a text; size in points."""
    return ET.Element(
        "text-style", fontFamily=FONT, namedStyle="Bold" if bold else "Regular", fontWeight="75" if bold else "50",
        fontSize=f"{size:g}", fontSizeUnit="Point", textColor="20,20,20,255", textOpacity="1", multilineHeight="1",
    )  # fmt: skip
