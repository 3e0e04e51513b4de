"""Parts of a drawing that have no place on the map: the unrolled lining and the profiles side by side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from ezdxf.enums import TextEntityAlignment as Align

from tunneldb.arrays import Float
from tunneldb.export.exchange.entity import Spot, draw_spot, write
from tunneldb.export.exchange.lines import Profile, wet_parts
from tunneldb.finding_kind import DRY
from tunneldb.geometry.surface import Surface

Box = tuple[float, float, float, float]
"""Bounds: west, south, east, north, m."""

TEXT_HEIGHT = 0.25
"""Height of the text at leaks and profiles, m."""

GAP = 2.0
"""Distance between profiles, m."""

SHEET_ASPECT = 2.0
"""Approximate ratio of width to height of the sheet of profiles."""


def draw_unrolled(
    space: Any,
    corner: tuple[float, float],
    parts: Sequence[tuple[Float, Float]],
    named: Sequence[tuple[float, str]],
    spots: Sequence[Spot],
    gaps: Sequence[tuple[float, float, str]] = (),
) -> Box:
    """Draw the unrolled lining: chainage to the right, arc upwards, the right wall above the crown; returns its box.

    Parameters
    ----------
    space
        Space to draw in.
    corner : (float, float)
        Left upper corner of its box, m.
    parts : sequence of two (n, 2) float arrays
        Left and right edge of each part of the lining without a gap: chainage and arc, m.
    named : sequence of (float, str)
        Chainages of lines, and their labels.
    spots : sequence of Spot
        Spots on it.
    gaps : sequence of (float, float, str)
        Stretches in which leaks could be missed: chainages from and to, m, and the reason.
    """
    if not parts:
        return corner[0], corner[1], corner[0], corner[1]
    ends = np.concatenate([side for sides in parts for side in sides])
    low, high = ends.min(axis=0), ends.max(axis=0)
    shift = np.array([corner[0] - low[0], corner[1] - high[1] - 4 * TEXT_HEIGHT])
    for left, right in parts:
        for edge in (left, right, left * [1.0, 0.0]):
            space.add_lwpolyline(edge + shift, format="xy", dxfattribs={"layer": "UNROLLED"})
        for chainage, label in named:
            if left[0, 0] <= chainage <= left[-1, 0]:
                bottom, top = (np.array([chainage, np.interp(chainage, *side.T)]) + shift for side in (left, right))
                space.add_line(bottom, top, dxfattribs={"layer": "UNROLLED_CHAINAGE"})
                above = top + np.array([0.0, TEXT_HEIGHT])
                write(space, label.partition(".")[0], above, 2 * TEXT_HEIGHT, "UNROLLED_CHAINAGE", Align.BOTTOM_CENTER)
    for first, last, why in gaps:
        west, east = max(first, low[0]), min(last, high[0])
        if west < east:
            corners = np.array([(west, low[1]), (east, low[1]), (east, high[1]), (west, high[1])]) + shift
            space.add_lwpolyline(corners, format="xy", close=True, dxfattribs={"layer": "COVERAGE_GAP"})
            write(space, why, corners[0] + TEXT_HEIGHT, 2 * TEXT_HEIGHT, "COVERAGE_GAP")
    for spot in spots:
        draw_spot(space, spot, "UNROLLED", shift)
        if spot.kind not in DRY:
            east, north = spot.shape.bounds[2:]
            layer = "LEAK_TEXT" if spot.wet else "FINDING_TEXT"
            write(space, spot.text, np.array([east, north]) + shift, TEXT_HEIGHT, layer, Align.BOTTOM_LEFT)
    return corner[0], float(shift[1] + low[1]), float(shift[0] + high[0]), corner[1]


def draw_profiles(
    space: Any, corner: tuple[float, float], surface: Surface, named: Sequence[tuple[Profile, str]], spots: Sequence[Spot]
) -> Box:
    """Draw profiles in rows from the left upper corner, each about its axis, with its leaks; returns their box, m."""
    if not named:
        return corner[0], corner[1], corner[0], corner[1]
    bounds = np.array([(p.right.min(), p.up.min(), p.right.max(), p.up.max()) for p, _ in named])
    west, south = bounds[:, :2].min(axis=0)
    east, north = bounds[:, 2:].max(axis=0)
    width, height = east - west + GAP, north - south + GAP + 8 * TEXT_HEIGHT
    columns = max(1, min(len(named), round(math.sqrt(SHEET_ASPECT * len(named) * height / width))))
    leaks = [spot for spot in spots if spot.wet]
    ends = np.array([spot.shape.bounds for spot in leaks]).reshape(-1, 4)
    for k, (profile, label) in enumerate(named):
        row, column = divmod(k, columns)
        axis = np.array([corner[0] + column * width - west, corner[1] - row * height - north])
        _draw_profile(space, axis, profile, label, south)
        here = [leaks[n].shape for n in np.nonzero((ends[:, 0] <= profile.chainage) & (ends[:, 2] >= profile.chainage))[0]]
        for part in wet_parts(surface, profile.chainage, here):
            space.add_lwpolyline(part + axis, format="xy", dxfattribs={"layer": "LEAK_PROFILE", "const_width": 0.08})
    rows = math.ceil(len(named) / columns)
    return corner[0], float(corner[1] - rows * height), float(corner[0] + columns * width), corner[1]


def _draw_profile(space: Any, axis: Float, profile: Profile, label: str, south: float) -> None:
    outline = np.column_stack([profile.right, profile.up])
    space.add_lwpolyline(outline + axis, format="xy", close=True, dxfattribs={"layer": "PROFILE"})
    for end in (np.array([0.5, 0.0]), np.array([0.0, 0.5])):
        space.add_line(axis - end, axis + end, dxfattribs={"layer": "PROFILE_AXIS"})
    size = np.ptp(profile.right), np.ptp(profile.up)
    below = axis + np.array([0.0, south - TEXT_HEIGHT])
    write(space, label, below, 2 * TEXT_HEIGHT, "PROFILE_TEXT", Align.TOP_CENTER)
    write(
        space,
        f"{size[0]:.2f} × {size[1]:.2f} m",
        below - np.array([0.0, 3.5 * TEXT_HEIGHT]),
        TEXT_HEIGHT,
        "PROFILE_TEXT",
        Align.TOP_CENTER,
    )
