"""Unrolled images as layers of a project."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rasterio

from tunneldb.arrays import Float
from tunneldb.export.images.palette import PALETTES, RAMPS, hexadecimal
from tunneldb.export.images.tile_png import imported_stretch
from tunneldb.raster.gap_fill import FILL_NOTE
from tunneldb.raster.geotiff import CHANGE, DEVIATION_KINDS, RGB, imported_label
from tunneldb.raster.grey import grey_range

FILLED = "-filled"
"""Suffix of the kinds of image with filled gaps: each is below the image of its kind as measured."""

BED, SUBMERGED = "bed", "submerged"
"""Kinds of image from sonar scans: the bed, on the map, and submerged lining and bed, unrolled."""

KINDS = {
    "corrected": "Intensity, corrected",
    f"corrected{FILLED}": f"Intensity, corrected, {FILL_NOTE}",
    RGB: "Colour",
    f"{RGB}{FILLED}": f"Colour, {FILL_NOTE}",
    "raw": "Intensity, raw",
    "offset": "Offset",
    f"offset{FILLED}": f"Offset, {FILL_NOTE}",
    **{
        f"{kind}{end}": f"Deviation from the design, {layer}{said}"
        for layer, kind in DEVIATION_KINDS.items()
        for end, said in (("", ""), (FILLED, f", {FILL_NOTE}"))
    },
    CHANGE: "Change since an older survey",
    "state": "States: inspected, not inspected, dark",
    "class": "Classes",
    SUBMERGED: "Offset below the water",
    BED: "Depth of the water",
}
"""Kinds of image, the initially visible one first, with the names of their groups."""

OFFSET_RANGES = (0.1, 0.2, 0.5)
"""Offset of the full colours, m: the smallest that nine tenths of the images are within."""

CHANGE_RANGES = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1)
"""Change of the full colours, m, likewise."""

# Inwards red, outwards blue (ColorBrewer RdBu), the surface itself grey, to be told from paper.
OFFSET_COLOURS = ((-1.0, "#2166ac"), (-0.4, "#92c5de"), (0.0, "#e6e6e6"), (0.4, "#f4a582"), (1.0, "#b2182b"))
# The deeper the darker (ColorBrewer Blues).
_DEPTH_COLOURS = ("#eff3ff", "#bdd7e7", "#6baed6", "#3182bd", "#08519c")
_DEPTH = 2  # band of the depth in a raster of the bed
_SAMPLE = 1000


_IMPORTED = re.compile(r"-km-?\d+-imported-([a-z0-9-]+)")


def imported_name(path: Path) -> str | None:
    """Return the name of an imported image by its file name, None if it is no imported image."""
    found = _IMPORTED.search(path.stem)
    return None if found is None or found.end() != len(path.stem) else found[1]


def image_kind(path: Path) -> str | None:
    """Return the kind of an image by its file name, None if it is no image of the lining by the survey itself."""
    return None if imported_name(path) else next((kind for kind in KINDS if path.stem.endswith(kind)), None)


def offset_range(paths: Sequence[Path], ranges: Sequence[float] = OFFSET_RANGES) -> float:
    """Return the offset or change, m, at which the colours of these images are full: rock is rougher than concrete."""
    values = np.abs(_sample(paths))
    usual = np.quantile(values, 0.9) if len(values) else 0.0
    return next((limit for limit in ranges if limit >= usual), ranges[-1])


def shown_limits(images: Sequence[Path]) -> tuple[str, float] | None:
    """Return the kind of deviation of theme Deviation, among the existing images, and the value of its full colours, m."""
    for kind in DEVIATION_KINDS.values():
        paths = [path for path in images if image_kind(path) == kind]
        if paths:
            return kind, offset_range(paths)
    return None


def _sample(paths: Sequence[Path], band_number: int = 1) -> Float:
    """Return values of a band of images, sampled from all parts of each."""
    samples = [np.empty(0)]
    for path in paths:
        with rasterio.open(path) as image:
            rows, columns = min(image.height, _SAMPLE), min(image.width, _SAMPLE)
            band = image.read(band_number, out_shape=(rows, columns), masked=True)
        values = np.asarray(band.compressed(), dtype=np.float64)
        samples.append(values[np.isfinite(values)])
    return np.concatenate(samples)


def pipe(kind: str, paths: Sequence[Path]) -> ET.Element:
    """Return the element with the style of an image, the same for all of its kind.

    Intensity is drawn in grey, offset, deviation and change in diverging colours, each state or class in its own; depth the
    darker the deeper. An image in colour has its own colours.
    """
    element = ET.Element("pipe")
    if kind.removesuffix(FILLED) == RGB:
        renderer = _colours(element)
    elif kind in PALETTES:
        renderer = ET.SubElement(element, "rasterrenderer", type="paletted", band="1")
        entries = ET.SubElement(renderer, "colorPalette")
        for code, (name, rgb) in PALETTES[kind].entries.items():
            ET.SubElement(entries, "paletteEntry", value=str(code), color=hexadecimal(rgb), label=name, alpha="255")
    elif kind.removesuffix(FILLED) in ("offset", SUBMERGED, CHANGE, *DEVIATION_KINDS.values()):
        limit = offset_range(paths, CHANGE_RANGES if kind == CHANGE else OFFSET_RANGES)
        renderer = _ramp(
            element, 1, [(share * limit, f"{round(share * limit * 1000, 1):+g} mm", colour) for share, colour in OFFSET_COLOURS]
        )
    elif kind == BED:
        shallow, deep = np.quantile(_sample(paths, _DEPTH), [0.02, 0.98]) if paths else (0.0, 1.0)
        named = zip(np.linspace(shallow, deep, len(_DEPTH_COLOURS)).tolist(), _DEPTH_COLOURS, strict=True)
        renderer = _ramp(element, _DEPTH, [(depth, f"{depth:.2f} m", colour) for depth, colour in named])
    else:
        renderer = _greys(element, grey_range(_sample(paths)))
    return _finished(element, renderer, smooth=kind not in PALETTES)


def imported_title(paths: Sequence[Path]) -> str:
    """Return the title of the group of an imported image: kind, name and unit."""
    tags = _tags(paths[0])
    unit = tags.get("TUNNELDB_UNIT")
    return imported_label(imported_name(paths[0]) or "", tags.get("TUNNELDB_KIND", "other")) + (f", {unit}" if unit else "")


def imported_pipe(paths: Sequence[Path]) -> ET.Element:
    """Return the element with the style of an imported image: its colours, or values in the ramp of their kind or in grey."""
    with rasterio.open(paths[0]) as image:
        colour = image.count > 1
    tags = _tags(paths[0])
    ramp = RAMPS.get(tags.get("TUNNELDB_KIND", ""))
    element = ET.Element("pipe")
    if colour:
        return _finished(element, _colours(element), smooth=True)
    stretch = imported_stretch(_sample(paths))
    if ramp is None:
        return _finished(element, _greys(element, (stretch.low, stretch.high)), smooth=True)
    unit = f" {tags.get('TUNNELDB_UNIT', '')}".rstrip()
    places = np.linspace(stretch.low, stretch.high, len(ramp)).tolist()
    stops = [(value, f"{value:.3g}{unit}", hexadecimal(rgb)) for value, rgb in zip(places, ramp, strict=True)]
    return _finished(element, _ramp(element, 1, stops), smooth=True)


def _tags(path: Path) -> dict[str, str]:
    with rasterio.open(path) as image:
        return dict(image.tags())


def _colours(element: ET.Element) -> ET.Element:
    """Draw the bands red, green, blue and opacity; returns the renderer."""
    renderer = ET.SubElement(element, "rasterrenderer", type="multibandcolor", redBand="1", greenBand="2", blueBand="3")
    renderer.set("alphaBand", "4")
    _origin(renderer)
    return renderer


def _greys(element: ET.Element, limits: tuple[float, float]) -> ET.Element:
    """Draw the first band in grey between two values; returns the renderer."""
    renderer = ET.SubElement(element, "rasterrenderer", type="singlebandgray", grayBand="1", gradient="BlackToWhite")
    _origin(renderer)
    enhancement = ET.SubElement(renderer, "contrastEnhancement")
    ET.SubElement(enhancement, "minValue").text = f"{limits[0]:.3f}"
    ET.SubElement(enhancement, "maxValue").text = f"{limits[1]:.3f}"
    ET.SubElement(enhancement, "algorithm").text = "StretchToMinimumMaximum"
    return renderer


def _finished(element: ET.Element, renderer: ET.Element, *, smooth: bool) -> ET.Element:
    """Add what a style has besides its renderer; returns the element."""
    renderer.attrib.update({"opacity": "1", "alphaBand": renderer.get("alphaBand", "-1"), "nodataColor": ""})
    ET.SubElement(element, "brightnesscontrast", brightness="0", contrast="0", gamma="1")
    ET.SubElement(element, "huesaturation", saturation="0", colorizeOn="0", grayscaleMode="0")
    resampler = ET.SubElement(element, "rasterresampler", maxOversampling="2")
    if smooth:
        resampler.set("zoomedOutResampler", "bilinear")
    return element


def _ramp(element: ET.Element, band: int, items: Sequence[tuple[float, str, str]]) -> ET.Element:
    """Draw a band in colours between values, each with its label; returns the renderer."""
    low, high = str(items[0][0]), str(items[-1][0])
    renderer = ET.SubElement(
        element, "rasterrenderer", type="singlebandpseudocolor", band=str(band), classificationMin=low, classificationMax=high
    )
    _origin(renderer)
    shader = ET.SubElement(
        ET.SubElement(renderer, "rastershader"), "colorrampshader", colorRampType="INTERPOLATED", classificationMode="1",
        clip="0", minimumValue=low, maximumValue=high,
    )  # fmt: skip
    for value, label, colour in items:
        ET.SubElement(shader, "item", value=f"{value:g}", label=label, color=colour, alpha="255")
    return renderer


def _origin(renderer: ET.Element) -> None:
    """Declare that the limits are given, not computed from the image."""
    origin = ET.SubElement(renderer, "minMaxOrigin")
    ET.SubElement(origin, "limits").text = "None"
    ET.SubElement(origin, "extent").text = "WholeRaster"
    ET.SubElement(origin, "statAccuracy").text = "Estimated"
