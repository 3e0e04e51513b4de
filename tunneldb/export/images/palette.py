"""Colours of the classes of points and of the states of pixels, the same in images, previews and QGIS."""

from __future__ import annotations

from dataclasses import dataclass

from tunneldb.classification.classes import PointClass
from tunneldb.raster.state import PixelState

Colour = tuple[int, int, int]

BLUE, WHITE, RED = (33, 102, 172), (247, 247, 247), (178, 24, 43)
"""Colours of the least, the middle and the greatest value of images whose values have a sign."""

RAMPS: dict[str, tuple[Colour, ...]] = {
    "thermal": ((0, 0, 4), (87, 16, 110), (188, 55, 84), (249, 142, 9), (252, 255, 164)),
    "moisture": ((247, 251, 255), (198, 219, 239), (107, 174, 214), (33, 113, 181), (8, 48, 107)),
}
"""Colours of imported images by kind, from the least to the greatest value, at equal distances: inferno, ColorBrewer Blues."""

COLOURS: dict[PointClass, Colour] = {
    PointClass.UNASSIGNED: (176, 176, 176),
    PointClass.GROUND: (166, 129, 76),
    PointClass.LINING: (143, 163, 184),
    PointClass.NICHE: (78, 110, 168),
    PointClass.APPENDAGE: (230, 163, 30),
    PointClass.RAIL: (59, 59, 59),
    PointClass.OBJECT: (200, 50, 43),
    PointClass.SPHERE: (31, 166, 74),
    PointClass.NOISE: (176, 79, 196),
}


@dataclass(frozen=True)
class Palette:
    """Meaning of the codes in an 8-bit image.

    Attributes
    ----------
    entries : dict of int to (str, Colour)
        Name and colour of each code.
    nodata : int
        Code of pixels without data.
    """

    entries: dict[int, tuple[str, Colour]]
    nodata: int


PALETTES = {
    "class": Palette({int(klass): (klass.name.lower(), colour) for klass, colour in COLOURS.items()}, nodata=0),
    "state": Palette(
        {
            int(PixelState.EMPTY): ("unseen", (226, 229, 233)),
            int(PixelState.LINING): ("lining", COLOURS[PointClass.LINING]),
            int(PixelState.RECESS): ("recess", COLOURS[PointClass.NICHE]),
            int(PixelState.OFF): ("appendage", COLOURS[PointClass.APPENDAGE]),
            int(PixelState.FLOOR): ("floor", COLOURS[PointClass.GROUND]),
            int(PixelState.DARK): ("dark", (24, 24, 34)),
            int(PixelState.SUBMERGED): ("submerged", (120, 190, 220)),
        },
        nodata=255,
    ),
}
"""Palettes of the kinds of image with codes: classes of points, states of pixels."""


def ramp_colours(kind: str) -> list[str]:
    """Return the colours of values without signs, from the least to the greatest, as ``#rrggbb``: grey if not in RAMPS."""
    return [hexadecimal(colour) for colour in RAMPS.get(kind, ((0, 0, 0), (255, 255, 255)))]


def hexadecimal(colour: Colour) -> str:
    """Return a colour as ``#rrggbb``."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
