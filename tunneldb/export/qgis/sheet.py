"""The print layout "Inspection sheets": an atlas with a sheet for each 50 m of tunnel."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from tunneldb import __version__
from tunneldb.export.qgis.extent import Extent
from tunneldb.export.qgis.layer import SHEETS
from tunneldb.export.qgis.layout_items import (
    CELL_MARGIN,
    FRAME,
    MAP_ITEM,
    PAGE,
    PAGE_ITEM,
    ROW,
    SCALE_BAR,
    cut,
    item,
    key,
    label,
    table,
    text_style,
    unless,
)  # fmt: skip
from tunneldb.raster.gap_fill import TOLD
from tunneldb.store.survey import Survey

LENGTH = 50.0
"""Length of tunnel on a sheet, m, as in the view."""

PAGES = 6
"""The sheet itself, and those that its table goes on to if it is long."""

_SCALES = (200, 250, 300, 400, 500, 750, 1000)
_MARGIN = 10.0
_TOP = 24.0  # where the strip begins, mm
_TABLE_LEAST = 40.0  # what is kept for the table, mm
_FOOT = 196.0  # where the foot begins, mm

CLOCK = (
    "with_variable('minutes', round(\"clock\" * 60) % 720, to_string(if(@minutes < 60, 12, floor(@minutes / 60))) || ':' "
    "|| lpad(to_string(@minutes % 60), 2, '0'))"
)
"""A clock position as `tunneldb.export.tables.leaks.clock_label` writes it, which QGIS can't call; the styles have it too."""

_SHEET = "attribute(@atlas_feature, '{}')"
_TICK = "(@grid_number - attribute(@atlas_feature, 'chainage_from')) / 10"
# Stations are the tunnel's own and may jump: they come with the sheet, a label each 10 m.
_CHAINAGE_LABEL = (
    f"if(@grid_axis = 'x' and round({_TICK}) >= 0 and round({_TICK}) <= 5, "
    f"array_get(attribute(@atlas_feature, 'ticks'), round({_TICK})), '')"
)
_ARC_LABEL = "if(@grid_axis = 'y', to_string(round(@grid_number)), '')"


# Heading, expression, width in mm, alignment (1 left, 2 right), what rows are sorted by.
_COLUMNS = (
    ("Leak", 'to_string("id")', 11, 2),
    ("Chainage", '"label"', 19, 2),
    ("Arc, m", 'format_number(("arc_from" + "arc_to") / 2, 1)', 10, 2),
    ("Clock", CLOCK, 9, 2),
    ("Area, m²", 'format_number("area", 2)', 12.5, 2),
    ("Drop, dB", 'format_number("drop_mean", 1)', 12.5, 2),
    ("Sure", "coalesce(round(100 * \"confidence\") || ' %', '')", 9, 2),
    ("Review", '"review"', 15, 1),
    ("Remark", cut('"remark"', "{0}"), 23, 1),
)
# As the sheet's sums count them: one that only touches its edge is not on it.
_ON_SHEET = f'"chainage_to" > {_SHEET.format("chainage_from")} and "chainage_from" < {_SHEET.format("chainage_to")}'
_LINE_LEAST, _LINE = 10, 12  # letters that a line of a remark holds at the least, and of several, which break between words
_TABLE_WIDTH = sum(column[2] + 2 * CELL_MARGIN for column in _COLUMNS)


def strip_scale(extent: Extent, *, table: bool) -> int:
    """Return the number of the scale at which a sheet's strip leaves room for its table, if it has one."""
    room = _FOOT - _TOP - (_TABLE_LEAST if table else 0.0) - 8.0
    height = extent.ymax - extent.ymin
    return next((scale for scale in _SCALES if height * 1000.0 / scale <= room), _SCALES[-1])


