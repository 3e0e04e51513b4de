"""The print layout "Inspection sheets": an atlas with a sheet for each 50 m of tunnel."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence

from tunneldb import __version__
from tunneldb.export.qgis.catalogue import HALOS, Catalogue
from tunneldb.export.qgis.extent import Extent
from tunneldb.export.qgis.layer import SHEETS
from tunneldb.export.qgis.layout_items import (
    MAP_ITEM,
    PAGE,
    PAGE_ITEM,
    SCALE_BAR,
    cut,
    item,
    key,
    label,
    percent_expression,
    text_style,
)
from tunneldb.export.qgis.sheet_tables import (
    FINDING_PAGES,
    FINDINGS,
    FOOT,
    LEAK_PAGES,
    LEAKS,
    MARGIN,
    ON_PAGE,
    TOP,
    Frames,
    sheet_table,
    table_width,
)
from tunneldb.finding_kind import DETECTED
from tunneldb.raster.gap_fill import FILL_NOTE
from tunneldb.store.survey import Survey

LENGTH = 50.0
"""Length of tunnel on a sheet, m, as in the view."""

_SCALES = (200, 250, 300, 400, 500, 750, 1000)
_TABLE_LEAST = 36.5  # what is kept for the tables, mm
_BELOW = 11.5  # between the strip and the tables: ticks, colours, what does not count, mm
_LINE = 3.5  # height of a line, mm

_TICK = "(@grid_number - attribute(@atlas_feature, 'chainage_from')) / 10"
# Stations are the tunnel's own and may jump: they come with the sheet, a label each 10 m.
_CHAINAGE_LABEL = (
    f"if(@grid_axis = 'x' and round({_TICK}) >= 0 and round({_TICK}) <= 5, "
    f"array_get(attribute(@atlas_feature, 'ticks'), round({_TICK})), '')"
)
_ARC_LABEL = "if(@grid_axis = 'y', to_string(round(@grid_number)), '')"


def strip_scale(extent: Extent) -> int:
    """Return the number of the scale at which a sheet's strip leaves room for its tables."""
    room = FOOT - TOP - _TABLE_LEAST - _BELOW
    height = extent.ymax - extent.ymin
    return next((scale for scale in _SCALES if height * 1000.0 / scale <= room), _SCALES[-1])


def sheet_layout(
    survey: Survey,
    extent: Extent,
    catalogue: Catalogue,
    coverage: tuple[str, str],
    leaks: tuple[str, str],
    findings: tuple[str, str],
) -> ET.Element:
    """Return the element ``Layout`` of the inspection sheets.

    Parameters
    ----------
    survey : Survey
        The survey.
    extent : Extent
        One of the sheets, m; all are of this height.
    catalogue : Catalogue
        The owner's kinds and severities.
    coverage, leaks, findings : (str, str)
        Id and data source of the layer of the sheets, and of the layers whose rows their tables list.
    """
    scale = strip_scale(extent)
    below = TOP + (extent.ymax - extent.ymin) * 1000.0 / scale  # the strip's lower edge, mm
    leak_pages = LEAK_PAGES if survey.intensity_kind != "none" else 0  # else no leaks were sought: there is no table of them
    goes_on = [*leak_pages * ["leaks"], *FINDING_PAGES * ["findings"]]
    layout = ET.Element("Layout", name=SHEETS, units="mm", printResolution="300")
    collection = ET.SubElement(layout, "PageCollection")
    for page in range(1 + len(goes_on)):
        collection.append(item(SHEETS, PAGE_ITEM, f"page {page + 1}", (0.0, 0.0, *PAGE), page, background="true"))
    strip = strip_map(scale, extent, SHEETS)
    layout.append(strip)
    layout.extend(_texts(survey, scale, goes_on))
    layout.extend(_colours(catalogue, below + _BELOW - 2 * _LINE - 0.3))
    layout.append(_left_out(below + _BELOW - _LINE - 0.3))
    layout.append(scale_bar(strip.attrib["uuid"], SHEETS))
    if leak_pages:
        layout.extend(sheet_table(LEAKS, leaks, Frames.on([0], range(1, 1 + leak_pages), below + _BELOW)))
    further = range(1 + leak_pages, 1 + len(goes_on))
    layout.extend(sheet_table(FINDINGS, findings, Frames.on([1] if leak_pages else [0, 1], further, below + _BELOW)))
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


def strip_map(scale: int, extent: Extent, theme: str) -> ET.Element:
    """Make the map of a sheet's unrolled lining in a theme, the full width of its table, with a grid of 10 m by 2 m."""
    width, height = LENGTH * 1000.0 / scale, (extent.ymax - extent.ymin) * 1000.0 / scale
    element = item(
        theme, MAP_ITEM, "strip", ((PAGE[0] - width) / 2 + 4, TOP, width, height), frame="true", background="true",
        followPreset="true",
        followPresetName=theme, mapRotation="0", drawCanvasItems="false", labelMargin="0,mm", keepLayerSet="false",
    )  # fmt: skip
    sides = {"xmin": extent.xmin, "xmax": extent.xmax, "ymin": extent.ymin, "ymax": extent.ymax}
    ET.SubElement(element, "Extent", {side: repr(value) for side, value in sides.items()})
    element.append(_grid(theme, "chainage", "10", "0", _CHAINAGE_LABEL, bottom=True))
    element.append(_grid(theme, "arc", "0", "2", _ARC_LABEL, bottom=False))
    # Scaling 0 keeps the strip's scale; 1 would choose among those of the designer, from 1:500, as soon as it is open.
    ET.SubElement(element, "AtlasMap", atlasDriven="1", scalingMode="0", margin="0")
    return element


