"""Colours of the classes, the same in images, previews and QGIS."""

from __future__ import annotations

from tunneldb.ground.classes import Klass

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


def hexadecimal(colour: Colour) -> str:
    """Return a colour as ``#rrggbb``."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