def table_rows(top: float) -> int:
    """Return how many rows of one line a sheet's table has room for, which begins on its first page at ``top``, mm."""
    return sum(2 * (int((_FOOT - 1 - y) / ROW) - 1) for y in (top, *(PAGES - 1) * [_TOP]))


def sheet_layout(survey: Survey, extent: Extent, coverage: tuple[str, str], leaks: tuple[str, str]) -> ET.Element:
    """Return the element ``Layout`` of the inspection sheets.

    Parameters
    ----------
    survey : Survey
        The survey.
    extent : Extent
        One of the sheets, m; all are of this height.
    coverage, leaks : (str, str)
        Id and data source of the layer of the sheets, and of the layer whose rows their tables list.
    """
    sought = survey.intensity_kind != "none"  # else no leaks were, and there is no table of them
    pages = PAGES if sought else 1
    layout = ET.Element("Layout", name=SHEETS, units="mm", printResolution="300")
    collection = ET.SubElement(layout, "PageCollection")
    for page in range(pages):
        collection.append(item(SHEETS, PAGE_ITEM, f"page {page + 1}", (0.0, 0.0, *PAGE), page, background="true"))
    scale = strip_scale(extent, table=sought)
    strip = _strip(scale, extent)
    top = _TOP + (extent.ymax - extent.ymin) * 1000.0 / scale + 8.0  # of the table
    layout.append(strip)
    layout.extend(_texts(survey, scale, pages))
    layout.append(_scale_bar(strip.attrib["uuid"]))
    if sought:
        layout.extend(_table(leaks, top))
        layout.append(_more(table_rows(top)))
    ET.SubElement(
        layout, "Atlas", enabled="1", coverageLayer=coverage[0], coverageLayerSource=coverage[1],
        coverageLayerProvider="postgres", coverageLayerName=SHEETS, hideCoverage="1", sortFeatures="1", sortAscending="1",
        sortKey='"number"', pageNameExpression='"label_from"', filterFeatures="0",
        filenamePattern=f"'{survey.name}-' || \"label_from\"",
    )  # fmt: skip
    options = ET.SubElement(ET.SubElement(layout, "customproperties"), "Option", type="Map")
    ET.SubElement(options, "Option", type="bool", name="singleFile", value="true")
    ET.SubElement(options, "Option", type="int", name="pdfTextFormat", value="1")  # text that can be searched, not outlines
    return layout


def _strip(scale: int, extent: Extent) -> ET.Element:
    """The unrolled lining of the sheet, from edge to edge as its table, under a grid of 10 m by 2 m."""
    width, height = LENGTH * 1000.0 / scale, (extent.ymax - extent.ymin) * 1000.0 / scale
    element = item(
        SHEETS, MAP_ITEM, "strip", ((PAGE[0] - width) / 2 + 4, _TOP, width, height), frame="true", background="true",
        followPreset="true",
        followPresetName=SHEETS, mapRotation="0", drawCanvasItems="false", labelMargin="0,mm", keepLayerSet="false",
    )  # fmt: skip
    sides = {"xmin": extent.xmin, "xmax": extent.xmax, "ymin": extent.ymin, "ymax": extent.ymax}
    ET.SubElement(element, "Extent", {side: repr(value) for side, value in sides.items()})
    element.append(_grid("chainage", "10", "0", _CHAINAGE_LABEL, bottom=True))
    element.append(_grid("arc", "0", "2", _ARC_LABEL, bottom=False))
    # Scaling 0 keeps the strip's scale; 1 would choose among those of the designer, from 1:500, as soon as it is open.
    ET.SubElement(element, "AtlasMap", atlasDriven="1", scalingMode="0", margin="0")
    return element


