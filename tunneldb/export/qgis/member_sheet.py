"""The print layout "Members": an atlas with a page for each member, its faces unrolled with their spots."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from tunneldb import __version__
from tunneldb.export.qgis.layer import FACES, MEMBERS
from tunneldb.export.qgis.layout_items import (
    CELL_MARGIN,
    FRAME,
    MAP_ITEM,
    PAGE,
    PAGE_ITEM,
    ROW,
    SCALE_BAR,
    Column,
    cut,
    item,
    key,
    label,
    percent_expression,
    table,
    text_style,
)  # fmt: skip
from tunneldb.store.survey import Survey

STRIP = (277.0, 110.0)
"""Size of the drawing of a member's faces, mm; its cell in view ``member_sheet`` has the same proportions."""

PAGES = 3
"""Page of a member, and continuation pages of a long table."""

_MARGIN = 10.0
_TOP = 28.0  # where the strip begins, mm
_TABLE = 142.0  # where the table begins, mm
_FOOT = 196.0  # where the foot begins, mm

_MEMBER = "attribute(@atlas_feature, '{}')"
_COLUMNS: tuple[Column, ...] = (
    ("Spot", 'to_string("number")', 10, 2),
    ("Face", 'to_string("face")', 10, 2),
    ("Kind", '"kind"', 12, 1),
    ("Area, cm²", 'format_number(10000 * "area", 0)', 15, 2),
    ("dB", 'format_number("difference", 1)', 9, 2),
    ("σ", 'format_number("contrast", 1)', 9, 2),
    ("Sure", "round(100 * \"confidence\") || ' %'", 10, 2),
    ("Review", '"review"', 17, 1),
    ("Remark", cut('"remark"', "{0}"), 32, 1),
)
_LINE = 20  # letters that a line of a remark holds at the least
_TABLE_WIDTH = sum(column[2] + 2 * CELL_MARGIN for column in _COLUMNS)
_ON_MEMBER = f'"member" = {_MEMBER.format("number")} and "detected"'


def member_layout(survey: Survey, coverage: tuple[str, str], spots: tuple[str, str]) -> ET.Element:
    """Return the element ``Layout`` of the atlas of members.

    Parameters
    ----------
    survey : Survey
        The survey.
    coverage, spots : (str, str)
        Id and data source of the layer of the members' pages, and of the layer whose rows their tables list.
    """
    layout = ET.Element("Layout", name=MEMBERS, units="mm", printResolution="300")
    collection = ET.SubElement(layout, "PageCollection")
    for page in range(PAGES):
        collection.append(item(MEMBERS, PAGE_ITEM, f"page {page + 1}", (0.0, 0.0, *PAGE), page, background="true"))
    strip = _strip()
    layout.append(strip)
    layout.extend(_texts(survey))
    layout.append(_scale_bar(strip.attrib["uuid"]))
    layout.extend(_spots(spots))
    ET.SubElement(
        layout, "Atlas", enabled="1", coverageLayer=coverage[0], coverageLayerSource=coverage[1],
        coverageLayerProvider="postgres", coverageLayerName=MEMBERS, hideCoverage="1", sortFeatures="1", sortAscending="1",
        sortKey='"number"', pageNameExpression='"number"', filterFeatures="0",
        filenamePattern=f"'{survey.name}-member-' || \"number\"",
    )  # fmt: skip
    options = ET.SubElement(ET.SubElement(layout, "customproperties"), "Option", type="Map")
    ET.SubElement(options, "Option", type="bool", name="singleFile", value="true")
    ET.SubElement(options, "Option", type="int", name="pdfTextFormat", value="1")  # text that can be searched, not outlines
    return layout


def _strip() -> ET.Element:
    """Make the map of the member's faces, at the scale at which its cell fills the strip."""
    element = item(
        MEMBERS, MAP_ITEM, "strip", (_MARGIN, _TOP, *STRIP), frame="true", background="true", followPreset="true",
        followPresetName=FACES, mapRotation="0", drawCanvasItems="false", labelMargin="0,mm", keepLayerSet="false",
    )  # fmt: skip
    ET.SubElement(element, "Extent", xmin="0", ymin="0", xmax="2.77", ymax="1.1")
    ET.SubElement(element, "AtlasMap", atlasDriven="1", scalingMode="2", margin="0")
    return element