def _grid(layout: str, name: str, x: str, y: str, label: str, *, bottom: bool) -> ET.Element:
    """Make grid lines at multiples of x and y metres, labelled on one side; sides are QGIS' numbers."""
    shown, hidden = "0", "3"
    labelled = "bottom" if bottom else "left"
    sides: dict[str, str] = {}
    for side in ("left", "right", "top", "bottom"):
        sides |= {f"{side}AnnotationDisplay": shown if side == labelled else hidden, f"{side}AnnotationPosition": "1"}
    element = ET.Element(
        "ComposerMapGrid", sides, name=name, uuid=key(layout, f"grid {name}"), show="1",
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


def _texts(survey: Survey, scale: int, goes_on: Sequence[str]) -> list[ET.Element]:
    """Make head and foot of the sheet, and heads of the continuation pages of its tables."""
    stretch = "[% {} %] – [% {} %]".format(ON_PAGE.format("label_from"), ON_PAGE.format("label_to"))
    number = "[% @atlas_featurenumber %] of [% @atlas_totalfeatures %]"
    left, right, wide = MARGIN, PAGE[0] - MARGIN, PAGE[0] - 2 * MARGIN
    what = f"Tunnel {survey.tunnel}, survey {survey.name} of {survey.date:%Y-%m-%d}"
    lining, seen, leaks, wet, gaps = (
        ON_PAGE.format(name) for name in ("lining_area", "seen_share", "leaks", "wet_area", "gaps")
    )
    sums = (
        f"Lining [% coalesce(format_number({lining}, 0) || ' m², ' || {percent_expression(seen)} || ' % of it seen',"
        f" 'not seen yet') %]; leaks [% coalesce({leaks} || ', ' || format_number({wet}, 2) || ' m²', 'not searched for') %]"
    )
    how = f"Unrolled lining from inside, 1:{scale} on A4; up it arc from the crown, m, right wall above; {FILL_NOTE}. "
    if survey.intensity_kind == "none":
        sums = "No intensity: leaks were not searched for"
        how += "Red: inwards, blue: outwards."
    else:
        how += "Orange: leaks open, blue: confirmed; purple: leaks could be missed."
    sums += f"; other findings [% coalesce({ON_PAGE.format('findings')}, 0) %]"
    texts = [
        label(SHEETS, "stretch", stretch, (left, 5, 150, 8), 15, bold=True),
        label(SHEETS, "number", f"Inspection sheet {number}", (right - 110, 5, 110, 8), 10, align="right"),
        label(SHEETS, "what", what, (left, 12.5, 140, 5), 8),
        label(SHEETS, "sums", sums, (right - 140, 12.5, 140, 5), 8, align="right"),
        label(SHEETS, "how", how, (left + 60, FOOT + 1, wide - 60, 4), 6.5, align="right"),
        label(
            SHEETS, "signature", "Inspected by ______________________________   on ____________________",
            (left + 55, FOOT + 6, wide - 55 - 60, 5), 8,
        ),
        label(
            SHEETS, "made", f"tunneldb {__version__}, [% format_date(now(), 'yyyy-MM-dd') %]",
            (right - 60, FOOT + 6, 60, 5), 6.5, align="right",
        ),
    ]  # fmt: skip
    if survey.intensity_kind != "none":
        texts.append(label(SHEETS, "gaps", f"[% {cut(gaps, 170, ' (all: report)')} %]", (left, 17, wide, 3.5), 7, bold=True))
    texts.append(
        label(SHEETS, "remarks", f"[% {cut(ON_PAGE.format('remarks'), 205, ' (all: report)')} %]", (left, 20.5, wide, 3.5), 6.5)
    )
    for page, rows in enumerate(goes_on, start=1):
        texts += [
            label(SHEETS, f"stretch {page + 1}", f"{stretch}, {rows} continued", (left, 7, 150, 8), 12, page=page, bold=True),
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


def _colours(catalogue: Catalogue, y: float) -> list[ET.Element]:
    """Make a line with the colours of the kinds and of the halos, as many as fit; leaks have their own."""
    named = [(f"■ {kind.label}", kind.look.colour) for kind in catalogue.kinds if kind.code not in DETECTED]
    named = [(f"○ {catalogue.severities[degree]}", colour) for degree, colour in HALOS.items()] + named
    texts, x = [], MARGIN
    for text, colour in named:
        width = 1.35 * len(text) + 3.0
        if x + width > PAGE[0] - MARGIN:
            break
        texts.append(label(SHEETS, f"colour {text}", text, (x, y, width, _LINE), 6.5, colour=colour))
        x += width
    return texts


def _left_out(y: float) -> ET.Element:
    """Make the line about findings that do not count."""
    width, said = table_width(FINDINGS), ON_PAGE.format("left_out")
    box = (PAGE[0] - MARGIN - width, y, width, _LINE)
    return label(SHEETS, "left out", f"[% coalesce('Not counted and not drawn: ' || {said}, '') %]", box, 7)


def scale_bar(strip: str, layout: str) -> ET.Element:
    """Make a scale bar of 10 m beneath a strip, by its key."""
    element = item(
        layout, SCALE_BAR, "scale bar", (MARGIN, FOOT, 50, 10), style="Line Ticks Up", mapUuid=strip, unitType="meters",
        unitLabel="m", numUnitsPerSegment="5", numSegments="2", numSegmentsLeft="0", numMapUnitsPerScaleBarUnit="1",
        segmentSizeMode="0", height="1.5", labelBarSpace="1", boxContentSpace="1", outlineWidth="0.2", alignment="0",
        numSubdivisions="1", minBarWidth="10", maxBarWidth="100", lineJoinStyle="miter", lineCapStyle="square",
    )  # fmt: skip
    element.append(text_style(7.0))
    return element