def _grid(name: str, x: str, y: str, label: str, *, bottom: bool) -> ET.Element:
    """Lines at multiples of x and y metres, labelled on one side; the sides are shown in QGIS' numbers."""
    shown, hidden = "0", "3"
    labelled = "bottom" if bottom else "left"
    sides: dict[str, str] = {}
    for side in ("left", "right", "top", "bottom"):
        sides |= {f"{side}AnnotationDisplay": shown if side == labelled else hidden, f"{side}AnnotationPosition": "1"}
    element = ET.Element(
        "ComposerMapGrid", sides, name=name, uuid=key(SHEETS, f"grid {name}"), show="1",
        position="3", gridStyle="0", unit="0", intervalX=x, intervalY=y, offsetX="0", offsetY="0", blendMode="0",
        showAnnotation="1", annotationFormat="8", annotationExpression=label, annotationPrecision="0",
        frameAnnotationDistance="1", gridFrameStyle="0",
    )  # fmt: skip
    line = ET.SubElement(ET.SubElement(element, "lineStyle"), "symbol", type="line", name="", alpha="1", clip_to_extent="1")
    layer = ET.SubElement(line, "layer", {"class": "SimpleLine", "enabled": "1", "pass": "0", "locked": "0"})
    style = ET.SubElement(layer, "Option", type="Map")
    for option, value in (("line_color", "0,120,130,110"), ("line_width", "0.12"), ("line_width_unit", "MM")):
        ET.SubElement(style, "Option", type="QString", name=option, value=value)
    element.append(text_style(7.0))
    return element


def _texts(survey: Survey, scale: int, pages: int) -> list[ET.Element]:
    """Head and foot of the sheet, and heads of the pages on which its table goes on."""
    stretch = "[% {} %] – [% {} %]".format(_SHEET.format("label_from"), _SHEET.format("label_to"))
    number = "[% @atlas_featurenumber %] of [% @atlas_totalfeatures %]"
    left, right, wide = _MARGIN, PAGE[0] - _MARGIN, PAGE[0] - 2 * _MARGIN
    what = f"Tunnel {survey.tunnel}, survey {survey.name} of {survey.date:%Y-%m-%d}"
    lining, seen, leaks, wet, gaps = (
        _SHEET.format(name) for name in ("lining_area", "seen_share", "leaks", "wet_area", "gaps")
    )
    sums = (
        f"Lining [% coalesce(format_number({lining}, 0) || ' m², ' || format_number(100 * {seen}, 1) || ' % of it seen',"
        f" 'not seen yet') %]; leaks [% coalesce({leaks} || ', ' || format_number({wet}, 2) || ' m²', 'not searched for') %]"
    )
    how = f"Unrolled lining from inside, 1:{scale} on A4; up it arc from the crown, m, right wall above; {TOLD}. "
    if survey.intensity_kind == "none":
        sums = "No intensity: leaks were not sought"
        how += "Red: inwards, blue: outwards."
    else:
        how += "Orange: open, blue: confirmed, with the leak's number; purple: leaks could be missed."
    texts = [
        label(SHEETS, "stretch", stretch, (left, 5, 150, 8), 15, bold=True),
        label(SHEETS, "number", f"Inspection sheet {number}", (right - 110, 5, 110, 8), 10, align="right"),
        label(SHEETS, "what", what, (left, 12.5, 140, 5), 8),
        label(SHEETS, "sums", sums, (right - 140, 12.5, 140, 5), 8, align="right"),
        label(SHEETS, "how", how, (left + 60, _FOOT + 1, wide - 60, 4), 6.5, align="right"),
        label(
            SHEETS, "signature", "Inspected by ______________________________   on ____________________",
            (left + 55, _FOOT + 6, wide - 55 - 60, 5), 8,
        ),
        label(
            SHEETS, "made", f"tunneldb {__version__}, [% format_date(now(), 'yyyy-MM-dd') %]",
            (right - 60, _FOOT + 6, 60, 5), 6.5, align="right",
        ),
    ]  # fmt: skip
    if survey.intensity_kind != "none":
        texts.append(label(SHEETS, "gaps", f"[% {cut(gaps, 170, ' (all: report)')} %]", (left, 17, wide, 3.5), 7, bold=True))
    texts.append(
        label(SHEETS, "remarks", f"[% {cut(_SHEET.format('remarks'), 205, ' (all: report)')} %]", (left, 20.5, wide, 3.5), 6.5)
    )
    for page in range(1, pages):
        texts += [
            label(SHEETS, f"stretch {page + 1}", f"{stretch}, leaks continued", (left, 7, 150, 8), 12, page=page, bold=True),
            label(
                SHEETS,
                f"number {page + 1}",
                f"Inspection sheet {number}",
                (right - 110, 7, 110, 8),
                10,
                page=page,
                align="right",
            ),
            label(SHEETS, f"what {page + 1}", what, (left, 15.5, 140, 5), 8, page=page),
        ]
    return texts


