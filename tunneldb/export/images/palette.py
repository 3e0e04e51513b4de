"""Colours of the classes of points and of the states of pixels, the same in images, previews and QGIS."""

from __future__ import annotations

from dataclasses import dataclass

from tunneldb.classification.classes import Klass
from tunneldb.raster.pixel_state import State
from tunneldb.store.images import DARK

Colour = tuple[int, int, int]

COLOURS: dict[Klass, Colour] = {
    Klass.UNASSIGNED: (176, 176, 176),
    Klass.GROUND: (166, 129, 76),
    Klass.LINING: (143, 163, 184),
    Klass.NICHE: (78, 110, 168),
    Klass.APPENDAGE: (230, 163, 30),
    Klass.RAIL: (59, 59, 59),
    Klass.OBJECT: (200, 50, 43),
    Klass.SPHERE: (31, 166, 74),
    Klass.NOISE: (176, 79, 196),
}


@dataclass(frozen=True)
class Palette:
    """What the codes in an image of 8 bits mean.

    Attributes
    ----------
    entries : dict of int to (str, Colour)
        Name and colour of each code.
    nodata : int
        Code of pixels of which the image says nothing.
    """

    entries: dict[int, tuple[str, Colour]]
    nodata: int


PALETTES = {
    "class": Palette({int(klass): (klass.name.lower(), colour) for klass, colour in COLOURS.items()}, nodata=0),
    "state": Palette(
        {
            int(State.EMPTY): ("unseen", (226, 229, 233)),
            int(State.LINING): ("lining", COLOURS[Klass.LINING]),
            int(State.RECESS): ("recess", COLOURS[Klass.NICHE]),
            int(State.OFF): ("appendage", COLOURS[Klass.APPENDAGE]),
            int(State.FLOOR): ("floor", COLOURS[Klass.GROUND]),
            DARK: ("dark", (24, 24, 34)),
        },
        nodata=255,
    ),
}
"""Of the kinds of image that hold codes: classes of points, states of pixels."""


def hexadecimal(colour: Colour) -> str:
    """Return a colour as ``#rrggbb``."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