def _texts(survey: Survey) -> list[ET.Element]:
    """Make head and foot of the page, and heads of continuation pages."""
    number, kind, place = (_MEMBER.format(name) for name in ("number", "kind", "label"))
    faces, area, seen, bimodal = (_MEMBER.format(name) for name in ("faces", "area", "seen_share", "bimodal"))
    spots, dark, bright = (_MEMBER.format(name) for name in ("spots", "dark_area", "bright_area"))
    left, right, wide = _MARGIN, PAGE[0] - _MARGIN, PAGE[0] - 2 * _MARGIN
    title = f"Member [% {number} %], [% {kind} %][% coalesce(', ' || {place}, '') %]"
    page_of = "[% @atlas_featurenumber %] of [% @atlas_totalfeatures %]"
    what = f"{'Site' if survey.site else 'Tunnel'} {survey.tunnel}, survey {survey.name} of {survey.date:%Y-%m-%d}"
    sums = (
        f"[% {faces} %] face[% if({faces} = 1, '', 's') %], [% format_number({area}, 2) %] m², "
        f"[% {percent_expression(seen)} %] % inspected; [% {spots} %] spot[% if({spots} = 1, '', 's') %], "
        f"dark [% format_number({dark}, 4) %] m², bright [% format_number({bright}, 4) %] m²"
    )
    doubt = (
        f"[% if({bimodal}, 'More than half of it differs: its own surface cannot be identified. ', '') %]"
        f"[% if({seen} < 0.9995, 'There is no result for the part not inspected.', '') %]"
    )
    how = (
        "Faces unrolled, with the inspected share. Brown: darker than its own surface, yellow: brighter; "
        "outlined orange: open, blue: confirmed, grey: rejected. Hatched: less than half inspected."
    )
    texts = [
        label(MEMBERS, "member", title, (left, 5, 150, 8), 15, bold=True),
        label(MEMBERS, "number", f"Page {page_of}", (right - 110, 5, 110, 8), 10, align="right"),
        label(MEMBERS, "what", what, (left, 13, 110, 5), 8),
        label(MEMBERS, "sums", sums, (right - 167, 13, 167, 5), 8, align="right"),
        label(MEMBERS, "doubt", doubt, (left, 19, wide, 5), 8, bold=True),
        label(MEMBERS, "how", how, (left + 45, _FOOT + 1, wide - 45, 4), 6.5, align="right"),
        label(
            MEMBERS, "signature", "Inspected by ______________________________   on ____________________",
            (left + 55, _FOOT + 6, wide - 55 - 60, 5), 8,
        ),
        label(
            MEMBERS, "made", f"tunneldb {__version__}, [% format_date(now(), 'yyyy-MM-dd') %]",
            (right - 60, _FOOT + 6, 60, 5), 6.5, align="right",
        ),
    ]  # fmt: skip
    for page in range(1, PAGES):
        texts.append(
            label(MEMBERS, f"member {page + 1}", f"{title}, spots continued", (left, 7, 150, 8), 12, page=page, bold=True)
        )
        texts.append(label(MEMBERS, f"what {page + 1}", what, (left, 15.5, 140, 5), 8, page=page))
    return texts


def _scale_bar(strip: str) -> ET.Element:
    element = item(
        MEMBERS, SCALE_BAR, "scale bar", (_MARGIN, _FOOT, 45, 10), style="Line Ticks Up", mapUuid=strip, unitType="meters",
        unitLabel="m", numUnitsPerSegment="1", numSegments="2", numSegmentsLeft="0", numMapUnitsPerScaleBarUnit="1",
        segmentSizeMode="1", height="1.5", labelBarSpace="1", boxContentSpace="1", outlineWidth="0.2", alignment="0",
        numSubdivisions="1", minBarWidth="20", maxBarWidth="40", lineJoinStyle="miter", lineCapStyle="square",
    )  # fmt: skip
    element.append(text_style(7.0))
    return element


def _spots(spots: tuple[str, str]) -> list[ET.Element]:
    """Make the table of spots and its frames, two abreast on each page; a page with an empty first frame is not printed."""
    own = key(MEMBERS, "table")
    frames = []
    rows = 0
    for page in range(PAGES):
        y = _TABLE if page == 0 else _TOP
        rows += 2 * (int((_FOOT - 1 - y) / ROW) - 1)
        for half in range(2):
            x = _MARGIN + half * (PAGE[0] - 2 * _MARGIN - _TABLE_WIDTH)
            frames.append(
                item(
                    MEMBERS, FRAME, f"spots {2 * page + half + 1}", (x, y, _TABLE_WIDTH, _FOOT - 1 - y), page, multiFrame=own,
                    multiFrameTemplateUuid=own, hidePageIfEmpty=str(int(page > 0 and half == 0)), hideBackgroundIfEmpty="0",
                )
            )  # fmt: skip
    count = _MEMBER.format("spots")
    # The more spots there are, the less there is room for of their remarks.
    letters = f"({_LINE} * max(1, floor({rows} / max({count}, 1))))"
    columns = [(heading, expression.format(letters), width, align) for heading, expression, width, align in _COLUMNS]
    text = f"[% if({count} > {rows}, '… and ' || ({count} - {rows}) || ' more spots: table of the report', '') %]"
    more = label(MEMBERS, "more", text, (_MARGIN, _FOOT + 1, 150, 6), 11, page=PAGES - 1, bold=True)
    return [*frames, table(MEMBERS, frames, spots, columns, '"number"', rows, _ON_MEMBER, name="Spots"), more]