def _fits(layer: str, rows: int) -> str:
    """Return the expression that a sheet's leaks surely need no more rows; lines broken between words are half full."""
    lines = f"1 + floor(length(coalesce(\"remark\", '')) / {_LINE // 2})"
    needed = f"aggregate(layer:='{layer}', aggregate:='sum', expression:={lines}, filter:={_ON_SHEET})"
    return f"coalesce({needed}, 0) <= {rows}"


def _more(rows: int) -> ET.Element:
    """What the last page says where there are more leaks than rows."""
    count = _SHEET.format("leaks")
    text = f"[% if({count} > {rows}, '… and ' || ({count} - {rows}) || ' more leaks: table of the report', '') %]"
    return label(SHEETS, "more", text, (_MARGIN, _FOOT + 1, 150, 6), 11, page=PAGES - 1, bold=True)


def _scale_bar(strip: str) -> ET.Element:
    element = item(
        SHEETS, SCALE_BAR, "scale bar", (_MARGIN, _FOOT, 50, 10), style="Line Ticks Up", mapUuid=strip, unitType="meters",
        unitLabel="m", numUnitsPerSegment="5", numSegments="2", numSegmentsLeft="0", numMapUnitsPerScaleBarUnit="1",
        segmentSizeMode="0", height="1.5", labelBarSpace="1", boxContentSpace="1", outlineWidth="0.2", alignment="0",
        numSubdivisions="1", minBarWidth="10", maxBarWidth="100", lineJoinStyle="miter", lineCapStyle="square",
    )  # fmt: skip
    element.append(text_style(7.0))
    return element


def _table(leaks: tuple[str, str], top: float) -> list[ET.Element]:
    """The table of leaks and its frames, two abreast on each page; what is empty is not printed, but for the first frame.

    The more leaks there are on a sheet, the less there is room for of their remarks; what is left out of one is marked.
    """
    rows = table_rows(top)
    lines = f"floor({rows} / max({_SHEET.format('leaks')}, 1))"
    letters = f"if({lines} > 1, {_LINE} * {lines}, {_LINE_LEAST})"
    own = key(SHEETS, "table")
    frames = []
    for page in range(PAGES):
        y = top if page == 0 else _TOP
        for half in range(2):
            x = _MARGIN + half * (PAGE[0] - 2 * _MARGIN - _TABLE_WIDTH)
            frames.append(
                item(
                    SHEETS, FRAME, f"leaks {2 * page + half + 1}", (x, y, _TABLE_WIDTH, _FOOT - 1 - y), page, multiFrame=own,
                    multiFrameTemplateUuid=own, hidePageIfEmpty=str(int(page > 0 and half == 0)), hideBackgroundIfEmpty="0",
                )
            )  # fmt: skip
    frames[1].append(unless(_fits(leaks[0], int((_FOOT - 1 - top) / ROW) - 1)))
    columns = [(heading, expression.format(letters), width, align) for heading, expression, width, align in _COLUMNS]
    order = '"chainage_from" + "chainage_to"'
    return [*frames, table(SHEETS, frames, leaks, columns, order, rows, _ON_SHEET, name="Leaks", touching=True)]
