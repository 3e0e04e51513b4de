"""The print layout "Deviation": an atlas with deviation from the design on a sheet for each 50 m of tunnel."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

from tunneldb import __version__
from tunneldb.export.qgis.extent import Extent
from tunneldb.export.qgis.layer import DEVIATION
from tunneldb.export.qgis.layout_items import PAGE, PAGE_ITEM, item, label
from tunneldb.export.qgis.raster import OFFSET_COLOURS
from tunneldb.export.qgis.sheet import scale_bar, strip_map, strip_scale
from tunneldb.export.qgis.sheet_tables import FOOT, MARGIN, ON_PAGE, TOP
from tunneldb.raster.gap_fill import FILL_NOTE
from tunneldb.raster.geotiff import DEVIATION_KINDS
from tunneldb.store.survey import Survey

_BARS = 3.0  # what bars of over- and underbreak have beside the lining, m: 1 m for each m²


def deviation_layout(
    survey: Survey, extent: Extent, coverage: tuple[str, str], bars: str, shown: tuple[str, float] | None
) -> ET.Element:
    """Return the element ``Layout`` of the sheets of deviation.

    Parameters
    ----------
    survey : Survey
        The survey.
    extent : Extent
        One of the inspection sheets, m.
    coverage : (str, str)
        Id and data source of the layer of the sheets.
    bars : str
        Id of the layer of over- and underbreak.
    shown : (str, float), optional
        Kind of the image, and where its colours are full, m; None without an image.
    """
    extent = replace(extent, ymin=extent.ymin - _BARS, ymax=extent.ymax + _BARS)
    scale = strip_scale(extent)
    below = TOP + (extent.ymax - extent.ymin) * 1000.0 / scale
    layout = ET.Element("Layout", name=DEVIATION, units="mm", printResolution="300")
    collection = ET.SubElement(layout, "PageCollection")
    collection.append(item(DEVIATION, PAGE_ITEM, "page 1", (0.0, 0.0, *PAGE), 0, background="true"))
    strip = strip_map(scale, extent, DEVIATION)
    layout.append(strip)
    layer = next((name for name, kind in DEVIATION_KINDS.items() if shown and kind == shown[0]), None)
    layout.extend(_texts(survey, scale, layer, bars))
    if shown is not None:
        layout.extend(_colours(shown[1], below + 6.0))
    layout.append(scale_bar(strip.attrib["uuid"], DEVIATION))
    ET.SubElement(
        layout, "Atlas", enabled="1", coverageLayer=coverage[0], coverageLayerSource=coverage[1],
        coverageLayerProvider="postgres", coverageLayerName=DEVIATION, hideCoverage="1", sortFeatures="1", sortAscending="1",
        sortKey='"number"', pageNameExpression='"label_from"', filterFeatures="0",
        filenamePattern=f"'{survey.name}-deviation-' || \"label_from\"",
    )  # fmt: skip
    options = ET.SubElement(ET.SubElement(layout, "customproperties"), "Option", type="Map")
    ET.SubElement(options, "Option", type="bool", name="singleFile", value="true")
    ET.SubElement(options, "Option", type="int", name="pdfTextFormat", value="1")
    return layout


def _texts(survey: Survey, scale: int, layer: str | None, bars: str) -> list[ET.Element]:
    """Make head and foot of the sheet; volumes are those of the sections whose bars begin on it."""
    stretch = "[% {} %] – [% {} %]".format(ON_PAGE.format("label_from"), ON_PAGE.format("label_to"))
    here = " AND ".join(
        f"\"chainage_from\" {sign} attribute(@atlas_feature, 'chainage_{end}')" for sign, end in ((">=", "from"), ("<", "to"))
    )
    of_layer = f" AND \"layer\" = '{layer}'" if layer else ""

    def volume(kind: str) -> str:
        chosen = f"\"kind\" = '{kind}'{of_layer} AND {here}"
        return f"[% coalesce(format_number(aggregate('{bars}', 'sum', \"volume\", {chosen}), 2), 'none') %]"

    left, right = MARGIN, PAGE[0] - MARGIN
    of_design = f" of layer {layer}" if layer else ""
    sums = f"Overbreak {volume('overbreak')} m³, underbreak {volume('underbreak')} m³, of what was seen"
    how = (
        f"Deviation from the design{of_design}, 1:{scale} on A4; up it arc from the crown, m, right wall above; {FILL_NOTE}."
        " White: not seen. Bars: overbreak below, underbreak above, 1 m for each m². Outlined: uneven beneath a straightedge."
    )
    what = f"Tunnel {survey.tunnel}, survey {survey.name} of {survey.date:%Y-%m-%d}"
    number = "[% @atlas_featurenumber %] of [% @atlas_totalfeatures %]"
    made = f"tunneldb {__version__}, [% format_date(now(), 'yyyy-MM-dd') %]"
    return [
        label(DEVIATION, "stretch", stretch, (left, 5, 150, 8), 15, bold=True),
        label(DEVIATION, "number", f"Deviation sheet {number}", (right - 110, 5, 110, 8), 10, align="right"),
        label(DEVIATION, "what", what, (left, 12.5, 140, 5), 8),
        label(DEVIATION, "sums", sums, (right - 140, 12.5, 140, 5), 8, align="right"),
        label(DEVIATION, "how", how, (left + 60, FOOT + 1, right - left - 60, 7), 6.5, align="right"),
        label(DEVIATION, "made", made, (right - 60, FOOT + 7, 60, 5), 6.5, align="right"),
    ]


def _colours(limit: float, y: float) -> list[ET.Element]:
    """Make a line with the colours of the image and their values, mm."""
    texts, x = [], MARGIN
    for share, colour in OFFSET_COLOURS:
        said = f"{1e3 * share * limit:+.0f} mm{' outside' if share == -1.0 else ' inside' if share == 1.0 else ''}"
        red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
        texts.append(label(DEVIATION, f"colour {share:g}", "■", (x, y, 4.0, 3.5), 9, colour=f"{red},{green},{blue}"))
        texts.append(label(DEVIATION, f"value {share:g}", said if share else "0", (x + 4.0, y, 30.0, 3.5), 7))
        x += 34.0
    return texts
